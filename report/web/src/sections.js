import { chart } from "./charts.js";
import { card, h, lead, section, table } from "./dom.js";
import { duration, grouped, minus, number, rowsOf, short } from "./format.js";
import { workPrecision } from "./scatter.js";

const any = (v) => v && v.some((x) => Number.isFinite(x) && x !== 0);
const absolute = (v) => Float64Array.from(v, Math.abs);
const wide = (t) => t.length > 3 && t[t.length - 1] > 100 * (t.find((x) => x > 0) || 1);

const names = {
  outcome: "end of the run reached", missed_events: "events that never happened", rates: "positions move as their rates say", missed_handovers: "controllers that never handed over",
  energy: "energy", linear_momentum: "linear momentum", angular_momentum: "angular momentum", quaternion_norm: "quaternion norm",
  balance: "power balance", symmetry: "forth and back", step_halving: "half the step", momentum_across_events: "momentum across events", orbital: "orbital ledger", coupling: "coupling ledger",
  constraints: "gaps of loops", constraint_rates: "rates of these gaps",
};

/** A check as a reader calls it: "power balance", "stop.too fast". */
export const checkName = (name) => names[name] || (name.startsWith("stop.") ? name : name.replaceAll("_", " "));

/** How far below its limit a value is: a factor, and a bar that is full from six decades on. */
function room(c) {
  if (!(c.value > 0) || !(c.limit > 0)) return c.pass && c.value === 0 ? h("span", { class: "soft" }, "exact") : "";
  const decades = Math.log10(c.limit / c.value), factor = c.pass ? c.limit / c.value : c.value / c.limit;
  return h("div", { class: "room" }, h("span", { class: "n" }, `${number(Number(factor.toPrecision(2)), 2)}×`, h("span", { class: "wide-only" }, ` ${c.pass ? "below" : "above"}`)),
    h("span", { class: `track ${c.pass ? "" : "fail"}` }, h("i", { style: `width:${c.pass ? Math.min(100, Math.max(3, (100 * decades) / 6)) : 100}%` })));
}

export function verdict(d) {
  const s = d.summary;
  if (!s) return section("verdict", "Verdict", h("div", { class: "verdict" }, h("span", { class: "badge open" }, d.status.state === "unfinished" ? "Unfinished" : "No verdict"),
    h("p", {}, d.status.text || "There is no summary of this run.")));
  const failed = s.checks.filter((c) => !c.pass), pass = s.verdict === "pass", open = s.verdict === "not judged", none = s.not_applicable || [];
  const undecided = open ? none.filter((n) => n.undecided) : [];
  const what = pass ? (s.checks.length === 1 ? "The one check holds." : `All ${s.checks.length} checks hold.`)
    : undecided.length ? `The rows do not decide: ${undecided.map((n) => checkName(n.name)).join(", ")}.`
    : open ? "The run reached its end, and none of its checks could have told a wrong motion from a right one."
    : failed.length ? `${failed.length} of ${s.checks.length} checks ${failed.length > 1 ? "do" : "does"} not hold: ${failed.map((c) => checkName(c.name)).join(", ")}.` : "The run did not reach its end.";
  // The sentence beside a failure is about what failed.
  const other = failed.some((c) => ["energy", "balance", "outcome"].includes(c.name)) ? null : failed[0];
  const begins = other && (other.name === "missed_events" ? ["it never happened: ", "the run ended before an event "] : [`the error of ${other.name} `]);
  const told = other && (s.notes || []).find((n) => begins.some((words) => n.startsWith(words)))?.replace(/^it never happened: /, "an event never happened: ");
  const beside = told ? minus(`${told[0].toUpperCase()}${told.slice(1)}.`)
    : other ? `${checkName(other.name)}: ${number(other.value)}, with a limit of ${number(other.limit)}.`
    : `The energy error ${minus(s.energy.growth)}.`;
  const perStep = s.steps > 0 ? s.cpu_s / s.steps : 0;
  const tile = (value, text) => h("div", { class: "tile" }, h("b", {}, value), h("span", {}, text));
  return section("verdict", "Verdict",
    h("div", { class: "verdict" }, h("span", { class: `badge ${pass ? "pass" : open ? "open" : "fail"}` }, pass ? "Pass" : open ? "Not judged" : "Fail"),
      h("p", {}, what, " ", s.outcome !== "ok" ? `The run ended early: ${s.outcome}. ` : "", h("span", { class: "soft" }, beside))),
    s.checks.length + none.length ? card(table(["check", "", "value", "limit", "against the limit"],
      [...s.checks.map((c) => c.name === "outcome" ? [names.outcome, h("span", { class: "word fail" }, "✗ fail"), "no", "–", ""] : [checkName(c.name), h("span", { class: `word ${c.pass ? "pass" : "fail"}` }, c.pass ? "✓ pass" : "✗ fail"), [number(c.value), h("span", { class: "narrow-only" }, `of ${number(c.limit)}`)], number(c.limit), room(c)]),
        ...none.map((n) => [checkName(n.name), h("span", { class: "soft" }, "not applicable"), "–", "–", h("span", { class: "soft" }, n.why)])], ["", "", "n", "n wide-cell", ""])) : "",
    h("div", { class: "tiles" },
      tile(number(s.energy.max_rel_error), "largest energy error, relative"),
      tile(`${number(s.energy.initial_J, 6)} J`, "energy at the start"),
      s.method === "recorded" ? tile(duration(s.simulated_s), rowsOf(s)) : [
        tile(duration(s.simulated_s), `simulated, ${grouped(s.steps)} steps`),
        tile(duration(s.cpu_s), `CPU, ${perStep > 0 ? `${number(1e6 * perStep)} µs a step` : "–"}`),
        tile(grouped(s.records), "records")]));
}

export function energy(d) {
  const s = d.series, t = s.t;
  const colours = (i) => `c${i % 8}`;
  const negative = s.stored.filter((x) => x.least < 0).map((x) => x.name);
  const stack = s.stored.map((x, i) => ({ name: x.name, v: x.top, shown: x.v, colour: colours(i), fill: true, width: 1.3 }));
  const flows = [
    ...s.supplied.map((x, i) => ({ name: `${x.name} (in)`, v: x.v, colour: colours(i), width: 1.8 })),
    ...s.dissipated.map((x, i) => ({ name: `${x.name} (lost)`, v: x.v.map((y) => -y), shown: x.v, colour: colours(i + s.supplied.length), dash: [7, 4], width: 1.8 })),
  ];
  const balance = d.summary?.balance;
  const row = (name, what, joule) => [name, what, number(joule, 5)];
  return section("energy", "Energy",
    lead("Where the energy stands, and what sources put in and losses take. The residual of this balance is the error below."),
    card(chart({ title: "Stored energies, stacked", what: negative.length ? `From zero, ${negative.join(", ")} from its least value.` : "", unit: "energy [J]", t, stacked: true, height: 280, lines: stack })),
    flows.length ? card(chart({ title: "Ledger by port", what: "Work since the start: what came in counts up, what was lost counts down.", unit: "work [J]", t, lines: flows, height: 280 })) : "",
    balance ? card(h("h3", {}, "Balance over the run"), table(["what", "kind", "J"], [
      ...Object.entries(balance.storages).map(([n, j]) => row(n, "change of stored energy", j)),
      ...Object.entries(balance.ports).map(([n, j]) => row(n, "supplied", j)),
      ...Object.entries(balance.losses).map(([n, j]) => row(n, "dissipated", j)),
      row(h("b", {}, "residual"), "stored + dissipated − supplied", balance.defect_J),
    ], ["", "soft", "n"]), flows.length ? "" : h("p", { class: "what soft" }, "Nothing supplies or takes energy in this scene.")) : "");
}

/** c √t and c t through the last value of a growing error. */
function guides(t, end) {
  const last = t[t.length - 1];
  return [
    { name: "∝ √t (random walk)", v: Float64Array.from(t, (x) => end * Math.sqrt(x / last)), colour: "guide", dash: [7, 5], width: 1.3 },
    { name: "∝ t (drift)", v: Float64Array.from(t, (x) => (end * x) / last), colour: "guide", dash: [2, 4], width: 1.3 },
  ];
}

export function errors(d) {
  const s = d.series, t = s.t, scale = d.summary?.energy.scale_J || 1, relative = !!d.summary;
  const limit = d.summary?.checks.find((c) => c.name === "energy")?.limit;
  const error = absolute(s.error).map((x) => x / scale), top = error.reduce((a, b) => (b > a ? b : a), 0);
  // The limit is shown where it leaves most of the plot to the data; six decades below the largest error in any case.
  const shown = limit > 0 && limit < 1e4 * top, decades = 6 + (shown ? Math.max(0, Math.ceil(Math.log10(limit / top))) : 0);
  const rms = s.rms.map((x) => x / scale), end = rms[rms.length - 1];
  const recorded = d.summary?.method === "recorded";
  const zero = (check, v) => {
    const why = d.summary?.not_applicable?.find((n) => n.name === check)?.why;
    if (d.summary?.checks.some((c) => c.name === check)) return "0 at every record: kept exactly.";
    if (why) return `Not an error of this run: ${why}.`;
    if (!v.some(Number.isFinite)) return "No invariant of this system.";
    if (check === "linear_momentum" && d.summary?.centre_of_mass && !recorded) return "The centre of mass moved in closed form: nothing was left to check.";
    return d.summary ? "0 at every record. The scene asks for no check of it." : "0 at every record.";
  };
  const judged = (check) => d.summary.checks.some((c) => c.name === check);
  const applies = (check) => !d.summary.not_applicable?.some((n) => n.name === check && !n.undecided) || (check === "linear_momentum" && judged("centre_of_mass"));
  const flat = (title, what, unit, v, colour, check) => recorded && !applies(check) ? "" : card(any(v)
    ? chart({ title, what, unit, t, log: true, logTime: wide(t), height: 220, decades: 6, lines: [{ name: "error", v, colour, width: 1.2 }] })
    : h("div", {}, h("h3", {}, title), h("p", { class: "soft" }, zero(check, v))));
  return section("errors", "Errors",
    lead(`${recorded ? "Against the first row, of the doubles of the file" : "Against the start of the run, measured in extended precision"}. Rounding errors of a good method add up like a random walk, √t; a steady drift grows like t.`),
    card(any(error) ? chart({
      title: "Residual of the energy balance", what: `|H − H(start) − supplied + dissipated|${relative ? `, relative to ${number(scale, 4)} J` : ""}.`, unit: relative ? "relative error" : "error [J]",
      t, log: true, logTime: wide(t), height: 320, decades,
      lines: [{ name: "|error|", v: error, colour: "c7", width: 1 }, { name: "rms so far", v: rms, colour: "c0", width: 2.2 }, ...(end > 0 ? guides(t, end) : []),
        ...(shown ? [{ name: "limit", v: new Float64Array(t.length).fill(limit), colour: "fail", dash: [3, 4], width: 1.4 }] : [])],
      note: limit > 0 && !shown ? `The limit, ${number(limit)}, is off the plot.` : "",
    }) : h("p", {}, "The balance closes exactly at every record.")),
    h("div", { class: "grid3" },
      flat(...(recorded && judged("centre_of_mass") ? ["Centre of mass", "|P − P(start) − M g t|"] : ["Linear momentum", "|P − P(start)|"]), "kg m/s", s.linear, "c2", "linear_momentum"), flat("Angular momentum", "|L − L(start)|", "kg m²/s", s.angular, "c4", "angular_momentum"), flat("Quaternion norm", "| |ξ| − 1 |, largest", "", s.quaternion, "c3", "quaternion_norm")));
}

/** What moved: joints, then bodies that are free. Many lines are cut into plots of eight. */
export function motion(d) {
  const m = d.motion;
  if (!m) return null;
  const plots = m.panels.flatMap((p) => {
    const [, title, unit] = p.what.match(/^(.*) \[(.*)\]$/), count = Math.ceil(p.lines.length / 8);
    const capital = (name) => name[0].toUpperCase() + name.slice(1), shown = title === "joints" || title === "outputs" || title.includes(" ") ? capital(title) : title;  // an output keeps its name
    const elsewhere = /^(rates of )?joints$/.test(title) ? title.replace("joints", "turning joints") : `${title}, smaller`, others = m.panels.find((q) => q.what === `${elsewhere} [${unit}]`);
    return Array.from({ length: count }, (_, k) => chart({
      title: `${shown}${count > 1 ? `, ${k + 1} of ${count}` : ""}`, unit: unit === "1" ? "" : `[${unit}]`, t: m.t, height: 220,
      lines: p.lines.slice(8 * k, 8 * k + 8).map((l, i) => ({ ...l, colour: `c${i}`, width: 1.4 })),
      note: others && k === count - 1 ? `${others.lines.length === 1 ? "1 other is" : `${others.lines.length} others are`} in “${capital(elsewhere)}”.` : "",
    }));
  });
  return section("motion", "Motion",
    lead("Positions and rates at the records. A rotation is a vector along its axis, from the attitude at the start, world axes; its length is the angle. Angular rates are in the body's own axes, paths and velocities in world axes."),
    h("div", { class: plots.length > 1 ? "grid2" : "" }, plots.map((p) => card(p))));
}

export function steps(d) {
  if (d.summary?.method === "recorded") return null; // its rows are no steps
  const s = d.series, varying = any(s.step) && new Set(Array.from(s.step).filter(Number.isFinite).map((x) => x.toPrecision(6))).size > 2;
  const step = d.summary?.step_s ?? d.scene?.step_s;
  const sweeps = any(s.sweeps);
  return section("steps", "Steps and iterations",
    lead(varying ? "The step follows the motion; the mean between two records is shown." : `Every step is ${number(step, 4)} s.`,
      d.summary ? ` ${grouped(d.summary.steps)} steps, ${grouped(d.summary.evaluations)} evaluations of the field, ${number(d.summary.sweeps_per_step)} fixed-point iterations a step.` : ""),
    varying || sweeps ? h("div", { class: varying && sweeps ? "grid2" : "" },
      varying ? card(chart({ title: "Step size", unit: "step [s]", t: s.t, lines: [{ name: "step", v: s.step, colour: "c0" }], height: 220, log: true, decades: 8 })) : "",
      sweeps ? card(chart({ title: "Fixed-point iterations", what: "Mean per step between two records.", unit: "iterations per step", t: s.t, lines: [{ name: "iterations", v: s.sweeps, colour: "c1", width: 1.2 }], height: 220 })) : "") : "");
}

/** Rigid impacts, and ends of rest of dry joints: how many, when, and what they cost. */
export function jumps(d) {
  const s = d.summary, kinds = [["impacts", "impact"], ["slips", "slip"]];
  const rows = kinds.flatMap(([key, kind]) => Object.entries(s?.[key] || {}).map(([name, x]) => ({ name, kind, ...x })));
  if (!rows.length) return null;
  const lost = ({ name, kind }) => s.balance.losses[kind === "impact" ? `${name}.impact` : name];
  const strip = (times) => h("div", { class: "strip", role: "img", "aria-label": "times over the run" },
    times.map((t) => h("i", { style: `left:${(100 * t) / s.simulated_s}%`, title: duration(t) })));
  const cut = rows.some((r) => r.count > r.first_s.length);
  return section("jumps", "Impacts and slips",
    lead("Steps end at these instants. A slip is the end of a rest: the joint breaks away.", cut ? " Of each the first hundred are shown." : ""),
    card(table(["of", "", "count", "first", "lost [J]", "when"], rows.map((r) => [r.name, r.kind, grouped(r.count), r.first_s.length ? duration(r.first_s[0]) : "–",
      lost(r) === undefined ? "–" : number(lost(r), 4), strip(r.first_s)]), ["", "soft", "n", "n", "n", "wide"])));
}

export function ledgers(d) {
  const l = d.summary?.ledgers;
  if (!l) return null;
  const rows = ["orbital", "internal", "coupling", "harmonics"].filter((k) => l[k] && (l[k].scale_J > 0 || k !== "harmonics"));
  const works = (k) => Object.entries(l[k].works_J || {}).filter(([, j]) => j !== 0).map(([n, j]) => `${n} ${number(j, 4)} J`).join(", ")
    || (k === "internal" ? `supplied ${number(l[k].supplied_J, 4)} J, dissipated ${number(l[k].dissipated_J, 4)} J` : "–");
  return section("ledgers", "Three ledgers",
    lead("In orbit energy stands in three places, and there is no total: one rounding of the orbital energy is more than an arm moves in a year."),
    card(table(["ledger", "start [J]", "change [J]", "largest residual [J]", "relative", "works"],
      rows.map((k) => [k, number(l[k].initial_J, 6), number(l[k].change_J, 4), number(l[k].largest_defect_J), number(l[k].largest_relative_defect), h("span", { class: "soft" }, works(k))]), ["", "n", "n", "n", "n", ""]),
      h("p", { class: "soft", style: "margin-top:12px" }, `Angular momentum about the centre of mass: up to ${number(l.angular_momentum.largest_kg_m2_s, 4)} kg m²/s, impulse of the gradient's torque ${number(l.angular_momentum.gradient_impulse_kg_m2_s, 4)} kg m²/s, residual ${number(l.angular_momentum.largest_relative_defect)} relative. Neglected next order of the gradient: ${number(l.neglected_next_order)}.`)));
}

export function comparison(d) {
  const c = d.comparison;
  if (!c) return null;
  const value = (r) => (c.error === "energy" ? r.energy.max_rel_error : r.trajectory_error);
  const byMethod = new Map();
  for (const r of c.runs) {
    const name = r.method + (r.iteration_tolerance ? " short" : "") + (r.step_control && r.step_control !== "fixed" ? ` ${r.step_control}` : "");
    if (!byMethod.has(name)) byMethod.set(name, { name, rival: r.rival, points: [] });
    if (r.outcome === "ok" && value(r) > 0 && r.cpu_s > 0) byMethod.get(name).points.push({ x: r.cpu_s, y: value(r), text: r.rtol ? `rtol ${short(r.rtol)}` : `step ${short(r.step_s)} s` });
  }
  const methods = [...byMethod.values()].filter((m) => m.points.length);
  return section("comparison", "Speed against error",
    lead(`Every method over a range of steps, ${duration(c.duration_s)} simulated. Down is more accurate, left is faster. ${c.interrupted ? "The comparison was interrupted. " : ""}`, c.advice.sentence ? `${c.advice.sentence[0].toUpperCase()}${c.advice.sentence.slice(1)}.` : ""),
    card(workPrecision(methods, c.advice.target, c.error === "energy" ? "largest relative energy error" : "trajectory error"), h("p", { class: "what soft" }, "The first eight methods have a colour each, the next ones the same colours with other marks and dashes; squares are reference solvers that work to a tolerance; the dotted line is the target. A name shows or hides its line.")),
    h("details", {}, h("summary", {}, `All ${c.runs.length} trials`), card(table(["method", "step or tolerance", "CPU [s]", "steps", "energy error", "trajectory error", "outcome"],
      c.runs.map((r) => [r.method, r.rtol ? `rtol ${short(r.rtol)}` : `${short(r.step_s)} s`, number(r.cpu_s), grouped(r.steps), number(r.energy.max_rel_error), number(r.trajectory_error), r.outcome]), ["", "n", "n", "n", "n", "n", ""]))));
}

/** The certificates of the scene's controllers. */
export function controllers(d) {
  const all = d.summary?.certificates;
  if (!Array.isArray(all) || !all.length) return null;
  const word = { holds: "pass", fails: "none", reported: "soft", "not judged": "some" };
  const bound = (i) => (i.bound === undefined || i.bound === null ? "" : number(i.bound));
  return section("controllers", "Controllers",
    lead("The conditions of each law, checked at points before the run. A line without a bound is a figure."),
    all.map((c) => h("details", { open: "" }, h("summary", {}, c.title),
      card(table(["condition", "", "value", "bound", "what was checked"],
        (c.items || []).map((i) => [i.name, h("span", { class: `word ${word[i.finding]}` }, i.finding), typeof i.value === "number" ? number(i.value) : i.value, bound(i), i.text]), ["", "", "n", "n", ""])))));
}

export function credibility(d) {
  if (!d.credibility) return null;
  const kind = { stated: "pass", partly: "some", "not stated": "none" };
  return section("credibility", "Credibility",
    lead("What this run knows of the factors after NASA-STD-7009A. Levels are left to the reviewer."),
    card(table(["factor", "", "what is known"], d.credibility.map((r) => [h("b", { style: "font-weight:560" }, r.factor), h("span", { class: `word ${kind[r.stands]}` }, r.stands), r.text]))));
}

const provenanceNames = { porthos_version: "Porthos", git_hash: "commit", compiler: "compiler", flags: "flags", build_type: "build", simd: "SIMD", cpu: "processor", scene_sha256: "scene file, SHA-256", model_sha256: "model, SHA-256", trajectory_sha256: "trajectory, SHA-256", map_sha256: "map, SHA-256" };
export function provenance(d) {
  const p = d.summary?.provenance || d.comparison?.provenance || d.provenance;
  if (!p) return null;
  return section("provenance", "Provenance", lead("Equal inputs, program, compiler and instruction set give equal bits."),
    card(h("div", { class: "scroll" }, h("table", {}, h("tbody", {}, Object.entries(p).map(([k, v]) => h("tr", {}, h("th", { scope: "row" }, provenanceNames[k] || k), h("td", { class: "hash" }, v))))))),
    d.texts.scene ? h("details", {}, h("summary", {}, "Scene file"), h("pre", { tabindex: 0 }, d.texts.scene)) : "",
    d.texts.model ? h("details", {}, h("summary", {}, "Model"), h("pre", { tabindex: 0 }, d.texts.model)) : "");
}

export function notes(d) {
  const list = [...(d.summary?.notes || []), ...(d.comparison && !d.summary ? d.comparison.notes : [])];
  const model = d.model_notes || [];
  if (!list.length && !model.length) return null;
  return section("notes", "Notes", card(
    list.length ? h("div", {}, h("h3", {}, "Of the run"), h("ul", { class: "notes" }, list.map((n) => h("li", {}, minus(n))))) : "",
    model.length ? h("div", {}, h("h3", { style: list.length ? "margin-top:12px" : "" }, "Of the model"), h("ul", { class: "notes" }, model.map((n) => h("li", {}, n.where ? h("span", { class: "soft" }, `${n.where}: `) : "", n.text)))) : ""));
}
