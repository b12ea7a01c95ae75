import { drawCharts, markTime, seekWith } from "./charts.js";
import { h } from "./dom.js";
import { base64, film, filmed, picture, pixels, save } from "./film.js";
import { duration, instant, number } from "./format.js";
import { Stage } from "./stage.js";

/** Speeds that play the whole in about 10, 20, 40 and 80 s, and real time; rounded to 1, 2, 5. */
function speeds(span) {
  const nice = (x) => { const e = 10 ** Math.floor(Math.log10(x)), m = x / e; return e * (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10); };
  const all = [span / 80, span / 40, span / 20, span / 10].map(nice).concat([0.1, 1, 10].filter((r) => span / r < 3600 && span / r > 2));
  return { list: [...new Set(all)].sort((a, b) => a - b), usual: nice(span / 20) };
}

/** The section with the playback; start() once it is on the page. */
export function player(d) {
  const host = h("div", { class: "stage" });
  const said = h("div", { class: "said" }), flash = h("div", { class: "flash", role: "status" });
  host.append(said, flash);
  const play = h("button", { type: "button", class: "play" }, "▶ Play");
  const slider = h("input", { type: "range", min: 0, max: 1000, step: "any", value: 0, "aria-label": "time of the playback" });
  const ticks = h("div", { class: "ticks" });
  const speed = h("select", { "aria-label": "speed of the playback" });
  const clip = h("select", { "aria-label": "part of the run" });
  const ride = h("select", {}, [["place", "follows the base's place"], ["base", "rides on the base"], ["world", "stands in the world"]].map(([v, t]) => h("option", { value: v }, t)));
  const path = h("select", { "aria-label": "whose path is drawn" }, h("option", { value: "" }, "of the last links"));
  const toggle = (text, on, f) => {
    const b = h("button", { type: "button", "aria-pressed": String(on) }, text);
    b.addEventListener("click", () => { const now = b.getAttribute("aria-pressed") !== "true"; b.setAttribute("aria-pressed", String(now)); f(now); });
    return b;
  };
  const act = d.acts[0], clips = act.clips, several = clips.length > 1;
  const views = d.planet && clips[0].orbit ? h("span", { class: "group", role: "group", "aria-label": "view" }) : null;
  const events = (d.summary?.events || []).map((e) => ({ t: e.at_s, text: e.event, loss: e.dissipated_J }));
  const floats = clips[0].origin.some((x) => x !== 0) || clips[0].orbit || d.acts[0].bodies.some((b) => b.parent === "world" && b.joint === "free");
  const name = d.folder || "porthos";
  let stage = null;
  const preset = (name, text, label) => h("button", { type: "button", "aria-label": label, title: label, onclick: () => stage.look(name) }, text);
  const shot = h("button", { type: "button", title: "save this picture as a PNG file", onclick: async () => save(await picture(stage), `${name}.png`) }, "picture");
  let filming = false;
  const movie = h("button", { type: "button", title: "save the whole at the chosen speed as an MP4 file; press again to end it early", onclick: async () => {
    if (filming) return (filming = false);
    filming = true;
    try {
      save(await film(stage, { onFrame: (done) => { movie.textContent = `film ${Math.round(100 * done)} %`; return filming; } }), `${name}.mp4`);
    } catch (e) {
      flash.textContent = `No film: ${e.message}`;
      flash.classList.add("on");
      console.warn(e);
    }
    filming = false;
    movie.textContent = "film";
  } }, "film");
  const warning = h("p", { class: "what soft", style: "margin:8px 0 0" });
  const box = h("section", { id: "playback" }, h("h2", {}, "Playback"),
    h("div", { class: "card" }, host,
      h("div", { class: "bar" }, play, h("div", { class: "grow" }, slider, ticks), h("label", {}, h("span", { class: "wide-only" }, "speed"), speed), several ? h("label", {}, clip) : ""),
      h("div", { class: "bar" }, views, h("span", { class: "group", role: "group", "aria-label": "camera" }, preset("iso", "3D", "camera: from the side and above"), preset("x", "X", "camera: along x"), preset("y", "Y", "camera: along y"), preset("z", "Z", "camera: from above, along z")),
        h("span", { class: "group" }, toggle("trails", true, (on) => stage.set("trails", on)), path, toggle("frames", false, (on) => stage.set("frames", on)), d.acts.some((a) => a.clips[0].momenta) ? toggle("arrows", false, (on) => { stage.set("arrows", on); if (on) stage.look(); }) : ""),
        floats ? h("label", {}, h("span", { class: "wide-only" }, "camera"), ride) : "",
        h("span", { class: "group", role: "group", "aria-label": "save" }, shot, filmed() ? movie : "")),
      warning));
  const failed = (text) => { host.replaceChildren(h("p", { class: "soft", style: "padding:20px" }, text)); box.querySelectorAll(".bar").forEach((b) => b.remove()); };

  function start() {
    try {
      stage = new Stage(host, d);
    } catch (e) {
      failed(/webgl/i.test(e.message) ? "No playback: this browser offers no WebGL." : `No playback: ${e.message}`);
      console.warn(e);
      return null;
    }
    Object.assign(window.porthos, { film, picture, pixels, base64 });  // for programs
    ride.value = stage.usual;
    path.append(...stage.movers().map((name) => h("option", { value: name }, `of ${name}`)));
    path.addEventListener("change", () => stage.set("trailOf", path.value ? [path.value] : []));
    function fill() {
      const span = stage.last - stage.first, s = speeds(span);
      speed.replaceChildren(...s.list.map((r) => h("option", { value: r }, r === 1 ? "real time" : `${number(r)}×`)));
      speed.value = s.usual;
      stage.rate = s.usual;
      ticks.replaceChildren(...events.filter((e) => e.t > stage.first && e.t < stage.last).map((e) => h("i", { style: `left:${(100 * (e.t - stage.first)) / span}%`, title: e.text })));
      const c = stage.clips[0], whole = stage.clips[0] === clips[0], often = Math.max(...stage.clips.map((x) => x.turn));
      warning.textContent = `${c.t.length > 1 ? `One frame every ${duration((c.t[c.t.length - 1] - c.t[0]) / (c.t.length - 1))}; positions are interpolated linearly, attitudes along the shortest arc.` : ""}`
        + (often > 1.6 ? ` A body turns, to and fro, by up to ${number(often, 2)} rad between two of them: a fast motion may appear slow or still (aliasing).${several && whole ? " The beginning can be seen record by record." : " A smaller record_every shows it."}` : "");
    }
    let told = 0;
    stage.onTime = (t) => {
      markTime(t);
      const clock = performance.now();
      if (stage.playing && clock - told < 80) return;  // words need not be as quick as pictures
      told = clock;
      const span = stage.last - stage.first || 1;
      slider.value = (1000 * (t - stage.first)) / span;
      slider.setAttribute("aria-valuetext", duration(t));
      said.replaceChildren(h("b", {}, `t = ${instant(t, stage.last, span)}`), stage.altitude && stage.clips[0].orbit ? `  ·  altitude ${number(stage.altitude / 1000, 4)} km` : "",
        stage.options.view === "mechanism" && stage.down ? "  ·  arrows: down (green), ahead (red)" : "",
        ...(stage.options.arrows && stage.options.view === "mechanism" ? stage.arrowWords().map((words) => h("div", {}, words)) : []));
      const e = stage.playing && events.filter((x) => x.t <= t && t - x.t < 3 * stage.rate).pop();  // for three seconds of watching
      if (e) flash.textContent = `${duration(e.t)}: ${events.filter((x) => x.t === e.t).map((x) => x.text).join(", ")}`;
      flash.classList.toggle("on", Boolean(e));
      play.textContent = stage.playing ? "❚❚ Pause" : "▶ Play";
    };
    const go = (on) => { stage.play(on); stage.onTime(stage.time); };
    play.addEventListener("click", () => go(!stage.playing));
    slider.addEventListener("input", () => stage.seek(stage.first + (slider.value / 1000) * (stage.last - stage.first)));
    speed.addEventListener("change", () => (stage.rate = Number(speed.value)));
    ride.addEventListener("change", () => { stage.set("ride", ride.value); if (stage.usual === "world") stage.look("iso"); });
    clips.forEach((c, i) => clip.append(h("option", { value: i }, c.name)));
    clip.addEventListener("change", () => { stage.choose(Number(clip.value)); fill(); });
    if (views) for (const [v, text] of [["mechanism", "craft"], ["orbit", "orbit"]]) {
      const b = h("button", { type: "button", "aria-pressed": String(v === "mechanism"), onclick: () => { for (const x of views.children) x.setAttribute("aria-pressed", String(x === b)); stage.set("view", v); } }, text);
      views.append(b);
    }
    stage.renderer.domElement.addEventListener("keydown", (e) => {
      const keys = { " ": () => go(!stage.playing), ArrowLeft: () => stage.turn(0.08, 0), ArrowRight: () => stage.turn(-0.08, 0), ArrowUp: () => stage.turn(0, 0.08), ArrowDown: () => stage.turn(0, -0.08), "+": () => stage.zoom(0.9), "-": () => stage.zoom(1.1) };
      if (!keys[e.key]) return;
      e.preventDefault();
      keys[e.key]();
    });
    seekWith((t) => stage.seek(t));
    fill();
    stage.seek(stage.first);
    return stage;
  }
  return { box, start, events };
}
export { drawCharts };
