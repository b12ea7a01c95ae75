import { BufferAttribute, BufferGeometry } from "three";
import { toCreasedNormals } from "three/examples/jsm/utils/BufferGeometryUtils.js";

const crease = 0.6;  // [rad] between faces that look like one

/** A mesh of the page's data, scaled as its model says. Mirrored triangles are turned over, so that their front stays in front. */
export function meshGeometry({ low, step, corners, triangles }, scale) {
  const places = new Float32Array(corners.length);
  for (let i = 0; i < corners.length; ++i) places[i] = scale[i % 3] * (low[i % 3] + step * corners[i]);
  const index = Uint16Array.from(triangles);
  if (scale[0] * scale[1] * scale[2] < 0) for (let i = 0; i < index.length; i += 3) [index[i + 1], index[i + 2]] = [index[i + 2], index[i + 1]];
  const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(places, 3));
  geometry.setIndex(new BufferAttribute(index, 1));
  return toCreasedNormals(geometry, crease);
}
