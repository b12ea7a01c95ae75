/** What of the world contacts touch, and the frame of a camera around a motion. */
import { Box3, BufferAttribute, BufferGeometry, DoubleSide, Group, LineBasicMaterial, LineSegments, Matrix4, Mesh, MeshBasicMaterial, Plane, PlaneGeometry, Quaternion, ShadowMaterial, Vector3 } from "three";

const most = 100000;  // points that a frame is found from
const near = 20;  // sizes of the mechanism: a plane farther away than this, and than the motion is wide, is out of the frame

/** The box around the solids of a group that stands at no place of its own. */
export function boxOf(group) {
  const box = new Box3();
  group.updateMatrixWorld();
  group.traverse((o) => {
    if (!o.isMesh) return;
    o.geometry.computeBoundingBox();
    box.union(o.geometry.boundingBox.clone().applyMatrix4(o.matrixWorld));
  });
  return box;
}

const corners = ({ min, max }) => [0, 1, 2, 3, 4, 5, 6, 7].map((k) => new Vector3(k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z));

/** The corners of the boxes of all bodies over a clip, seen from its origin at the start (`still`) or at each time. boxes: of the moving bodies */
export function swept(clip, boxes, still) {
  const n = clip.t.length, all = boxes.map((b) => (b.isEmpty() ? [] : corners(b))), points = [];
  const frames = Math.max(1, Math.min(n, Math.floor(most / (8 * Math.max(1, boxes.length)))));
  const q = new Quaternion(), d = clip.poses, o = clip.origin;
  for (let k = 0; k < frames; ++k) {
    const f = frames > 1 ? Math.round((k * (n - 1)) / (frames - 1)) : 0;
    const from = new Vector3(...[0, 1, 2].map((i) => (still ? o[3 * f + i] - o[i] : 0)));
    all.forEach((box, node) => {
      const i = 7 * (f * clip.nodes + node), p = new Vector3(d[i], d[i + 1], d[i + 2]).add(from);
      q.set(d[i + 4], d[i + 5], d[i + 6], d[i + 3]);
      for (const c of box) points.push(c.clone().applyQuaternion(q).add(p));
    });
  }
  return points;
}

/** The number nearest to x that is 1, 2 or 5 times a power of ten. */
const nice = (x) => { const e = 10 ** Math.floor(Math.log10(x)), m = x / e; return e * (m < 1.5 ? 1 : m < 3.5 ? 2 : m < 7.5 ? 5 : 10); };

/** The lines of a square of count by count cells, cell by cell: drawn by the processor, a line that goes on behind the camera would be lost whole. */
function net(count, cell) {
  const ends = [];
  for (let i = 0; i <= count; ++i) for (let k = 0; k < count; ++k) ends.push([i, k, i, k + 1], [k, i, k + 1, i]);
  const points = ends.flatMap(([a, b, c, d]) => [[a, b], [c, d]]).flatMap(([x, y]) => [(x - count / 2) * cell, (y - count / 2) * cell, 0]);
  return new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(points), 3));
}

/** Shapes of the world, drawn about a motion: a plane is a grid beneath it. */
export class Ground extends Group {
  /** shapes: of the page's data; motion: the box around it, in the world; size: of the mechanism; shaded: planes show shadows; solid(group, shape) draws another shape */
  constructor(shapes, motion, size, shaded, solid) {
    super();
    this.shaded = shaded;
    this.grids = [];  // their materials
    this.patches = [];
    this.size = size;
    this.reach = Math.max(near * size, 2 * motion.getSize(new Vector3()).length());
    this.planes = [];
    this.boxes = [];
    for (const s of shapes) {
      const holder = new Group();
      this.add(holder);
      if (s.kind !== "plane") {
        solid(holder, s);
        this.boxes.push(boxOf(holder));
        continue;
      }
      holder.position.set(...s.p);
      holder.quaternion.set(s.q[1], s.q[2], s.q[3], s.q[0]);
      this.planes.push(new Plane().setFromNormalAndCoplanarPoint(new Vector3(0, 0, 1).applyQuaternion(holder.quaternion), holder.position));
      this.grid(holder, motion, size);
    }
  }
  grid(holder, motion, size) {
    holder.updateMatrixWorld();
    const own = motion.clone().applyMatrix4(new Matrix4().copy(holder.matrixWorld).invert()), span = own.getSize(new Vector3());
    const height = Math.min(this.reach, Math.max(Math.abs(own.min.z), Math.abs(own.max.z)));
    const side = Math.max(span.x, span.y, 2 * size, height), cell = nice((2.5 * side) / 24), count = 2 * Math.ceil((1.25 * side) / cell);
    const patch = new Group();
    this.patches.push({ patch, cell });
    const lines = new LineSegments(net(count, cell), new LineBasicMaterial({ transparent: true, opacity: 0.8 }));
    this.grids.push(lines.material);
    const face = new MeshBasicMaterial({ transparent: true, opacity: 0.3, depthWrite: false, side: DoubleSide }), plane = new PlaneGeometry(count * cell, count * cell);
    this.grids.push(face);
    patch.add(new Mesh(plane, face), lines);
    if (this.shaded) {
      const shade = new Mesh(plane, new ShadowMaterial({ opacity: 0.25 }));
      shade.receiveShadow = true;
      patch.add(shade);
    }
    holder.add(patch);
    this.follow(motion.getCenter(new Vector3()));
  }
  /** Puts the grids beneath a point of the world; their lines stay where they are. */
  follow(point) {
    for (const { patch, cell } of this.patches) {
      const { position, quaternion } = patch.parent, own = point.clone().sub(position).applyQuaternion(quaternion.clone().invert());
      patch.position.set(Math.round(own.x / cell) * cell, Math.round(own.y / cell) * cell, 0);
    }
  }
  distance(p) {
    return Math.min(...this.planes.map((x) => Math.abs(x.distanceToPoint(p))), ...this.boxes.map((b) => b.distanceToPoint(p)));
  }
  /** Of a motion what is near the world: what falls off a table is out of the frame once it is far from it. away: from the points' origin to the world's */
  touched(points, away) {
    const to = points.map((p) => this.distance(p.clone().sub(away))), wide = Math.max(0, ...this.boxes.map((b) => b.getSize(new Vector3()).length()));
    const most = Math.max(near * this.size, wide, 1.5 * to[0]);
    return points.filter((_, i) => to[i] <= most);
  }
  /** What a frame around points has to show besides: the planes beneath them, if near, and of other shapes what is near. away: from the points' origin to the world's */
  beside(points, away) {
    const box = new Box3().setFromPoints(points).translate(away.clone().negate()), around = box.clone().expandByScalar(box.getSize(new Vector3()).length());
    const all = [];
    for (const plane of this.planes) for (const c of corners(box)) if (Math.abs(plane.distanceToPoint(c)) < this.reach) all.push(plane.projectPoint(c, new Vector3()));
    for (const b of this.boxes) {
      const middle = box.getCenter(new Vector3()), c = b.clampPoint(middle, new Vector3()), part = b.clone().intersect(around);
      if (c.distanceTo(middle) < this.reach) all.push(c);
      if (!part.isEmpty()) all.push(...corners(part));
    }
    return all.map((c) => c.add(away));
  }
  tint(touched, lines) {
    for (const m of this.grids) m.color.set(m.isMeshBasicMaterial ? touched : lines);
  }
}

/** The nearest place from which a camera that looks against `towards` sees all points, as the point it looks at and the distance from there. */
export function framing(points, towards, camera, margin = 1.12) {
  const z = new Vector3(...towards).normalize(), x = new Vector3().crossVectors(camera.up, z).normalize(), y = new Vector3().crossVectors(z, x);
  const t = Math.tan((camera.fov * Math.PI) / 360) / margin, w = t * (camera.aspect || 1);
  let right = -Infinity, left = -Infinity, above = -Infinity, below = -Infinity, front = -Infinity, back = Infinity;
  for (const p of points) {
    const a = p.dot(x), b = p.dot(y), c = p.dot(z);
    right = Math.max(right, a + w * c);
    left = Math.max(left, w * c - a);
    above = Math.max(above, b + t * c);
    below = Math.max(below, t * c - b);
    front = Math.max(front, c);
    back = Math.min(back, c);
  }
  const depth = (front + back) / 2, far = Math.max((right + left) / (2 * w), (above + below) / (2 * t));
  const middle = x.multiplyScalar((right - left) / 2).addScaledVector(y, (above - below) / 2).addScaledVector(z, depth);
  return { middle, distance: far - depth };
}
