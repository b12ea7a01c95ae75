import {
  AmbientLight, AxesHelper, BasicShadowMap, Box3, BoxGeometry, BufferAttribute, BufferGeometry, CapsuleGeometry, Color, ConeGeometry, CylinderGeometry, DirectionalLight,
  EdgesGeometry, GridHelper, Group, Line, LineBasicMaterial, LineSegments, Mesh, MeshBasicMaterial, MeshLambertMaterial, PerspectiveCamera,
  PlaneGeometry, Quaternion, Scene, ShadowMaterial, SphereGeometry, ArrowHelper, Vector3, WebGLRenderer,
} from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { colour } from "./dom.js";
import { earthRate, earthTexture, isEarth } from "./earth.js";
import { boxOf, framing, Ground, swept } from "./ground.js";
import { ellipse, kepler } from "./kepler.js";
import { meshGeometry } from "./meshes.js";

const unit = (q) => new Quaternion(q[1], q[2], q[3], q[0]);  // the data has w first

/** Where t stands among the times of a clip: frame and fraction to the next. */
export function frameAt(times, t) {
  let low = 0, high = times.length - 1;
  if (high < 1 || t <= times[0]) return [0, 0];
  if (t >= times[high]) return [high - 1, 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle;
  }
  return [low, (t - times[low]) / (times[high] - times[low])];
}

/** An arrow that is seen through bodies; of two, the one of the higher order is drawn over the other. */
class Arrow extends Group {
  constructor(tint, order) {
    super();
    this.material = new MeshBasicMaterial({ color: tint, depthTest: false, transparent: true, opacity: 0.9 });
    this.shaft = new Mesh(new CylinderGeometry(1, 1, 1, 10), this.material);
    this.head = new Mesh(new ConeGeometry(1, 1, 16), this.material);
    this.add(this.shaft, this.head);
    for (const part of this.children) part.renderOrder = order;
  }
  point(direction, length, width) {
    const tip = Math.min(6 * width, 0.5 * length);
    this.length = length;
    this.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), direction);
    this.shaft.scale.set(width, length - tip, width);
    this.shaft.position.y = (length - tip) / 2;
    this.head.scale.set(2.4 * width, tip, 2.4 * width);
    this.head.position.y = length - tip / 2;
  }
  dispose() {
    for (const part of this.children) part.geometry.dispose();
    this.material.dispose();
  }
}

/** The length of the longest of the vectors that stand `at` in rows of `step` numbers. */
function longest(v, step, at) {
  let most = 0;
  for (let i = at; i + 2 < v.length; i += step) most = Math.max(most, Math.hypot(v[i], v[i + 1], v[i + 2]));
  return most;
}

/** Whether a path is mostly sharp turns: its frames are too far apart for lines between them. */
function tangled(places) {
  const a = new Vector3(), b = new Vector3(), p = new Vector3();
  let sharp = 0, all = 0;
  for (let i = 6; i < places.length; i += 3) {
    p.fromArray(places, i - 3);
    a.copy(p).sub(b.fromArray(places, i - 6));
    b.fromArray(places, i).sub(p);
    all += b.length();
    if (a.dot(b) < 0) sharp += b.length();
  }
  return sharp > 0.25 * all;
}

/** The drawing of one mechanism: a group per moving body, boxes and frames in it. */
class Cast {
  constructor(act, look) {
    this.act = act;
    this.root = new Group();
    this.nodes = Array.from({ length: act.nodes }, () => new Group());
    this.still = new Group();
    this.frames = [];
    this.edges = [];
    this.root.add(this.still, ...this.nodes);
    this.reach = new Array(act.nodes).fill(0);
    this.holders = new Map();  // by the name of a body
    const heaviest = Math.max(...act.bodies.map((b) => b.mass || 0));
    for (const b of act.bodies) if (b.node !== undefined) this.add(b, look, b.mass === heaviest);
    const parents = new Set(act.bodies.map((b) => b.parent));
    this.movers = act.bodies.filter((b) => b.node >= 0);
    this.tips = this.movers.filter((b) => !parents.has(b.name));
  }
  /** Whose paths are drawn, {node, at, tint}: the origins of the links of these names, or the centres of mass of what has no children, the hands. */
  traced(names) {
    if (names.length) return names.flatMap((name, k) => this.movers.filter((b) => b.name === name).map((b) => ({ node: b.node, at: new Vector3(...b.p), tint: k === 0 ? "c1" : k === 1 ? "c0" : `c${k % 8}` })));
    return this.tips.map((b) => ({ node: b.node, at: new Vector3(...b.com).applyQuaternion(unit(b.q)).add(new Vector3(...b.p)), tint: "c1" }));
  }
  add(b, look, heavy) {
    const holder = new Group();
    holder.position.set(...b.p);
    holder.quaternion.copy(unit(b.q));
    this.holders.set(b.name, holder);
    (b.node < 0 ? this.still : this.nodes[b.node]).add(holder);
    const tint = b.joint === "free" && !heavy ? "caught" : heavy ? "body" : "link";
    let drawn = 0;
    if (b.visuals.length) for (const v of b.visuals) drawn = Math.max(drawn, this.shape(holder, v, v.colour ? new Color(...v.colour.slice(0, 3)) : null, tint, look));
    else if (b.box) this.shape(holder, { kind: "box", ...b.box }, null, b.joints.length || b.contacts?.length ? `${tint}-clear` : tint, look);  // what it carries may be inside
    for (const s of b.contacts || []) drawn = Math.max(drawn, this.shape(holder, s, null, tint, look));
    const com = b.com, from = new Vector3();
    const bones = b.joints.map((p) => new Vector3(...p));
    if (!bones.length && com) bones.push(new Vector3(...com));
    if (b.parent !== "world" || b.joint !== "free") for (const to of bones) this.bone(holder, from, to, look);
    else for (const to of bones) if (b.joints.length && com) this.bone(holder, new Vector3(...com), to, look);
    const axes = new AxesHelper(1);
    axes.visible = false;
    holder.add(axes);
    this.frames.push(axes);
    const own = Math.max(drawn, Math.hypot(...b.com) + (b.box ? Math.hypot(...b.box.size) / 2 : 0), ...b.joints.map((p) => Math.hypot(...p)));
    if (b.node >= 0) this.reach[b.node] = Math.max(this.reach[b.node], Math.hypot(...b.p) + own);
  }
  /** Draws a shape. @returns how far it reaches from the body's origin */
  shape(holder, s, own, tint, look) {
    const [x, y, z] = s.size;
    const geometry = s.kind === "mesh" ? meshGeometry(this.act.meshes[s.mesh], s.size) : s.kind === "sphere" ? new SphereGeometry(x, 20, 14) : s.kind === "cylinder" ? new CylinderGeometry(x, x, y, 20)
      : s.kind === "capsule" ? new CapsuleGeometry(x, y, 6, 16) : new BoxGeometry(x, y, z);
    if (s.kind === "cylinder" || s.kind === "capsule") geometry.rotateX(Math.PI / 2);  // along z, as URDF has it
    const mesh = new Mesh(geometry, own ? new MeshLambertMaterial({ color: own }) : look.material(tint));
    mesh.position.set(...s.p);
    mesh.quaternion.copy(unit(s.q));
    if (s.kind === "box") {
      const lines = new LineSegments(new EdgesGeometry(geometry), look.line("edge"));
      mesh.add(lines);
    }
    holder.add(mesh);
    geometry.computeBoundingSphere();
    const { center, radius } = geometry.boundingSphere;
    return center.clone().applyQuaternion(mesh.quaternion).add(mesh.position).length() + radius;
  }
  bone(holder, a, b, look) {
    const d = b.clone().sub(a), length = d.length();
    if (!(length > 1e-9)) return;
    const mesh = new Mesh(new CylinderGeometry(1, 1, length, 10), look.material("link"));
    mesh.userData.bone = true;
    mesh.position.copy(a).addScaledVector(d, 0.5);
    mesh.quaternion.setFromUnitVectors(new Vector3(0, 1, 0), d.divideScalar(length));
    holder.add(mesh);
  }
  /** Thickness of bones and length of frames, once the size of everything is known. */
  scale(size) {
    this.root.traverse((o) => { if (o.userData.bone) o.scale.set(size * 0.012, 1, size * 0.012); });
    for (const f of this.frames) f.scale.setScalar(size * 0.13);
    this.boxes = this.nodes.map(boxOf);
    this.fixed = boxOf(this.still);
  }
}

/** Whether pictures are drawn by the processor: smoothing edges is then too dear. */
function drawnBySoftware() {
  const gl = document.createElement("canvas").getContext("webgl2");
  const info = gl?.getExtension("WEBGL_debug_renderer_info");
  const name = info ? gl.getParameter(info.UNMASKED_RENDERER_WEBGL) : "";
  gl?.getExtension("WEBGL_lose_context")?.loseContext();
  return /swiftshader|llvmpipe|software|basic render/i.test(name);
}

const tints = { spin: "c4", momentum: "c2", force: "c3" };  // of arrows
const widths = { spin: 0.013, momentum: 0.006, force: 0.008 };  // of arrows: one that lies upon another leaves its edges to be seen
const slow = 1 / 30;  // [s] a picture may take

/** The playback: mechanism and, in orbit, the planet. onTime(t) is called whenever the time shown changes. */
export class Stage {
  constructor(host, data) {
    this.host = host;
    this.data = data;
    this.onTime = () => {};
    this.drawn = 0;  // frames drawn, for tests
    this.time = 0;
    this.rate = 1;
    this.playing = false;
    // What falls on the world is seen to fall.
    this.usual = data.acts.some((a) => a.world?.length) ? "world" : "place";
    this.options = { frames: false, arrows: false, trails: true, trailOf: [], whole: false, ride: this.usual, view: "mechanism" };
    const software = drawnBySoftware(), unhurried = location.hash === "#still";  // a picture or a film, picture by picture
    this.renderer = new WebGLRenderer({ antialias: !software, alpha: false, powerPreference: "low-power", preserveDrawingBuffer: unhurried });
    this.fine = Math.min(window.devicePixelRatio || 1, software ? 1 : 2);
    this.ratio = this.fine;  // coarser while it plays where pictures take too long
    this.mean = 0;
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "Playback of the mechanism. Drag to turn, wheel to zoom, arrow keys to turn, plus and minus to zoom, space to play or pause.");
    host.prepend(canvas);
    this.materials = new Map();
    const look = { material: (n) => this.shared(n, () => new MeshLambertMaterial(n.endsWith("-clear") ? { transparent: true, opacity: 0.42, depthWrite: false } : {})), line: (n) => this.shared(n + "-line", () => new LineBasicMaterial({ transparent: true, opacity: 0.55 })) };
    this.scene = new Scene();
    this.space = new Scene();
    for (const s of [this.scene, this.space]) {
      s.add(new AmbientLight(0xffffff, 1.5));
      const sun = new DirectionalLight(0xffffff, 2.0);
      sun.position.set(3, -5, 8);
      s.add(sun);
      if (s === this.scene) s.add((this.sun = sun).target);
      else this.daylight = sun;
    }
    // A shadow costs a second drawing of everything.
    this.renderer.shadowMap.enabled = this.sun.castShadow = !software || unhurried;
    this.shade = software ? 1024 : 2048;  // pixels of a side of its map
    if (software) this.renderer.shadowMap.type = BasicShadowMap;
    this.casts = data.acts.map((a) => new Cast(a, look));
    this.carrier = new Group();
    this.scene.add(this.carrier);
    for (const c of this.casts) this.carrier.add(c.root);
    this.measure();
    for (const c of this.casts) c.scale(this.size);
    this.clips = data.acts.map((a) => a.clips[0]);
    this.start = new Vector3(...this.clips[0].origin.subarray(0, 3));
    this.stand(look);
    this.shadows();
    this.trails = [];
    this.arrows = [];
    this.camera = new PerspectiveCamera(38, 1, this.size / 200, this.size * 400);
    this.camera.up.set(0, 0, 1);
    this.controls = this.control(this.camera);
    this.surroundings(look);
    if (data.planet && data.acts[0]?.clips[0].orbit) this.planet();
    this.resize();
    this.choose(0);
    this.look("iso");
    this.theme();
    new ResizeObserver(() => this.resize()).observe(host);
    new IntersectionObserver((e) => { this.seen = e[0].isIntersecting; this.wake(); }).observe(host);
  }
  shared(name, make) {
    if (!this.materials.has(name)) this.materials.set(name, make());
    return this.materials.get(name);
  }
  control(camera) {
    const c = new OrbitControls(camera, this.renderer.domElement);
    c.enableDamping = false;
    c.addEventListener("change", () => this.wake());
    return c;
  }
  /** How far the mechanism reaches, over all frames; far away free bodies of the start do not count. */
  measure() {
    let reach = 0;
    for (const c of this.casts) {
      const { poses } = c.act.clips[0];
      for (let i = 0; i < poses.length; i += 7) reach = Math.max(reach, Math.hypot(poses[i], poses[i + 1], poses[i + 2]) + c.reach[(i / 7) % c.act.nodes]);
    }
    this.size = Math.max(reach, 1e-6);
  }
  /** What of the world contacts touch. */
  stand(look) {
    const world = this.data.acts[0].world || [], motion = new Box3().setFromPoints(world.length ? this.spread(true) : []).translate(this.start);
    this.ground = new Ground(world, motion, this.size, this.sun.castShadow, (holder, s) => this.casts[0].shape(holder, s, null, "touched-clear", look));
    this.carrier.add(this.ground);
  }
  /** Every solid throws a shadow on every other and on the ground, as far as the mechanism reaches; where it moves in the picture, as far as it moves. */
  shadows() {
    const { camera } = this.sun.shadow, middle = new Vector3();
    let d = this.size * 1.2;
    if (this.usual === "world" && this.options.ride === "world") {
      const box = new Box3().setFromPoints(this.ground.touched(this.spread(true), this.start.clone().negate()));
      box.getCenter(middle);
      d += box.getSize(new Vector3()).length() / 2;
    }
    this.sun.position.set(3, -5, 8).setLength(3 * d).add(middle);
    this.sun.target.position.copy(middle);
    Object.assign(camera, { left: -d, right: d, top: d, bottom: -d, near: d, far: 6 * d });
    camera.updateProjectionMatrix();
    this.sun.shadow.mapSize.set(this.shade, this.shade);
    this.sun.shadow.normalBias = 0.004 * this.size;
    this.carrier.traverse((o) => { if (o.isMesh && !o.material.transparent) o.castShadow = o.receiveShadow = true; });
  }
  surroundings() {
    const act = this.data.acts[0];
    if (!act.world?.length && Math.hypot(...act.gravity) > 0 && act.clips[0].origin.every((x) => x === 0)) {
      const floor = new GridHelper(this.size * 4, 16);
      floor.rotation.x = Math.PI / 2;
      floor.material.transparent = true;
      floor.position.z = -this.size * 1.02;
      this.floor = floor;
      const shade = new Mesh(new PlaneGeometry(this.size * 4, this.size * 4), new ShadowMaterial({ opacity: 0.25 }));
      shade.position.z = floor.position.z;
      shade.receiveShadow = true;
      this.scene.add(floor, shade);
    }
  }
  planet() {
    const { radius } = this.data.planet;
    const skin = isEarth(this.data.planet) ? new MeshLambertMaterial({ map: earthTexture() }) : this.shared("planet", () => new MeshLambertMaterial());
    const ball = new Mesh(new SphereGeometry(1, 96, 64).rotateX(Math.PI / 2), skin);  // three.js has its poles on y
    const net = [];
    for (let k = 0; k < 12; ++k) for (let i = 0; i < 48; ++i) for (const j of [i, i + 1]) {
      const a = (Math.PI * k) / 6, b = (-Math.PI / 2) + (Math.PI * j) / 48;
      net.push(Math.cos(b) * Math.cos(a), Math.cos(b) * Math.sin(a), Math.sin(b));
    }
    for (let k = -2; k <= 2; ++k) for (let i = 0; i < 72; ++i) for (const j of [i, i + 1]) {
      const b = (Math.PI * k) / 6, a = (2 * Math.PI * j) / 72;
      net.push(Math.cos(b) * Math.cos(a), Math.cos(b) * Math.sin(a), Math.sin(b));
    }
    const geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(new Float32Array(net.map((x) => x * 1.001)), 3));
    const globe = new Group();
    globe.add(ball, new LineSegments(geometry, this.shared("net-line", () => new LineBasicMaterial({ transparent: true, opacity: 0.35 }))));
    this.globe = globe;
    globe.quaternion.setFromUnitVectors(new Vector3(0, 0, 1), new Vector3(...this.data.planet.axis).normalize());
    this.orbitLine = new Line(new BufferGeometry(), this.shared("orbit-line", () => new LineBasicMaterial()));
    this.orbitLine.frustumCulled = false;
    const dot = new SphereGeometry(1, 12, 8);
    this.craft = new Mesh(dot, this.shared("craft", () => new MeshLambertMaterial()));
    this.craft.add(new Mesh(dot, this.shared("craft-behind", () => new MeshBasicMaterial({ transparent: true, opacity: 0.35, depthTest: false }))));
    this.poles = globe.quaternion.clone();
    if (this.data.planet.sun) this.space.children.find((o) => o.isAmbientLight).intensity = 0.25;  // night
    this.space.add(globe, this.orbitLine, this.craft);
    this.radius = radius;
    this.far = new PerspectiveCamera(38, 1, 0.01, 5000);
    this.far.up.set(0, 0, 1);
    const s = this.data.acts[0].clips[0].orbit, d = Math.hypot(s[0], s[1], s[2]) / radius;
    this.far.position.set(2.2 * d, -2.6 * d, 1.7 * d);
    this.farControls = this.control(this.far);
    this.farControls.enabled = false;
    this.down = new ArrowHelper(new Vector3(0, 0, -1), new Vector3(), this.size * 0.9, 0x888888, this.size * 0.09, this.size * 0.05);
    this.ahead = new ArrowHelper(new Vector3(1, 0, 0), new Vector3(), this.size * 0.9, 0x888888, this.size * 0.09, this.size * 0.05);
    this.scene.add(this.down, this.ahead);
  }
  theme() {
    this.renderer.setClearColor(colour("stage"));
    for (const [name, m] of this.materials) m.color.set(colour({ "edge-line": "edge", planet: "link", "net-line": "edge", "orbit-line": "c1", craft: "caught", "craft-behind": "caught" }[name] || name.replace("-clear", "")) || "#888888");
    if (this.floor) this.floor.material.color.set(colour("guide")), (this.floor.material.opacity = 0.25);
    this.ground.tint(colour("touched"), colour("guide"));
    if (this.down) this.down.setColor(colour("c2")), this.ahead.setColor(colour("c1"));
    for (const l of this.trails) l.material.color.set(colour(l.userData.tint));
    for (const a of this.arrows) a.helper.material.color.set(colour(tints[a.kind]));
    this.wake();
  }
  resize() {
    const { clientWidth: w, clientHeight: hgt } = this.host;
    if (w < 2 || hgt < 2) return;
    this.renderer.setPixelRatio(this.ratio);
    this.renderer.setSize(w, hgt, false);
    for (const c of [this.camera, this.far]) if (c) (c.aspect = w / hgt), c.updateProjectionMatrix();
    this.wake();
  }

  /** Which clip is played: of acts with several, the whole run or its beginning. */
  choose(k) {
    this.clips = this.data.acts.map((a) => a.clips[Math.min(k, a.clips.length - 1)]);
    this.first = this.clips[0].t[0];
    this.last = Math.max(...this.clips.map((c) => c.t[c.t.length - 1]));
    this.makeTrails();
    this.makeArrows();
    this.seek(Math.min(Math.max(this.time, this.first), this.last));
  }
  makeTrails() {
    for (const l of this.trails) l.removeFromParent(), l.geometry.dispose();
    this.trails = [];
    const p = new Vector3(), q = new Quaternion();
    this.casts.forEach((cast, k) => {
      const clip = this.clips[k], n = clip.t.length;
      for (const { node, at, tint } of cast.traced(this.options.trailOf)) {
        const places = new Float32Array(3 * n);
        for (let f = 0; f < n; ++f) {
          this.pose(clip, f, node, p, q);
          const x = at.clone().applyQuaternion(q).add(p);
          if (this.options.ride === "base") {
            const r = new Quaternion(), o = new Vector3();
            this.pose(clip, f, 0, o, r);
            x.sub(o).applyQuaternion(r.invert());
          } else if (this.options.ride === "world") for (let i = 0; i < 3; ++i) x.setComponent(i, x.getComponent(i) + clip.origin[3 * f + i] - this.clips[0].origin[i]);
          x.toArray(places, 3 * f);
        }
        const line = new Line(new BufferGeometry().setAttribute("position", new BufferAttribute(places, 3)), new LineBasicMaterial({ color: colour(tint), transparent: true, opacity: 0.7 }));
        line.frustumCulled = false;
        line.userData = { act: k, tint, tangle: tangled(places) };
        this.scene.add(line);
        this.trails.push(line);
      }
    });
  }
  /** Arrows of vectors over the clip: its momentum and angular momentum, at the centre of mass, and forces at joints; the longest of a kind is as long as the mechanism. */
  makeArrows() {
    for (const a of this.arrows) a.helper.removeFromParent(), a.helper.dispose();
    this.arrows = [];
    const add = (act, kind, parent, v, step, at, length) => {
      const helper = new Arrow(colour(tints[kind]), kind === "spin" ? 1 : 2);
      helper.visible = false;
      parent.add(helper);
      this.arrows.push({ act, kind, helper, v, step, at, length, most: longest(v, step, at) });
    };
    this.casts.forEach((cast, act) => {
      const clip = this.clips[act];
      if (clip.momenta) {
        add(act, "momentum", this.carrier, clip.momenta, 9, 3, this.size * 0.8);
        add(act, "spin", this.carrier, clip.momenta, 9, 6, this.size * 0.8);
      }
      for (const f of clip.forces) if (cast.holders.has(f.body)) add(act, "force", cast.holders.get(f.body), f.v, 3, 0, this.size * 0.5);
    });
    // Forces share a scale, and so do the momenta of all phases.
    for (const a of this.arrows) a.most = Math.max(...this.arrows.filter((b) => b.kind === a.kind).map((b) => b.most));
  }
  /** What the arrows are, with the length of the longest. */
  arrowWords() {
    const seen = new Map(this.arrows.filter((a) => a.act === this.act && a.most > 0).map((a) => [a.kind, a.most]));
    const words = { spin: ["violet: angular momentum", "N m s"], momentum: ["green: momentum", "N s"], force: ["orange: force at a joint", "N"] };
    return Object.entries(words).filter(([k]) => seen.has(k)).map(([k, [text, unit]]) => `${text}, at most ${seen.get(k).toPrecision(3)} ${unit}`);
  }
  arrangeArrows(clip, f, next, s) {
    const at = (v, step, from, k) => v[step * f + from + k] + s * (v[step * next + from + k] - v[step * f + from + k]);
    for (const a of this.arrows) {
      const d = new Vector3(...[0, 1, 2].map((k) => at(a.v, a.step, a.at, k))), size = d.length();
      // What is not but rounding is shown.
      a.helper.visible = this.options.arrows && a.act === this.act && size > 1e-6 * a.most && size > 1e-9;
      if (!a.helper.visible) continue;
      a.helper.point(d.divideScalar(size), (a.length * size) / a.most, widths[a.kind] * this.size);
      if (a.kind !== "force") a.helper.position.set(...[0, 1, 2].map((k) => at(a.v, a.step, 0, k)));
    }
  }
  /** Where the arrows begin and end over all frames, as they are drawn; none where they are not. */
  arrowEnds() {
    if (!this.options.arrows) return [];
    const { time } = this, ends = [], most = 300;
    for (const { t } of this.clips) for (let k = 0, n = Math.min(t.length, most); k < n; ++k) {
      this.time = t[n > 1 ? Math.round((k * (t.length - 1)) / (n - 1)) : 0];
      this.arrange();
      this.carrier.updateMatrixWorld();
      for (const { helper } of this.arrows) if (helper.visible) for (const y of [0, helper.length]) ends.push(helper.localToWorld(new Vector3(0, y, 0)));
    }
    this.time = time;
    this.arrange();
    return ends;
  }
  pose(clip, f, node, p, q) {
    const i = 7 * (f * clip.nodes + node), d = clip.poses;
    p.set(d[i], d[i + 1], d[i + 2]);
    q.set(d[i + 4], d[i + 5], d[i + 6], d[i + 3]);
  }

  set(option, value) {
    this.options[option] = value;
    if (option === "ride" || option === "trailOf") this.makeTrails();
    if (option === "ride") this.shadows();
    if (option === "view" && this.far) {
      this.controls.enabled = value === "mechanism";
      this.farControls.enabled = value === "orbit";
    }
    this.seek(this.time);
  }
  /** Points around all that moves, over the whole time: seen from its place at the start (`still`), or from that of each time. */
  spread(still) {
    const places = this.clips.flatMap((clip, k) => swept(clip, this.casts[k].boxes, still));
    const { fixed } = this.casts[0];
    return fixed.isEmpty() ? places : places.concat([fixed.min, fixed.max]);
  }
  /** What the camera is to show: the mechanism over all frames, about its place or as it moves, these ends of arrows, whole paths, and what of the world is touched. */
  shown(ends = []) {
    const { ride, view, whole } = this.options, world = this.data.acts[0].world?.length, still = ride === "world" && (world || whole);
    if (view !== "mechanism" || ride === "base") return null;
    const away = this.start.clone().negate(), p = new Vector3();
    const points = still && world ? this.ground.touched(this.spread(still), away) : this.spread(still);
    if (!points.length) return null;
    if (whole && still) for (const l of this.trails) if (!l.userData.tangle) for (let i = 0, v = l.geometry.getAttribute("position"); i < v.count; ++i) points.push(p.fromBufferAttribute(v, i).clone());
    return points.concat(this.ground.beside(points, away), ends);
  }
  /** Camera presets, or without a name from where the camera stands; the target stays the middle of what is shown. */
  look(name) {
    const orbit = this.options.view === "orbit" && this.far;
    const [camera, controls] = orbit ? [this.far, this.farControls] : [this.camera, this.controls];
    const to = { iso: [0.62, -0.72, 0.45], x: [1, 0, 0.0001], y: [0, -1, 0.0001], z: [0, -0.0001, 1] }[name] || camera.position.clone().sub(controls.target).normalize().toArray();
    const ends = orbit ? [] : this.arrowEnds(), radius = Math.max(this.size, ...ends.map((p) => p.length()));
    const points = this.shown(ends), round = { middle: new Vector3(), distance: (2.8 * Math.hypot(...to) * radius) / Math.min(1, Math.max(0.4, camera.aspect || 1)) };  // 3.07 shows the whole of a ball
    const { middle, distance } = orbit ? { middle: round.middle, distance: this.far.position.length() } : points ? framing(points, to, camera) : round;
    camera.position.set(...to).setLength(distance).add(middle);
    if (!orbit) camera.far = Math.max(camera.far, 8 * distance), camera.updateProjectionMatrix();
    controls.target.copy(middle);
    controls.update();
    this.wake();
  }
  zoom(factor) {
    const orbit = this.options.view === "orbit" && this.far;
    const [camera, controls] = orbit ? [this.far, this.farControls] : [this.camera, this.controls];
    camera.position.sub(controls.target).multiplyScalar(factor).add(controls.target);
    controls.update();
  }
  turn(angle, up) {
    const [camera, controls] = this.options.view === "orbit" && this.far ? [this.far, this.farControls] : [this.camera, this.controls];
    const d = camera.position.clone().sub(controls.target);
    d.applyAxisAngle(new Vector3(0, 0, 1), angle);
    const side = new Vector3(0, 0, 1).cross(d).normalize();
    d.applyAxisAngle(side, -up);
    if (Math.abs(d.z) < 0.999 * d.length()) camera.position.copy(controls.target).add(d);
    controls.update();
  }

  play(on) {
    this.playing = on;
    if (!on) this.sharpen(this.fine);
    if (on && this.time >= this.last) this.time = this.first;
    this.before = null;
    this.wake();
  }
  /** Fewer pixels while pictures come too slowly, all of them when it stands still. */
  sharpen(ratio) {
    this.mean = 0;
    if (ratio === this.ratio) return;
    this.ratio = ratio;
    this.resize();
  }
  watch(passed) {
    if (!(passed > 0)) return;
    this.mean = this.mean ? this.mean + 0.1 * (passed - this.mean) : passed;
    this.seenFrames = (this.seenFrames || 0) + 1;
    if (this.seenFrames < 12 || this.mean < slow) return;
    this.seenFrames = 0;
    this.sharpen(Math.max(0.4, 0.75 * this.ratio));
  }
  seek(t) {
    this.time = Math.min(Math.max(t, this.first), this.last);
    this.arrange();
    this.onTime(this.time);
    this.wake();
  }
  /** One picture is asked for; while it plays, each asks for the next. Nothing is drawn out of sight. */
  wake() {
    if (this.asked || this.seen === false) return;
    this.asked = requestAnimationFrame((at) => {
      this.asked = 0;
      if (this.playing) {
        const passed = this.before ? Math.min(0.25, (at - this.before) / 1000) : 0;
        this.before = at;
        this.watch(passed);
        this.time = Math.min(this.last, this.time + passed * this.rate);
        if (this.time >= this.last) this.play(false);
        this.arrange();
        this.onTime(this.time);
      }
      this.draw();
      if (this.playing) this.wake();
    });
  }
  /** Puts everything where it is at this time. */
  arrange() {
    let act = 0;
    for (let k = 1; k < this.clips.length; ++k) if (this.time >= this.clips[k].t[0]) act = k;
    this.act = act;
    const clip = this.clips[act], cast = this.casts[act], [f, s] = frameAt(clip.t, this.time), next = Math.min(f + 1, clip.t.length - 1);
    this.casts.forEach((c, k) => (c.root.visible = k === act));
    const p = new Vector3(), q = new Quaternion(), p1 = new Vector3(), q1 = new Quaternion();
    cast.nodes.forEach((n, i) => {
      this.pose(clip, f, i, p, q);
      this.pose(clip, next, i, p1, q1);
      n.position.lerpVectors(p, p1, s);
      n.quaternion.slerpQuaternions(q, q1, s);
    });
    const o = clip.origin;
    this.place(cast.nodes[0], new Vector3(...[0, 1, 2].map((i) => o[3 * f + i] + s * (o[3 * next + i] - o[3 * f + i]))));
    this.arrangeArrows(clip, f, next, s);
    for (const frames of cast.frames) frames.visible = this.options.frames;
    const tail = this.options.whole ? clip.t.length : Math.max(2, Math.min(120, clip.t.length));
    for (const l of this.trails) {
      l.visible = this.options.trails && l.userData.act === act && !l.userData.tangle;
      const end = f + 1, begin = Math.max(0, end - tail);
      l.geometry.setDrawRange(begin, end - begin);
    }
    if (clip.orbit && this.craft) this.arrangeOrbit(clip, f);
  }
  /** Puts the mechanism where the camera's frame has it, and the world about it. origin: of the places of bodies */
  place(base, origin) {
    this.carrier.position.set(0, 0, 0);
    this.carrier.quaternion.identity();
    if (this.options.ride === "base" && base) {
      this.carrier.quaternion.copy(base.quaternion).invert();
      this.carrier.position.copy(base.position).negate().applyQuaternion(this.carrier.quaternion);
    } else if (this.options.ride === "world") this.carrier.position.copy(origin).sub(this.start);
    this.ground.position.copy(origin).negate();
  }
  /** Shows a pose that no record has: place and quaternion w x y z of every moving body, relative to an origin. */
  show(poses, origin = [0, 0, 0]) {
    const { nodes } = this.casts[0];
    nodes.forEach((n, i) => this.pose({ nodes: nodes.length, poses }, 0, i, n.position, n.quaternion));
    this.place(nodes[0], new Vector3(...origin));
    this.ground.follow(new Vector3(...origin));
    for (const l of this.trails) l.visible = false;
  }
  arrangeOrbit(clip, f) {
    const s = clip.orbit.subarray(6 * f, 6 * f + 6), { mu } = this.data.planet;
    const r = kepler(mu, s, this.time - clip.t[f]), R = this.radius, e = kepler(mu, s, this.time - clip.t[f] + 1);
    this.craft.position.set(r[0] / R, r[1] / R, r[2] / R);
    this.craft.scale.setScalar(0.012 * this.far.position.distanceTo(this.craft.position));
    if (this.shownOrbit !== f) {
      const points = ellipse(mu, s);
      this.orbitLine.geometry.dispose();
      this.orbitLine.geometry = new BufferGeometry().setFromPoints(points.map((x) => new Vector3(x[0] / R, x[1] / R, x[2] / R)));
      this.shownOrbit = f;
    }
    const { sun, rate, greenwich } = this.data.planet, turning = rate || (isEarth(this.data.planet) ? earthRate : 0);
    if (sun) this.daylight.position.set(...kepler(sun.mu, sun.state, this.time)).setLength(10);
    this.globe.quaternion.copy(this.poles).multiply(new Quaternion().setFromAxisAngle(new Vector3(0, 0, 1), (greenwich + turning * this.time) % (2 * Math.PI)));
    const turn = this.carrier.quaternion;
    this.altitude = Math.hypot(...r) - R;
    this.down.setDirection(new Vector3(-r[0], -r[1], -r[2]).normalize().applyQuaternion(turn));
    this.ahead.setDirection(new Vector3(e[0] - r[0], e[1] - r[1], e[2] - r[2]).normalize().applyQuaternion(turn));
  }
  draw() {
    const orbit = this.options.view === "orbit" && this.far;
    this.renderer.render(orbit ? this.space : this.scene, orbit ? this.far : this.camera);
    ++this.drawn;
  }
  /** The links whose paths can be drawn, of all phases. */
  movers() {
    return [...new Set(this.casts.flatMap((c) => c.movers.map((b) => b.name)))];
  }
  /** Place and attitude of every moving body now, for tests. */
  poses() {
    return this.casts[this.act].nodes.flatMap((n) => [...n.position.toArray(), ...n.quaternion.toArray()]);
  }
}
