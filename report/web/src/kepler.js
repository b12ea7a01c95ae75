/** Two-body motion between two frames: r(t0 + dt) from r, v. Ellipses by the change of the eccentric anomaly
 *  (Battin 1999, sec. 4.3); what is not bound goes straight on. */
export function kepler(mu, s, dt) {
  const r0 = Math.hypot(s[0], s[1], s[2]), v2 = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  const a = 1 / (2 / r0 - v2 / mu);
  if (!(a > 0)) return [s[0] + s[3] * dt, s[1] + s[4] * dt, s[2] + s[5] * dt];
  const n = Math.sqrt(mu / (a * a * a)), sigma = (s[0] * s[3] + s[1] * s[4] + s[2] * s[5]) / Math.sqrt(mu * a), c = 1 - r0 / a;
  const turn = 2 * Math.PI, M = n * dt - turn * Math.round((n * dt) / turn);
  let E = M;
  for (let i = 0; i < 30; ++i) {
    const d = (E - c * Math.sin(E) + sigma * (1 - Math.cos(E)) - M) / (1 - c * Math.cos(E) + sigma * Math.sin(E));
    E -= d;
    if (Math.abs(d) < 1e-13) break;
  }
  const f = 1 - (a / r0) * (1 - Math.cos(E)), g = (M - E + Math.sin(E)) / n;
  return [0, 1, 2].map((k) => f * s[k] + g * s[3 + k]);
}

/** Points of the osculating orbit, closed. */
export function ellipse(mu, s, points = 180) {
  const r0 = Math.hypot(s[0], s[1], s[2]), v2 = s[3] * s[3] + s[4] * s[4] + s[5] * s[5];
  const a = 1 / (2 / r0 - v2 / mu);
  if (!(a > 0)) return [];
  const cross = (x, y) => [x[1] * y[2] - x[2] * y[1], x[2] * y[0] - x[0] * y[2], x[0] * y[1] - x[1] * y[0]];
  const r = [s[0], s[1], s[2]], v = [s[3], s[4], s[5]], L = cross(r, v);
  let e = cross(v, L).map((x, k) => x / mu - r[k] / r0);
  const ecc = Math.hypot(...e), p = ecc > 1e-9 ? e.map((x) => x / ecc) : r.map((x) => x / r0);
  const l = Math.hypot(...L), q = cross(L.map((x) => x / l), p), b = a * Math.sqrt(1 - Math.min(1, ecc * ecc));
  const out = [];
  for (let i = 0; i <= points; ++i) {
    const E = (2 * Math.PI * i) / points, x = a * (Math.cos(E) - (ecc > 1e-9 ? ecc : 0)), y = b * Math.sin(E);
    out.push(p.map((u, k) => u * x + q[k] * y));
  }
  return out;
}
