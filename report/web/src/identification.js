// The page of porthos identify: what was found, how well it fits, and what the log tells.
import { chart } from "./charts.js";
import { card, h, lead, section, svg, table } from "./dom.js";
import { duration, grouped, number } from "./format.js";

/** What the log tells of a parameter: its change in 1σ of it. */
const change = (p) => (p.deviation > 0 ? (p.found - p.start) / p.deviation : null);

export function found(d) {
  const r = d.identification;
  if (!r) return null;
  const untold = r.parameters.filter((p) => !(p.deviation > 0)).length, all = r.parameters.length;
  const words = !r.converged ? "The fit came to no end, or is no nearer to the log than the start: see the notes" : untold ? `The log does not tell ${untold} of ${all} parameters` : `${all === 1 ? "The parameter is" : `All ${all} parameters are`} told by the log`;
  const state = !r.converged ? ["fail", "Not found"] : untold ? ["open", "In part"] : ["pass", "Found"];
  return section("found", "Parameters",
    h("div", { class: "verdict" }, h("span", { class: `badge ${state[0]}` }, state[1]), h("p", {}, `${words}.`)),
    card(table(["Parameter", "start", "found", "1 σ", "unit", "moved by"],
      r.parameters.map((p) => [p.name, number(p.start, 6), number(p.found, 6), p.deviation > 0 ? number(p.deviation, 2) : "not told", p.unit, change(p) === null ? "" : `${number(change(p), 2)} σ`]), ["", "n", "n", "n", "", "n"])));
}

export function fit(d) {
  const r = d.identification;
  if (!r) return null;
  const sigma = r.noise_known;
  const words = sigma ? `χ² is ${number(r.chi_square, 4)} for ${grouped(r.degrees_of_freedom)} degrees of freedom, ${number(r.surprise, 2)} σ from what the noise gives.`
    : `The noise is taken from the residuals: ${number(r.noise)} ${r.columns[0]?.unit || ""}.`;
  const t = Float64Array.from(r.residuals.t), shown = r.columns.slice(0, 6);
  return section("fit", "Fit", lead(words, r.surprise > 3 && sigma ? " So the model or the stated noise is wrong." : ""),
    card(table(["Column", "unit", "rms at the start", "rms as found", "σ"], r.columns.map((c) => [c.name, c.unit, number(c.rms_before), number(c.rms_after), c.sigma === null ? "–" : number(c.sigma)]), ["", "", "n", "n", "n"])),
    t.length > 1 ? h("div", { class: shown.length > 1 ? "grid2" : "" }, shown.map((c, i) => card(chart({
      title: c.name, unit: sigma ? "|run − log| [σ]" : `|run − log| [${c.unit}]`, t, log: true, decades: 6, height: 210,
      lines: [{ name: "with the start values", v: Float64Array.from(r.residuals.before[i]), colour: "c2" }, { name: "as found", v: Float64Array.from(r.residuals.after[i]), colour: "c1" }],
    })))) : "",
    r.columns.length > shown.length ? h("p", { class: "soft" }, `${r.columns.length - shown.length} more columns are in identify.json.`) : "");
}

/** The correlation of two parameters, from the covariance; null where the log tells nothing. */
function correlation(C, i, k) {
  const s = Math.sqrt(C[i][i] * C[k][k]);
  return s > 0 && Number.isFinite(s) ? C[i][k] / s : null;
}

function correlations(r) {
  const n = r.parameters.length, cell = Math.min(34, 640 / n), left = 150;
  const picture = svg("svg", { class: "wp", viewBox: `0 0 ${left + n * cell + 4} ${n * cell + 4}`, role: "img", "aria-label": "correlations of the parameters", style: `max-width:${left + n * cell + 4}px` });
  r.parameters.forEach((p, i) => {
    picture.append(svg("text", { x: left - 8, y: (i + 0.5) * cell + 4, "text-anchor": "end" }, p.name.length > 20 ? `…${p.name.slice(-19)}` : p.name));
    r.parameters.forEach((q, k) => {
      const c = correlation(r.covariance, i, k), square = svg("rect", { x: left + k * cell + 1, y: i * cell + 1, width: cell - 2, height: cell - 2, fill: c === null ? "var(--rule)" : c < 0 ? "var(--fail)" : "var(--accent)", "fill-opacity": c === null ? 0.4 : 0.08 + 0.92 * Math.abs(c) });
      square.append(svg("title", {}, `${p.name}, ${q.name}: ${c === null ? "not told" : c.toFixed(3)}`));
      picture.append(square);
    });
  });
  return picture;
}

export function told(d) {
  const r = d.identification;
  if (!r?.combinations.length) return null;
  const moves = (c) => c.moves.map((m, i) => [r.parameters[i].name, m]).filter(([, m]) => Math.abs(m) >= 0.1).sort((a, b) => Math.abs(b[1]) - Math.abs(a[1])).map(([name, m]) => `${name} ${m < 0 ? "−" : "+"}${Math.abs(m).toFixed(2)}`).join(", ");
  return section("told", "What the log tells",
    lead("Combinations of the parameters, the best told first. 1 σ is along each, in parts of the parameters' sizes; above 1 the log does not tell it."),
    card(table(["1 σ", "", "the parameters move by"], r.combinations.map((c) => [c.deviation === null ? "∞" : number(c.deviation, 2), h("span", { class: c.told ? "soft" : "badge open" }, c.told ? "told" : "not told"), moves(c)]), ["n", "", ""])),
    r.parameters.length > 1 ? card(h("h3", {}, "Correlations"), h("p", { class: "what" }, "Full colour: one can stand for the other. Blue: both up; red: one up, one down."), correlations(r)) : "");
}

export function notes(d) {
  const r = d.identification;
  if (!r) return null;
  const cost = `${r.cost.iterations} iterations, ${r.cost.runs} runs, ${r.cost.runs_with_tangents} of them with ${r.parameters.length} tangents. Half the step moves the values by ${number(r.step_error, 2)} σ at most.`;
  return section("notes", "Notes", card(h("ul", { class: "notes" }, [cost, ...r.notes].map((n) => h("li", {}, n)))));
}

export const meta = (d) => {
  const r = d.identification;
  return r ? `from ${r.log.split("/").pop()}, ${r.method}, ${r.step_s} s a step, ${duration(r.residuals?.t.at(-1) ?? 0)} of log` : "";
};
