import uPlot from "uplot";
import { colour, h } from "./dom.js";
import { power, short, timeUnit } from "./format.js";

/** Every chart of the page: drawn again when the theme changes, resized with its card, marked with the time of the playback. */
const charts = [];
let onSeek = () => {};
export const seekWith = (f) => (onSeek = f);

const font = (px) => `${px}px system-ui, "Segoe UI", "Noto Sans", "DejaVu Sans", sans-serif`;

/** Powers of ten only, thinned out where there are many. */
function decades(u, splits) {
  const whole = splits.filter((s) => s > 0 && Math.abs(Math.log10(s) - Math.round(Math.log10(s))) < 1e-9);
  const every = Math.ceil(whole.length / 7);
  return splits.map((s) => (whole.indexOf(s) >= 0 && whole.indexOf(s) % every === 0 ? power(Math.round(Math.log10(s))) : null));
}

/** A logarithmic range around the data: at most `most` decades below the top, whole decades. */
const logRange = (most) => (u, low, high) => {
  if (!(high > 0)) return [1e-18, 1e-14];
  const top = Math.ceil(Math.log10(high) + 0.02);
  const bottom = Math.max(Math.floor(Math.log10(low > 0 ? low : high)), top - most);
  return [10 ** Math.min(bottom, top - 2), 10 ** top];
};

/** The records [from, to) with values, where a body or a joint is there for less than a fifth of the time; else all. */
function recorded(t, lines, from) {
  const there = (i) => lines.some((l) => Number.isFinite(l.v[i]));
  let first = from, end = t.length;
  while (first < end && !there(first)) first += 1;
  while (end > first && !there(end - 1)) end -= 1;
  return end > first && t[end - 1] - t[first] < 0.2 * (t[t.length - 1] - t[from]) ? [first, end] : [from, t.length];
}

/** The border of a legend's marker that is like a line's dashes. */
const marker = (dash) => !dash ? "solid" : dash[0] < dash[1] ? "dotted" : "dashed";

/** o: {title, what, unit, t, lines: [{name, v, colour, width, dash, fill, hidden, held}], log, logTime, stacked, height, decades, note} */
export function chart(o) {
  const box = h("div", { class: "chart" }, o.title && h("h3", {}, o.title), o.what && h("p", { class: "what" }, o.what));
  const place = h("div", { role: "group", style: `min-height:${o.height || 270}px` });  // so that the page hardly grows when it is drawn
  box.append(place, o.note ? h("p", { class: "what" }, o.note) : "");
  // A logarithmic axis has no place for 0.
  const all = o.logTime ? Math.max(0, o.t.findIndex((x) => x > 0)) : 0;
  const [from, to] = o.logTime ? [all, o.t.length] : recorded(o.t, o.lines, all);
  const unit = o.logTime ? { name: "s", seconds: 1 } : timeUnit(o.t[to - 1] || 1);
  const x = Array.from(o.t.subarray(from, to), (s) => s / unit.seconds);
  if (x.length && o.title) place.setAttribute("aria-label", `${o.title}, ${short(x[0])} to ${short(x[x.length - 1])} ${unit.name}`);
  const clean = (v) => Array.from(v.slice(from, to), (y) => (Number.isFinite(y) && (!o.log || y > 0) ? y : null));
  const data = [x, ...o.lines.map((l) => clean(l.v))];
  const entry = { box, plot: null, marker: null, unit, draw };
  function draw() {
    const width = place.clientWidth;
    if (width < 40) return;
    entry.plot?.destroy();
    const soft = colour("soft"), grid = { stroke: colour("grid"), width: 1 }, ticks = { stroke: colour("rule"), width: 1, size: 5 };
    const axis = { stroke: soft, grid, ticks, font: font(12), labelFont: font(12.5), labelSize: 20 };
    entry.plot = new uPlot({
      width, height: o.height || 270, padding: [10, 30, 0, 0],
      cursor: { sync: { key: "porthos", scales: ["x", null] }, drag: { x: true, y: false }, points: { size: 6 }, focus: { prox: 24 } },
      focus: { alpha: 0.35 },
      legend: { live: true, markers: { dash: (u, i) => marker(i > 0 && o.lines[i - 1].dash) } },
      scales: { x: { time: false, distr: o.logTime ? 3 : 1, ...(o.logTime ? { range: (u, a, b) => [a, b] } : {}) }, y: o.log ? { distr: 3, range: logRange(o.decades || 8) } : { distr: 1, range: (u, a, b) => {
        if (a === null) return [0, 1];
        const room = (b - a || Math.abs(b) || 1) * 0.06;
        return [o.stacked && a >= 0 ? 0 : a - room, b + room];
      } } },
      axes: [
        { ...axis, label: `simulated time [${unit.name}]`, size: 30, ...(o.logTime ? { values: decades, filter: (u, s) => s } : { values: (u, v) => v.map(short) }), space: 60 },
        { ...axis, label: o.unit, size: (u, values) => Math.max(44, 16 + 7 * Math.max(0, ...(values || []).map((s) => (s || "").length))),
          ...(o.log ? { values: decades, filter: (u, s) => s } : { values: (u, v) => v.map(short) }), space: 34 },
      ],
      series: [
        { label: "time", value: (u, v) => (v === null ? "" : `${short(Number(v.toPrecision(5)))} ${unit.name}`) },
        ...o.lines.map((l) => ({
          label: l.name, stroke: colour(l.colour), width: l.width || 1.6, dash: l.dash, spanGaps: false, paths: l.held ? uPlot.paths.stepped({ align: 1 }) : undefined, points: { show: false },
          gaps: (u, s, first, last, all) => all.map(([a, b]) => [a - 1, b + 1]),  // with the edges of the stroke that crosses them
          show: !l.hidden, value: (u, v, s, i) => (i === null || i === undefined ? "" : short(Number(Number(l.shown ? l.shown[i + from] : v).toPrecision(4)))),
          fill: l.fill ? (o.stacked ? colour(l.colour) + "33" : undefined) : undefined,
        })),
      ],
      bands: o.stacked ? o.lines.slice(1).filter((l) => l.fill).map((l, i) => ({ series: [i + 2, i + 1], fill: colour(o.lines[i + 1].colour) + "40" })) : undefined,
      hooks: {
        ready: [(u) => {
          entry.marker = h("div", { class: "now" });
          u.over.append(entry.marker);
          u.over.addEventListener("click", (e) => {
            if (u.select.width > 2) return;
            onSeek(u.posToVal(e.offsetX, "x") * unit.seconds);
          });
        }],
        setScale: [(u, key) => key === "x" && mark(entry, now)],
      },
    }, data, place);
    mark(entry, now);
  }
  charts.push(entry);
  return box;
}

let now = null;
function mark(c, t) {
  if (!c.plot || !c.marker || t === null) return;
  const at = c.plot.valToPos(t / c.unit.seconds, "x");
  const inside = Number.isFinite(at) && at >= 0 && at <= c.plot.over.clientWidth;
  c.marker.style.display = inside ? "block" : "none";
  if (inside) c.marker.style.transform = `translateX(${at}px)`;
}
/** The playback is at t [s]. */
export function markTime(t) {
  now = t;
  for (const c of charts) if (c.near !== false) mark(c, t);
}

let started = false;
/** Draws what is on the screen or near it; the rest when it comes there. Again: all that was drawn. */
export function drawCharts() {
  for (const c of charts) if (c.plot) c.draw();
  if (started) return;
  started = true;
  const near = new IntersectionObserver((seen) => {
    for (const s of seen) if (s.isIntersecting) near.unobserve(s.target), charts.find((c) => c.box === s.target).draw();
  }, { rootMargin: "400px" });
  for (const c of charts) near.observe(c.box);
  addEventListener("beforeprint", () => charts.forEach((c) => c.plot || c.draw()));
  let pending = 0;
  new ResizeObserver(() => {
    cancelAnimationFrame(pending);
    pending = requestAnimationFrame(() => {
      for (const c of charts) {
        const width = c.box.clientWidth;
        if (c.plot && width > 40 && Math.abs(width - c.plot.width) > 1) c.plot.setSize({ width, height: c.plot.height });
      }
    });
  }).observe(document.getElementById("page"));
}
