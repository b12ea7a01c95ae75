/** The page's data: what the program wrote, with typed arrays in place of base64. */

function bytes(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const raw = atob(text), out = new Uint8Array(raw.length);
  for (let i = 0; i < raw.length; ++i) out[i] = raw.charCodeAt(i);
  return out;
}
const floats = (text) => new Float32Array(bytes(text).buffer);
const shorts = (text) => new Uint16Array(bytes(text).buffer);
const doubles = (text) => new Float64Array(bytes(text).buffer);

/** One array of numbers after another. */
function joined(parts) {
  const out = new Float64Array(parts.reduce((n, p) => n + p.length, 0));
  let at = 0;
  for (const p of parts) out.set(p, at), (at += p.length);
  return out;
}

/** The series of all phases, one after another; a source that a phase lacks is a gap there. Works go on where the phase before left them. */
function join(phases) {
  const all = phases.map((p) => p.series);
  if (!all.length) return null;
  const t = all.map((s) => doubles(s.t));
  const gap = (k) => new Float64Array(t[k].length).fill(NaN);
  const plain = (name) => joined(all.map((s, k) => (s[name] ? floats(s[name]) : gap(k))));
  const group = (name, sums) => {
    const names = [...new Set(all.flatMap((s) => s[name].map((x) => x.name)))];
    return names.map((n) => {
      let before = 0;
      return { name: n, v: joined(all.map((s, k) => {
        const found = s[name].find((x) => x.name === n);
        if (!found) return sums ? new Float64Array(t[k].length).fill(before) : gap(k);
        const v = Float64Array.from(floats(found.v), (x) => x + before);
        if (sums) before = v[v.length - 1];
        return v;
      })) };
    });
  };
  // Each energy upon those before it, from zero or from its least value where that is below zero.
  const stored = group("stored", false);
  for (const s of stored) s.least = s.v.reduce((a, b) => (b < a ? b : a), 0), s.parts = [];
  all.forEach((phase, k) => {
    let below = 0, top = new Float64Array(t[k].length);
    for (const s of stored) {
      const found = phase.stored.find((x) => x.name === s.name);
      if (found) below += s.least, top = Float64Array.from(floats(found.top), (x) => x - below);
      s.parts.push(top);
    }
  });
  for (const s of stored) s.top = joined(s.parts), delete s.parts;
  return {
    t: joined(t), records: all.reduce((n, s) => n + s.records, 0), exact: all.every((s) => s.exact),
    stored, supplied: group("supplied", true), dissipated: group("dissipated", true),
    error: plain("energy_error"), rms: plain("energy_rms"), linear: plain("linear"), angular: plain("angular"),
    quaternion: plain("quaternion"), step: plain("step"), sweeps: all.some((s) => s.sweeps) ? plain("sweeps") : null,
  };
}

/** The motion of all phases, one after another; a line that a phase lacks is a gap there. Panels are met by their titles and lines. */
function joinMotion(phases) {
  const all = phases.map((p) => p.motion).filter((m) => m && m.panels.length);
  if (!all.length) return null;
  const t = all.map((m) => doubles(m.t)), panels = new Map();
  all.forEach((m, k) => m.panels.forEach((p) => p.lines.forEach((l) => {
    if (!panels.has(p.what)) panels.set(p.what, new Map());
    const lines = panels.get(p.what);
    if (!lines.has(l.name)) lines.set(l.name, { held: false, v: t.map((x) => new Float64Array(x.length).fill(NaN)) });
    const line = lines.get(l.name);
    line.v[k] = Float64Array.from(floats(l.v));
    line.held ||= !!l.held;
  })));
  return withGaps({ t: joined(t), holes: joined(all.map((m) => doubles(m.holes))), panels: [...panels].map(([what, lines]) => ({ what, lines: [...lines].map(([name, l]) => ({ name, held: l.held, v: joined(l.v) })) })) });
}

/** A motion with a record more where an angle that never leaves [-π, π] jumps from one end to the other, a gap of that line, and where records are missing, a gap of all. */
function withGaps({ t, holes, panels }) {
  const lines = panels.flatMap((p) => p.lines), jumps = (v, i) => Math.abs(v[i] - v[i - 1]) > Math.PI;
  const wraps = panels.filter((p) => p.what.endsWith("[rad]")).flatMap((p) => p.lines).filter((l) => !l.v.some((y) => Math.abs(y) > Math.PI + 1e-6));  // of floats
  const missing = new Set(Array.from(holes, (x) => t.findIndex((y) => y > x)));
  const order = Array.from(t.keys()).flatMap((i) => (i > 0 && (missing.has(i) || wraps.some((l) => jumps(l.v, i))) ? [-i, i] : [i]));
  for (const l of lines) {
    const v = l.v, wrapped = wraps.includes(l);
    l.v = Float64Array.from(order, (i) => (i >= 0 ? v[i] : missing.has(-i) || (wrapped && jumps(v, -i)) ? NaN : v[-i]));
  }
  return { t: Float64Array.from(order, (i) => t[Math.abs(i)]), panels };
}

function decodeClip(c, nodes) {
  const t = doubles(c.t);
  return { name: c.name, t, origin: doubles(c.origin), poses: floats(c.poses), nodes, turn: c.turn, orbit: c.orbit ? doubles(c.orbit) : null,
    momenta: c.momenta ? floats(c.momenta) : null, forces: (c.forces || []).map((x) => ({ body: x.body, v: floats(x.v) })) };
}

export function read() {
  const d = JSON.parse(document.getElementById("porthos-data").textContent);
  d.series = join(d.phases.filter((p) => p.series));
  d.motion = joinMotion(d.phases);
  const meshes = (d.meshes || []).map((m) => ({ ...m, corners: shorts(m.corners), triangles: shorts(m.triangles) }));
  d.acts = d.phases.filter((p) => p.playback).map((p) => ({
    ...p.playback, meshes, from: p.from, clips: p.playback.clips.map((c) => decodeClip(c, p.playback.nodes)),
  }));
  delete d.phases;
  for (const c of d.cases?.columns || []) c.v = floats(c.v);
  return d;
}
