import { colour, h, svg } from "./dom.js";
import { number, power, short } from "./format.js";

const width = 900, height = 460, left = 78, right = 16, top = 12, bottom = 52;

/** Work–precision: error against CPU time, one line per method. methods: [{name, points: [{x, y, text}], rival}] */
export function workPrecision(methods, target, what) {
  const all = methods.flatMap((m) => m.points);
  if (!all.length) return h("p", { class: "soft" }, "No trial has an error to show.");
  const range = (f) => {
    const v = all.map(f);
    return [Math.floor(Math.log10(Math.min(...v))), Math.ceil(Math.log10(Math.max(...v)) + 1e-9)];
  };
  const [x0, x1] = range((p) => p.x), [y0, y1] = range((p) => p.y);
  const px = (v) => left + ((Math.log10(v) - x0) / Math.max(1, x1 - x0)) * (width - left - right);
  const py = (v) => top + ((y1 - Math.log10(v)) / Math.max(1, y1 - y0)) * (height - top - bottom);
  const picture = svg("svg", { class: "wp", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${what} against CPU time by method` });
  const axis = (low, high, place) => {
    const every = Math.ceil((high - low) / 9);
    for (let e = low; e <= high; ++e) place(e, (e - low) % every === 0);
  };
  axis(x0, x1, (e, named) => {
    picture.append(svg("line", { class: "grid", x1: px(10 ** e), x2: px(10 ** e), y1: top, y2: height - bottom }));
    if (named) picture.append(svg("text", { x: px(10 ** e), y: height - bottom + 18, "text-anchor": "middle" }, power(e)));
  });
  axis(y0, y1, (e, named) => {
    picture.append(svg("line", { class: "grid", x1: left, x2: width - right, y1: py(10 ** e), y2: py(10 ** e) }));
    if (named) picture.append(svg("text", { x: left - 8, y: py(10 ** e) + 4, "text-anchor": "end" }, power(e)));
  });
  picture.append(svg("text", { class: "axis", x: (left + width - right) / 2, y: height - 12, "text-anchor": "middle" }, "CPU time [s]"));
  picture.append(svg("text", { class: "axis", x: -(top + height - bottom) / 2, y: 18, "text-anchor": "middle", transform: "rotate(-90)" }, what));
  if (target > 0 && Math.log10(target) > y0 && Math.log10(target) < y1)
    picture.append(svg("line", { x1: left, x2: width - right, y1: py(target), y2: py(target), stroke: colour("fail"), "stroke-dasharray": "2 5", "stroke-width": 1.5 }));
  const keys = h("div", { class: "keys" });
  methods.forEach((m, i) => {
    const c = `var(--c${i % 8})`, dash = i >= 16 ? "1.5 3" : i >= 8 ? "7 4" : "none";
    const g = svg("g", {}, svg("polyline", { points: m.points.map((p) => `${px(p.x)},${py(p.y)}`).join(" "), fill: "none", stroke: c, "stroke-width": 1.6, "stroke-dasharray": dash }));
    for (const p of m.points) {
      const dot = m.rival ? svg("rect", { x: px(p.x) - 3.2, y: py(p.y) - 3.2, width: 6.4, height: 6.4, fill: c }) : svg("circle", { cx: px(p.x), cy: py(p.y), r: 3.6, fill: c });
      dot.append(svg("title", {}, `${m.name}, ${p.text}: ${number(p.y)} in ${short(Number(p.x.toPrecision(3)))} s`));
      g.append(dot);
    }
    picture.append(g);
    const lift = (on) => { for (const other of picture.querySelectorAll("g")) other.classList.toggle("dim", on && other !== g); };
    keys.append(h("button", { type: "button", onmouseenter: () => lift(true), onmouseleave: () => lift(false), onfocus: () => lift(true), onblur: () => lift(false) },
      h("i", { style: `background:${c}` }), m.name));
  });
  return h("div", {}, picture, keys);
}
