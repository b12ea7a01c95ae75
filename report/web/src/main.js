import { drawCharts } from "./charts.js";
import { read } from "./data.js";
import { h } from "./dom.js";
import * as ensemble from "./ensemble.js";
import { duration, rowsOf } from "./format.js";
import * as identification from "./identification.js";
import { player } from "./player.js";
import * as sections from "./sections.js";

/** auto, light, dark: what was chosen, else what the system says. */
function theme(changed) {
  const system = matchMedia("(prefers-color-scheme: dark)");
  let chosen = null;
  try { chosen = localStorage.getItem("porthos-theme"); } catch { /* a page from a file may have no storage */ }
  const button = h("button", { type: "button", class: "theme" });
  const apply = () => {
    const dark = chosen ? chosen === "dark" : system.matches;
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    button.textContent = dark ? "☀ Light" : "☾ Dark";
    button.setAttribute("aria-label", dark ? "use the light theme" : "use the dark theme");
  };
  button.addEventListener("click", () => {
    chosen = document.documentElement.dataset.theme === "dark" ? "light" : "dark";
    try { localStorage.setItem("porthos-theme", chosen); } catch { /* see above */ }
    apply();
    changed();
  });
  system.addEventListener("change", () => { apply(); changed(); });
  apply();
  return button;
}

/** report.html#film is the playback alone, which plays again and again, to stand in other pages; #still the same at rest. */
const alone = ["#film", "#still"].includes(location.hash);
function perform(stage) {
  stage.seek(stage.first + 0.4 * (stage.last - stage.first));
  if (location.hash === "#still") return setInterval(() => stage.wake(), 100);  // a headless browser takes its picture at any moment
  if (matchMedia("(prefers-reduced-motion: reduce)").matches) return;
  const again = () => stage.playing || document.hidden || stage.play(true);
  stage.seek(stage.first);
  again();
  return setInterval(again, 500);
}

function main() {
  performance.mark("start");
  const page = document.getElementById("page");
  let d;
  try {
    d = read();
  } catch (e) {
    page.append(h("div", { class: "banner warn" }, `This report is damaged: its data cannot be read (${e.message}). Make it again with porthos report.`));
    return;
  }
  let stage = null;
  const button = theme(() => { drawCharts(); stage?.theme(); });
  const s = d.summary, title = s?.title || d.ensemble?.title || d.identification?.title || d.scene?.title || d.comparison?.title || d.folder;
  document.documentElement.classList.toggle("alone", alone);
  document.title = `${title} – Porthos report`;
  const meta = d.kind === "ensemble" ? ensemble.meta(d) : d.kind === "identification" ? identification.meta(d) : s?.method === "recorded" ? `recorded, ${rowsOf(s)}, ${duration(s.simulated_s)}` : s ? `${s.method}, ${s.step_control ? `${s.step_control} from ` : ""}${s.step_s} s, ${duration(s.simulated_s)} simulated` : d.comparison && !s ? `comparison of methods, ${duration(d.comparison.duration_s)} simulated` : d.scene ? `${d.scene.method}, ${d.scene.step_s} s` : "";
  const bad = d.status.state !== "complete" || d.missing.length;
  const play = d.acts.length ? player(d) : null;
  const series = d.series && d.series.t.length > 1;
  const parts = (d.kind === "ensemble" ? [
    ["Verdict", ensemble.verdict(d)], ["Distributions", ensemble.distributions(d)], ["What depends on what", ensemble.relations(d)], ["Cases", ensemble.cases(d)], ["Events", ensemble.events(d)],
    ["Provenance", sections.provenance(d)],
  ] : d.kind === "identification" ? [
    ["Parameters", identification.found(d)], ["Fit", identification.fit(d)], ["What the log tells", identification.told(d)], ["Provenance", sections.provenance(d)], ["Notes", identification.notes(d)],
  ] : [
    ["Verdict", d.kind === "comparison" ? null : sections.verdict(d)], ["Playback", play?.box], ["Motion", sections.motion(d)], ["Energy", series && sections.energy(d)], ["Errors", series && sections.errors(d)],
    ["Steps", series && sections.steps(d)], ["Impacts and slips", sections.jumps(d)], ["Ledgers", sections.ledgers(d)], ["Speed against error", sections.comparison(d)], ["Controllers", sections.controllers(d)], ["Credibility", sections.credibility(d)],
    ["Provenance", sections.provenance(d)], ["Notes", sections.notes(d)],
  ]).filter(([, box]) => box);
  page.append(
    h("header", { class: "top" }, h("div", {}, h("div", { class: "mark" }, "Porthos report"), h("h1", {}, title), h("div", { class: "meta" }, meta)), button),
    h("nav", { "aria-label": "sections" }, parts.map(([name, box]) => h("a", { href: `#${box.id}` }, name))),
    bad || d.status.text ? h("div", { class: "banner warn", role: "alert" }, h("b", {}, d.status.state === "unfinished" ? "Unfinished run. " : d.status.state === "damaged" ? "Damaged results. " : ""), d.status.text,
      d.missing.length ? h("ul", {}, d.missing.map((m) => h("li", {}, m))) : "") : "",
    h("main", {}, parts.map(([, box]) => box)),
    h("footer", {}, series && !d.series.exact ? "Plots show of each stretch of records the least and the greatest value, so that no peak is lost. " : "", "Everything is in this file; nothing is fetched."));
  drawCharts();
  window.porthos = { data: d, stage: null, ready: true };
  performance.mark("ready");
  // The page can be read before the first picture of the playback is there.
  if (play) requestAnimationFrame(() => setTimeout(() => {
    window.porthos.stage = stage = play.start();
    if (alone && stage) perform(stage);
    performance.mark("stage");
  }));
}

main();
