import { decadeTicks, drawAxes, linearTicks } from "./axes.js";
import { h, svg } from "./dom.js";
import { timeUnit } from "./format.js";

/** The charts of a page that was made without node: still pictures, drawn once, in the colours of the theme. */
const width = 900, left = 78, right = 16, top = 10, bottom = 46;

/** The pieces of a line between gaps. */
function pieces(points) {
  const all = [[]];
  for (const p of points) Number.isFinite(p[0]) && Number.isFinite(p[1]) ? all[all.length - 1].push(p) : all[all.length - 1].length && all.push([]);
  return all.filter((piece) => piece.length);
}

/** o: {title, what, unit, t, lines: [{name, v, colour, width, dash, fill, held}], log, logTime, stacked, height, decades, note} */
export function chart(o) {
  const height = o.height || 270, t = o.t, unit = o.logTime ? { name: "s", seconds: 1 } : timeUnit(t[t.length - 1] || 1);
  const X = (s) => (o.logTime ? (s > 0 ? Math.log10(s) : NaN) : s / unit.seconds);
  const Y = (v) => (o.log ? (v > 0 ? Math.log10(v) : NaN) : v);
  let x0 = Infinity, x1 = -Infinity, y0 = o.stacked ? 0 : Infinity, y1 = -Infinity;
  for (const s of t) { const x = X(s); if (Number.isFinite(x)) x0 = Math.min(x0, x), x1 = Math.max(x1, x); }
  for (const l of o.lines) for (const v of l.v) { const y = Y(v); if (Number.isFinite(y)) y0 = Math.min(y0, y), y1 = Math.max(y1, y); }
  if (!(y1 >= y0)) { y0 = o.log ? -18 : 0; y1 = o.log ? -14 : 1; }
  if (o.log) {
    y1 = Math.ceil(y1 + 0.02);
    y0 = Math.min(Math.max(Math.floor(y0), y1 - (o.decades || 8)), y1 - 2);
  } else {
    const room = 0.06 * (y1 - y0 || Math.abs(y1) || 1);
    y0 = o.stacked && y0 >= 0 ? 0 : y0 - room;
    y1 += room;
  }
  if (!(x1 > x0)) x1 = x0 + 1;
  const px = (x) => left + ((x - x0) / (x1 - x0)) * (width - left - right);
  const py = (y) => top + ((y1 - Math.max(y, y0)) / (y1 - y0)) * (height - top - bottom);
  const picture = svg("svg", { class: "wp", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": o.title || o.unit });
  drawAxes(picture, { width, height, left, right, top, bottom },
    { ticks: o.logTime ? decadeTicks(Math.ceil(x0), Math.floor(x1), 8) : linearTicks(x0, x1, 8), place: px, name: `simulated time [${unit.name}]` },
    { ticks: o.log ? decadeTicks(y0, y1, 8) : linearTicks(y0, y1, 5), place: py, name: o.unit });
  for (const l of o.lines) {
    const points = Array.from(l.v, (v, i) => [X(t[i]), Y(v)]);
    for (const piece of pieces(points)) {
      const corners = l.held ? piece.flatMap(([x, y], i) => (i ? [[x, piece[i - 1][1]], [x, y]] : [[x, y]])) : piece;
      const path = corners.map(([x, y]) => `${px(x).toFixed(1)},${py(y).toFixed(1)}`);
      if (o.stacked && l.fill) picture.append(svg("polygon", { points: [`${px(piece[0][0])},${py(y0)}`, ...path, `${px(piece[piece.length - 1][0])},${py(y0)}`].join(" "), fill: `var(--${l.colour})`, opacity: 0.15 }));
      picture.append(svg("polyline", { points: path.join(" "), fill: "none", stroke: `var(--${l.colour})`, "stroke-width": l.width || 1.6, "stroke-dasharray": l.dash ? l.dash.join(" ") : "none" }));
    }
  }
  return h("div", { class: "chart" }, o.title && h("h3", {}, o.title), o.what && h("p", { class: "what" }, o.what), picture,
    h("div", { class: "keys" }, o.lines.map((l) => h("span", { class: "soft" }, h("i", { style: `background:var(--${l.colour})` }), l.name, " "))), o.note ? h("p", { class: "what" }, o.note) : "");
}

/** Everything is drawn when it is made; colours follow the theme by themselves. */
export function drawCharts() {}
