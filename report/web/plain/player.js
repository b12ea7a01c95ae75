import { h } from "./dom.js";

/** The playback needs three.js, which node brings: the page says so where it would stand. */
export function player() {
  const box = h("section", { id: "playback" }, h("h2", {}, "Playback"),
    h("p", { class: "soft" }, "This page was made without node and npm, so it has no 3-D playback and its plots do not zoom. With both installed, build again and call porthos report on this folder."));
  return { box, start: () => null };
}
