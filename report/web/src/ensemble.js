import { decadeTicks, drawAxes, linearTicks } from "./axes.js";
import { card, h, lead, section, svg, table } from "./dom.js";
import { duration, grouped, minus, number, short } from "./format.js";
import { checkName } from "./sections.js";

const errorNames = { energy_error: "energy", linear_momentum_error: "linear momentum", angular_momentum_error: "angular momentum" };
const limitOf = (d, key) => d.limits?.[key.replace("_error", "")] ?? null;

const withUnit = (x, unit) => number(x) + (unit && unit !== "1" ? ` ${unit}` : "");
/** Whether a column's numbers differ by more than rounding. */
const varies = (c) => c.high - c.low > 1e-12 * Math.max(Math.abs(c.low), Math.abs(c.high));

/** A word of a shell, in quotes where it needs them. */
const word = (w) => (/^[\w./+:=-]+$/.test(w) ? w : `'${w.replaceAll("'", "'\\''")}'`);
/** The command that runs a case by itself; where results do not suffice, from the scene file. */
const command = (d, n) => `porthos run ${d.rerun === null ? "SCENE" : word(d.rerun)} --case ${n}`;

export function verdict(d) {
  const e = d.ensemble;
  if (!e) return section("verdict", "Verdict", h("div", { class: "verdict" }, h("span", { class: "badge open" }, "No verdict"), h("p", {}, "There is no ensemble.json of this ensemble.")));
  const pass = e.verdict === "pass", open = e.verdict === "not judged", failed = e.cases - e.passed - e.not_judged;
  const words = [`${grouped(e.passed)} of ${grouped(e.cases)} cases passed`, failed && `${grouped(failed)} did not`, e.not_judged && `${grouped(e.not_judged)} are not judged: no check tells of their motion`].filter(Boolean).join("; ");
  const rows = Object.keys(errorNames).filter((k) => e[k]).map((k) => {
    const s = e[k], limit = limitOf(d, k), exact = s.max === 0;
    return [errorNames[k], ...(exact ? ["exactly 0", "", ""] : [s.median, s.q95, s.max].map((x) => number(x))), limit === null ? "–" : number(limit), exact || s.case_of_max === undefined ? "" : caseLink(s.case_of_max)];
  });
  const kinds = [["failures", (why) => why], ["failed_checks", (name) => checkName(name)], ["not_judged_checks", (name) => `${checkName(name)}: not judged`]].flatMap(([what, words]) =>
    Object.entries(e[what] || {}).map(([name, n]) => {
      const first = e.first_cases?.[what]?.[name] || [];
      return [words(name), grouped(n), minus(e.check_limits?.[name] || "–"), h("span", {}, first.map((c) => [caseLink(c), " "]), n > first.length && first.length ? "…" : "")];
    }));
  const stopped = Object.entries(e.stopped || {}).map(([name, n]) => h("li", {}, `${grouped(n)} cases ended by the stop ${name}`));
  const requirements = Object.entries(e.requirements || {}).map(([name, w]) => h("li", {}, `${checkName(name)}: the ${w.is} ${w.output} at the records is ${withUnit(w.value, w.unit)}${w.limit === undefined ? "" : `, with a limit of ${withUnit(w.limit, w.unit)}`}, in case `, caseLink(w.case)));
  return section("verdict", "Verdict",
    h("div", { class: "verdict" }, h("span", { class: `badge ${pass ? "pass" : open ? "open" : "fail"}` }, pass ? "Pass" : open ? "Not judged" : "Fail"), h("p", {}, `${words}.`)),
    card(table(["Relative error", "median", "95 % below", "largest", "limit", "its case"], rows, ["", "n", "n", "n", "n", "n"])),
    kinds.length ? card(table(["Not passed", "cases", "limit", "the first of them"], kinds, ["", "n", "n", ""])) : "",
    requirements.length || stopped.length ? card(h("ul", { class: "notes" }, requirements, stopped)) : "");
}

const chosen = { listeners: [], case: null };
/** Shows a case under "Cases". */
function choose(n, scroll) {
  chosen.case = n;
  for (const f of chosen.listeners) f(n);
  if (scroll) document.getElementById("cases")?.scrollIntoView();
}
const caseLink = (n) => h("button", { type: "button", class: "case", onclick: () => choose(n, true) }, grouped(n));

/** The requirements of ensemble.json on a column. */
const requirementsOn = (d, c) => c.group !== "output" ? [] : Object.entries(d.ensemble?.requirements || {}).filter(([, w]) => w.limit !== undefined && c.name === `${w.output}, ${w.is}`);
/** What limits a column, as its bars are placed: [name, limit]. */
const limitsOf = (d, c) => requirementsOn(d, c).map(([name, w]) => [checkName(name), w.limit])
  .concat(c.group === "error" && limitOf(d, c.name.replaceAll(" ", "_")) > 0 ? [["", Math.log10(limitOf(d, c.name.replaceAll(" ", "_")))]] : []);

/** A histogram: cases that passed below, the others upon them; a dashed line where a limit is. The axis reaches to a limit unless the bars would be lost beside it. */
function histogram(c, limits) {
  const width = 320, height = 146, top = 14, base = 104, n = c.passed.length, most = Math.max(1, ...c.passed.map((v, i) => v + c.others[i]));
  const near = limits.filter(([, at]) => at > c.high - 6 * (c.high - c.low) && at < c.low + 6 * (c.high - c.low));
  const low = Math.min(c.low, ...near.map((l) => l[1])), high = Math.max(c.high, ...near.map((l) => l[1]));
  const x = (at) => ((at - low) / (high - low)) * width, bar = x(c.low + (c.high - c.low) / n) - x(c.low);
  const picture = svg("svg", { class: "wp", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `distribution of ${c.name}` });
  const tall = (v) => (v / most) * (base - top);
  c.passed.forEach((v, i) => {
    const o = c.others[i], at = x(c.low) + i * bar + 0.05 * bar;
    if (v) picture.append(svg("rect", { x: at, width: Math.max(0.6, 0.9 * bar), y: base - tall(v), height: tall(v), fill: "var(--accent)" }));
    if (o) picture.append(svg("rect", { x: at, width: Math.max(0.6, 0.9 * bar), y: base - tall(v + o), height: Math.max(1.5, tall(o)), fill: "var(--fail)" }));
  });
  picture.append(svg("line", { class: "frame", x1: 0, x2: width, y1: base, y2: base }));
  const value = (at) => (c.log ? 10 ** at : at), label = (at) => (c.log ? number(value(at), 2) : short(Number(value(at).toPrecision(3))));
  picture.append(svg("text", { x: 0, y: base + 18 }, label(low)), svg("text", { x: width, y: base + 18, "text-anchor": "end" }, label(high)),
    svg("text", { class: "axis", x: width / 2, y: base + 36, "text-anchor": "middle" }, c.unit || (c.group === "error" ? "relative" : c.group === "input" ? "as in the scene" : "1")),
    svg("text", { x: 0, y: 10 }, `${grouped(most)} cases`));
  for (const [, at] of near)
    picture.append(svg("line", { class: "limit", x1: x(at), x2: x(at), y1: top, y2: base + 4, stroke: "var(--ink)", "stroke-dasharray": "3 3", "stroke-width": 1.5 }));
  const words = limits.map(([name, at]) => `${name ? `${name}: ` : ""}limit ${withUnit(value(at), c.unit)}${near.some((l) => l[1] === at) ? ", dashed" : ", far away"}`);
  return card(h("h3", {}, c.name), h("div", { class: "soft" }, [...words, c.log ? "logarithmic" : ""].filter(Boolean).join("; ") || "\u00a0"), picture);
}

const groups = [["error", "Errors"], ["output", "Quantities of interest"], ["end", "Ends"], ["event", "Times of events"], ["input", "Inputs"]];
export function distributions(d) {
  if (!d.cases?.columns.length) return null;
  const limited = (c) => requirementsOn(d, c).length > 0, shown = d.cases.columns.filter(varies);
  const constant = d.cases.columns.filter((c) => !varies(c) && !(c.group === "event" && isAlways(d, c)));
  const parts = [["Requirements", shown.filter(limited), "requirement"], ...groups.map(([g, title]) => [title, shown.filter((c) => c.group === g && !limited(c)), g])].filter(([, list]) => list.length);
  const some = d.cases.columns.some((c) => c.others.some((v) => v > 0));
  return section("distributions", "Distributions", lead(`Over all ${grouped(d.cases.count)} cases. `, some ? "Red: cases that did not pass." : "All cases passed."),
    parts.map(([title, list, g]) => {
      const grid = h("div", { class: "grid3" }, list.map((c) => histogram(c, limitsOf(d, c))));
      return g === "input" || list.length > 12 ? h("details", {}, h("summary", {}, `${title} (${list.length})`), grid) : h("div", {}, h("h3", { class: "group-title" }, title), grid);
    }),
    constant.length ? h("p", { class: "soft" }, "The same in every case: ", constant.map((c) => `${c.name} ${withUnit(c.log ? 10 ** c.low : c.low, c.unit)}`).join("; "), ".") : "");
}

/** The places of a column's numbers along `length` pixels from `start`, and the ticks. */
function axis(c, start, length) {
  const place = (x) => (c.log ? Math.log10(x) : x);
  let low = Infinity, high = -Infinity;
  for (const x of c.v) if (Number.isFinite(x) && (!c.log || x > 0)) low = Math.min(low, place(x)), high = Math.max(high, place(x));
  if (c.log) low = Math.floor(low), high = Math.ceil(high + 1e-9);
  if (!(high > low)) low -= 0.5, high = low + 1;
  const at = (v) => start + ((v - low) / (high - low)) * length;
  return { of: (x) => at(place(x)), place: at, ticks: c.log ? decadeTicks(low, high, 7) : linearTicks(low, high, 5), name: c.name + (c.unit ? ` [${c.unit}]` : "") };
}

/** One number of the cases against another; a click on a point shows its case. */
function cloud(d, cx, cy) {
  const box = { width: 900, height: 420, left: 84, right: 16, top: 12, bottom: 52 }, base = box.height - box.bottom;
  const x = axis(cx, box.left, box.width - box.left - box.right), y = axis(cy, base, box.top - base);
  const picture = svg("svg", { class: "wp", viewBox: `0 0 ${box.width} ${box.height}`, role: "img", "aria-label": `${cy.name} against ${cx.name}` });
  drawAxes(picture, box, x, y);
  const points = d.cases.shown.map((n, i) => [n, x.of(cx.v[i]), y.of(cy.v[i]), d.cases.verdicts[i]]).filter(([, a, b]) => Number.isFinite(a) && Number.isFinite(b));
  points.sort((a, b) => (a[3] === 1 ? 0 : 1) - (b[3] === 1 ? 0 : 1));  // those that did not pass on top
  for (const [n, a, b, passed] of points) {
    const dot = svg("circle", { cx: a, cy: b, r: passed === 1 ? 2.6 : 3.6, fill: passed === 1 ? "var(--accent)" : passed === 2 ? "var(--warn)" : "var(--fail)", "fill-opacity": passed === 1 ? 0.55 : 0.9, class: "point" });
    dot.append(svg("title", {}, `case ${n}`));
    dot.addEventListener("click", () => choose(n, true));
    picture.append(dot);
  }
  return picture;
}

export function relations(d) {
  const columns = d.cases?.columns;
  if (!columns || columns.length < 2) return null;
  const first = (groupsOf, not) => columns.find((c) => groupsOf.includes(c.group) && c !== not);
  let cx = first(["input"]) || columns[0], cy = first(["output"], cx) || first(["error", "end", "event"], cx) || columns.find((c) => c !== cx);
  const box = h("div", {}), draw = () => box.replaceChildren(cloud(d, cx, cy));
  const picker = (label, now, set) => {
    const select = h("select", { "aria-label": label, onchange: () => { set(columns[select.selectedIndex]); draw(); } }, columns.map((c) => h("option", { selected: c === now }, c.name)));
    return h("label", {}, label, select);
  };
  draw();
  const all = d.cases.shown.length === d.cases.count;
  return section("relations", "What depends on what", lead(all ? "" : `${grouped(d.cases.shown.length)} of ${grouped(d.cases.count)} cases: the first that did not pass, the worst, and others evenly. `, "A click on a point shows its case."),
    card(h("div", { class: "bar" }, picker("across", cx, (c) => (cx = c)), picker("up", cy, (c) => (cy = c))), box));
}

/** Why a case did not pass: with the numbers where they are there, else by the name of the check. */
function reasons(d, i) {
  if (d.cases.verdicts[i] === 1) return [];
  const list = d.cases.status[i] ? [d.cases.status[i]] : [], told = new Set();
  for (const c of d.cases.columns) {
    const key = c.name.replaceAll(" ", "_"), limit = c.group === "error" ? limitOf(d, key) : null;
    for (const [name, w] of requirementsOn(d, c).filter(([check]) => d.cases.failed[i].includes(check))) {
      list.push(`${checkName(name)}: the ${w.is} ${w.output} at the records is ${withUnit(c.v[i], c.unit)}, with a limit of ${withUnit(w.limit, c.unit)}`);
      told.add(name);
    }
    if (limit !== null && c.v[i] > limit) {
      list.push(`${c.name} ${number(c.v[i])} is above its limit ${number(limit)}`);
      told.add(key.replace("_error", ""));
    }
    if (c.group === "event" && Number.isNaN(c.v[i])) {
      list.push(`${c.name} never happened`);
      told.add("missed_events");
    }
  }
  for (const check of d.cases.failed[i]) if (!told.has(check)) list.push(`the check ${checkName(check)} does not hold`);
  return list;
}

/** The numbers of a case and the command that runs it again by itself. */
function detail(d, n) {
  const i = d.cases.shown.indexOf(n), line = command(d, n);
  const copy = h("button", { type: "button", onclick: async () => {
    try { await navigator.clipboard.writeText(line); copy.textContent = "copied"; } catch { getSelection().selectAllChildren(code); }
  } }, "copy");
  const code = h("code", {}, line);
  const numbers = i < 0 ? h("p", { class: "soft" }, "Its numbers are in ensemble.h5 alone.")
    : h("div", { class: "columns" }, groups.map(([g, title]) => {
      const list = d.cases.columns.filter((c) => c.group === g);
      return list.length ? h("div", {}, h("h3", {}, title), table(["", ""], list.map((c) => [c.name, `${number(c.v[i], 5)}${c.unit ? ` ${c.unit}` : ""}`]), ["", "n"])) : null;
    }));
  const state = i < 0 ? "" : { 0: "did not pass", 1: "passed", 2: "not judged" }[d.cases.verdicts[i]];
  const why = i < 0 ? [] : reasons(d, i);
  return card(h("h3", {}, `Case ${grouped(n)}`, state ? `: ${state}` : ""), why.length ? h("p", {}, `${why.join("; ")}.`) : "", h("div", { class: "bar" }, code, copy), h("p", { class: "soft" }, d.rerun === null ? "SCENE: the scene file, as results do not hold its law. " : "", "It runs the case by itself, with the same bits, and makes its own report with the motion."), numbers);
}

export function cases(d) {
  if (!d.cases) return null;
  const bad = d.cases.shown.filter((_, i) => d.cases.verdicts[i] !== 1);
  const worst = ["energy_error", "angular_momentum_error", "linear_momentum_error"].map((k) => (d.ensemble?.[k]?.max > 0 ? d.ensemble[k].case_of_max : undefined)).filter((n) => n !== undefined);
  const box = h("div", {});
  chosen.listeners = [(n) => box.replaceChildren(detail(d, n))];
  const list = bad.slice(0, 60), rest = (d.ensemble ? d.ensemble.cases - d.ensemble.passed : bad.length) - list.length;
  const start = bad[0] ?? worst[0];
  if (start !== undefined) choose(start, false);
  return section("cases", "Cases",
    card(list.length ? h("p", {}, "Not passed: ", list.map((n) => [caseLink(n), " "]), rest > 0 ? `and ${grouped(rest)} more` : "") : h("p", {}, "Every case passed."),
      worst.length ? h("p", {}, "The largest errors: ", [...new Set(worst)].map((n) => [caseLink(n), " "])) : ""),
    box);
}

/** Whether an event happens at the same time in every case. */
const always = (d, e) => e.happened === d.ensemble.cases && !varies({ low: e.time_s.min, high: e.time_s.max });
const isAlways = (d, c) => (d.ensemble?.events || []).some((e) => e.event === c.name && always(d, e));

export function events(d) {
  const list = d.ensemble?.events;
  if (!list?.length) return null;
  const same = list.filter((e) => always(d, e)), others = list.filter((e) => !always(d, e));
  return section("events", "Events", same.length ? h("p", {}, "In every case: ", same.map((e) => `${e.event} at ${duration(e.time_s.median)}`).join("; "), ".") : "",
    !others.length ? "" : card(table(["Event", "cases", "first", "median", "last"],
    others.map((e) => [e.event, grouped(e.happened), ...["min", "median", "max"].map((k) => (e.happened ? duration(e.time_s[k]) : "–"))]), ["", "n", "n", "n", "n"])));
}

export const meta = (d) => (d.ensemble ? `${grouped(d.ensemble.cases)} cases, ${d.ensemble.method}, ${d.ensemble.step_s} s, ${duration(d.ensemble.duration_s)} each` : "");
