import { svg } from "./dom.js";
import { power, short } from "./format.js";

/** Steps of 1, 2 or 5 times a power of ten, about `count` over the range. */
export function linearTicks(low, high, count) {
  const raw = (high - low) / count, e = 10 ** Math.floor(Math.log10(raw)), m = raw / e;
  const step = e * (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10), ticks = [];
  for (let k = Math.ceil(low / step); k * step <= high * (1 + 1e-12); ++k) ticks.push(Number((k * step).toPrecision(12)));
  return ticks.map((v) => ({ v, text: short(v) }));
}
/** Powers of ten by their exponents, of which about `count` have a text. */
export function decadeTicks(low, high, count) {
  const ticks = [], every = Math.ceil((high - low) / count);
  for (let e = low; e <= high; ++e) ticks.push({ v: e, text: (e - low) % every === 0 ? power(e) : "" });
  return ticks;
}

/** Grid, texts and names of two axes in a picture: {ticks, place, name}, place(v) in its pixels. box: {width, height, left, right, top, bottom} */
export function drawAxes(picture, box, x, y) {
  const { width, height, left, right, top, bottom } = box;
  for (const { v, text } of x.ticks)
    picture.append(svg("line", { class: "grid", x1: x.place(v), x2: x.place(v), y1: top, y2: height - bottom }), svg("text", { x: x.place(v), y: height - bottom + 18, "text-anchor": "middle" }, text));
  for (const { v, text } of y.ticks)
    picture.append(svg("line", { class: "grid", x1: left, x2: width - right, y1: y.place(v), y2: y.place(v) }), svg("text", { x: left - 8, y: y.place(v) + 4, "text-anchor": "end" }, text));
  picture.append(svg("text", { class: "axis", x: (left + width - right) / 2, y: height - 10, "text-anchor": "middle" }, x.name),
    svg("text", { class: "axis", x: -(top + height - bottom) / 2, y: 17, "text-anchor": "middle", transform: "rotate(-90)" }, y.name));
}
