// The land of the Earth as a texture.
/*! Map: Natural Earth, public domain, by world-atlas 2.0.2, Copyright 2013-2019 Michael Bostock, SPDX-License-Identifier: ISC */
import { CanvasTexture, SRGBColorSpace } from "three";
import land from "world-atlas/land-110m.json";

const colours = { sea: "#2c5c8f", land: "#7f9a63", ice: "#e8eef2" };

/** Its rate of rotation [rad/s], where a scene states none. */
export const earthRate = 7.2921159e-5;

/** Whether a planet is the Earth, by its radius [m]. */
export const isEarth = (planet) => Math.abs(planet.radius - 6.378e6) < 2e4;

/** The rings of TopoJSON's arcs, quantised steps from point to point, as points [longitude, latitude] in degrees. A ring that
 * crosses the 180th meridian goes on beyond 180°; one around a pole is closed along it. */
function rings() {
  const { scale, translate } = land.transform;
  const arcs = land.arcs.map((arc) => {
    let x = 0, y = 0;
    return arc.map(([dx, dy]) => [translate[0] + scale[0] * (x += dx), translate[1] + scale[1] * (y += dy)]);
  });
  const line = (k) => (k < 0 ? arcs[~k].slice().reverse() : arcs[k]);
  return land.objects.land.geometries.flatMap((g) => g.arcs).flat().map((ring) => {
    let turned = 0, before = 0;
    const points = ring.flatMap(line).map(([longitude, latitude], i) => {
      if (i) turned -= 360 * Math.round((longitude - before) / 360);
      before = longitude;
      return [longitude + turned, latitude];
    });
    const [first, last] = [points[0], points.at(-1)];
    if (Math.abs(last[0] - first[0]) > 180) points.push([last[0], -90], [first[0], -90]);
    return points;
  });
}

/** Longitudes from -180° to 180° from left to right, the north above. */
export function earthTexture(width = 2048) {
  const height = width / 2, canvas = Object.assign(document.createElement("canvas"), { width, height });
  const at = ([longitude, latitude]) => [((longitude + 180) / 360) * width, ((90 - latitude) / 180) * height];
  const path = new Path2D();
  for (const ring of rings())
    for (const turn of [-360, 0, 360]) {
      ring.forEach(([longitude, latitude], i) => path[i ? "lineTo" : "moveTo"](...at([longitude + turn, latitude])));
      path.closePath();
    }
  const c = canvas.getContext("2d");
  c.fillStyle = colours.sea;
  c.fillRect(0, 0, width, height);
  c.fillStyle = colours.land;
  c.fill(path, "evenodd");
  c.beginPath();
  c.rect(0, at([0, -60])[1], width, height);
  c.clip();
  c.fillStyle = colours.ice;
  c.fill(path, "evenodd");
  const texture = new CanvasTexture(canvas);
  texture.colorSpace = SRGBColorSpace;
  return texture;
}
