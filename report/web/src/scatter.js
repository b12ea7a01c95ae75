import { decadeTicks, drawAxes } from "./axes.js";
import { colour, h, svg } from "./dom.js";
import { number, short } from "./format.js";

const box = { width: 900, height: 460, left: 78, right: 16, top: 12, bottom: 52 };
const { width, height, left, right, top, bottom } = box;

/** The methods with a trial that no other beats in both time and error. */
export function front(methods) {
  const all = methods.flatMap((m) => m.points.map((p) => ({ ...p, m })));
  all.sort((a, b) => a.x - b.x || a.y - b.y);
  const best = new Set();
  let least = Infinity;
  for (const p of all) if (p.y < least) (least = p.y), best.add(p.m);
  return best;
}

const marks = [
  (x, y, fill) => svg("circle", { cx: x, cy: y, r: 3.8, fill }),
  (x, y, fill) => svg("polygon", { points: `${x},${y - 4.8} ${x + 4.6},${y + 3.4} ${x - 4.6},${y + 3.4}`, fill }),
  (x, y, fill) => svg("polygon", { points: `${x},${y - 5} ${x + 5},${y} ${x},${y + 5} ${x - 5},${y}`, fill }),
  (x, y, fill) => svg("circle", { cx: x, cy: y, r: 3.2, fill: "none", stroke: fill, "stroke-width": 1.8 }),
];
const dashes = ["none", "7 3", "2 3", "9 3 2 3"];
const square = (x, y, fill) => svg("rect", { x: x - 3.4, y: y - 3.4, width: 6.8, height: 6.8, fill });

/** Axes with decades; the places of a value on them. */
function frame(all, what, target) {
  const range = (f) => {
    const v = all.map(f);
    return [Math.floor(Math.log10(Math.min(...v))), Math.ceil(Math.log10(Math.max(...v)) + 1e-9)];
  };
  const [x0, x1] = range((p) => p.x), [y0, y1] = range((p) => p.y);
  const px = (v) => left + ((Math.log10(v) - x0) / Math.max(1, x1 - x0)) * (width - left - right);
  const py = (v) => top + ((y1 - Math.log10(v)) / Math.max(1, y1 - y0)) * (height - top - bottom);
  const picture = svg("svg", { class: "wp", viewBox: `0 0 ${width} ${height}`, role: "img", "aria-label": `${what} against CPU time by method` });
  const decades = (low, high, place) => ({ ticks: decadeTicks(low, high, 9), place: (e) => place(10 ** e) });
  drawAxes(picture, box, { ...decades(x0, x1, px), name: "CPU time [s]" }, { ...decades(y0, y1, py), name: what });
  if (target > 0 && Math.log10(target) > y0 && Math.log10(target) < y1)
    picture.append(svg("line", { x1: left, x2: width - right, y1: py(target), y2: py(target), stroke: colour("fail"), "stroke-dasharray": "2 5", "stroke-width": 1.5 }));
  return { picture, px, py };
}

/** Work–precision: error against CPU time, one line per method, of the first eight each a colour, then the same with another mark and dashes. methods: [{name, points: [{x, y, text}], rival}]
 *  At first only the methods on the front and the reference solvers; a name below shows or hides its line. */
export function workPrecision(methods, target, what) {
  const all = methods.flatMap((m) => m.points);
  if (!all.length) return h("p", { class: "soft" }, "No trial has an error to show.");
  const { picture, px, py } = frame(all, what, target);
  const best = front(methods), first = methods.filter((m) => best.has(m) || m.rival);
  const order = [...new Set([...first, ...methods])];
  const keys = h("div", { class: "keys" }), lines = [], named = [];
  const free = (x, y) => named.every(([a, b]) => Math.abs(x - a) > 70 || Math.abs(y - b) > 12);
  for (const m of methods) {
    const k = order.indexOf(m), turn = Math.floor(k / 8), c = `var(--c${k % 8})`, mark = m.rival ? square : marks[turn % marks.length];
    const dash = dashes[(turn + Math.floor(turn / marks.length)) % dashes.length];
    const g = svg("g", { "data-method": m.name, "data-look": `${k % 8} ${m.rival ? "square" : turn % marks.length} ${dash}` },
      svg("polyline", { points: m.points.map((p) => `${px(p.x)},${py(p.y)}`).join(" "), fill: "none", stroke: c, "stroke-width": 1.6, "stroke-dasharray": dash }));
    for (const p of m.points) {
      const dot = mark(px(p.x), py(p.y), c);
      dot.append(svg("title", {}, `${m.name}, ${p.text}: ${number(p.y)} in ${short(Number(p.x.toPrecision(3)))} s`));
      g.append(dot);
    }
    const end = m.points.reduce((a, b) => (b.y < a.y ? b : a));
    const at = [Math.min(px(end.x) + 7, width - right - 60), py(end.y) - 6];
    if (first.includes(m) && free(...at)) {
      named.push(at);
      g.append(svg("text", { x: at[0], y: at[1], class: "name" }, m.name));
    }
    picture.append(g);
    const lift = (on) => { for (const other of picture.querySelectorAll("g")) other.classList.toggle("dim", on && other !== g); };
    const key = h("button", { type: "button", onmouseenter: () => lift(true), onmouseleave: () => lift(false), onfocus: () => lift(true), onblur: () => lift(false) },
      svg("svg", { width: 26, height: 12, viewBox: "0 0 26 12" }, svg("line", { x1: 0, x2: 26, y1: 6, y2: 6, stroke: c, "stroke-width": 1.6, "stroke-dasharray": dash }), mark(13, 6, c)), m.name);
    const show = (on) => { g.style.display = on ? "" : "none"; key.setAttribute("aria-pressed", String(on)); };
    key.addEventListener("click", () => show(g.style.display === "none"));
    show(first.includes(m));
    lines.push({ m, show });
    keys.append(key);
  }
  const some = first.length < methods.length && h("span", { class: "group" },
    h("button", { type: "button", onclick: () => lines.forEach((l) => l.show(first.includes(l.m))) }, "best and reference solvers"),
    h("button", { type: "button", onclick: () => lines.forEach((l) => l.show(true)) }, `all ${methods.length} methods`));
  return h("div", {}, some ? h("div", { class: "bar" }, some) : "", picture, keys);
}
