/** An element: h("p", {class: "soft"}, "text", child, [children]). Attributes that begin with "on" are listeners. */
export function h(tag, attributes = {}, ...children) {
  const e = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (value === undefined || value === null || value === false) continue;
    if (name.startsWith("on")) e.addEventListener(name.slice(2), value);
    else e.setAttribute(name, value === true ? "" : value);
  }
  e.append(...children.flat(3).filter((c) => c !== null && c !== undefined && c !== false));
  return e;
}

export function svg(tag, attributes = {}, ...children) {
  const e = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) e.setAttribute(name, value);
  e.append(...children);
  return e;
}

export const section = (id, title, ...children) => h("section", { id }, h("h2", {}, title), ...children);
export const card = (...children) => h("div", { class: "card" }, ...children);
export const lead = (...text) => h("p", { class: "lead" }, ...text);

/** rows of cells; a cell is text or a node, a column's class is in `classes`. */
export function table(heads, rows, classes = []) {
  const cell = (tag) => (c, i) => h(tag, { class: classes[i], scope: tag === "th" ? "col" : null }, c);
  return h("div", { class: "scroll" }, h("table", {},
    h("thead", {}, h("tr", {}, heads.map(cell("th")))),
    h("tbody", {}, rows.map((r) => h("tr", {}, r.map(cell("td")))))));
}

/** A colour of the style sheet as it is now. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
