// What the playback and its films show: node playback_test.mjs CLI MODULES SOURCE WORK, see page_test.mjs.
import { spawnSync } from "node:child_process";
import { existsSync, writeFileSync } from "node:fs";
import { join } from "node:path";
import { browser, cli, expect, film, finish, out, skip, source } from "./in_browser.mjs";

function run(name, scene, ...options) { spawnSync(cli, ["run", scene, "--out", out(name), ...options]); }
/** Runs a scene with a model of one link with this inertia and more elements. */
function made(name, inertia, more, scene) {
  writeFileSync(out(`${name}.urdf`), `<robot name="${name}"><link name="hub"><inertial><mass value="100"/><inertia ${inertia} ixy="0" ixz="0" iyz="0"/></inertial></link>${more}</robot>`);
  writeFileSync(out(`${name}.toml`), `[model]\nurdf = "${name}.urdf"\nbase = "free"\n${scene}`);
  run(name, out(`${name}.toml`));
}
const falls = '[environment]\ngravity = "uniform"\nvector = [0, 0, -10]\n[integrator]\nmethod = "gauss8"\nstep = 0.01\n';
const contact = (name, shape, more) => `[[contact]]\nname = "${name}"\nlinks = ["hub"]\nshape = ${shape}\n${more}`;
const ball = 'ixx="0.4" iyy="0.4" izz="0.4"';  // radius 0.1 m

run("bounce", join(source, "examples/bouncing_ball/scene.toml"), "--duration", "1");
if (!existsSync(join(out("bounce"), "report.html"))) skip("no template of the report was built");
made("table", ball, "", `${falls}[run]\nduration = 4\n[initial]\nbase = { position = [0.3, 0, 1.25], linear_velocity = [0.8, 0, 0] }\n`
  + contact("table", '{ kind = "sphere", radius = 0.1 }', 'law = "rigid"\nrestitution = 0.6\nfriction = 0.3\nagainst_shape = { kind = "box", size = [1, 1, 0.04], at = [0, 0, 0.73] }\n'));
const feet = [[0.6, 0], [-0.4, 0.5], [-0.4, -0.5]].map(([x, y], k) => contact(`foot_${k}`, `{ kind = "sphere", radius = 0.05, at = [${x}, ${y}, -0.6] }`, 'law = "power"\nstiffness = 2e4\n')).join("");
made("feet", 'ixx="10" iyy="10" izz="18"', "", `${falls}[run]\nduration = 0.1\n[initial]\nbase.position = [0, 0, 0.8]\n${feet}`);
made("bare", 'ixx="10" iyy="10" izz="18"', "", `${falls}[run]\nduration = 0.1\n[initial]\nbase.position = [0, 0, 0.8]\n`);
made("wheel", 'ixx="10" iyy="12" izz="9"', '<joint name="w" type="continuous"><parent link="hub"/><child link="r"/><axis xyz="1 0 0"/></joint><link name="r"><inertial><mass value="5"/><inertia ixx="0.02" iyy="0.01" izz="0.01" ixy="0" ixz="0" iyz="0"/></inertial></link>',
  '[initial]\njoints.w = { velocity = 5 }\n[orbit]\naltitude = 5e5\n[integrator]\nmethod = "gauss8"\nstep = 10\n[run]\nduration = 86400\nrecord_every = 30\n');
run("arms", join(source, "examples/two_arms/scene.toml"), "--duration", "200");

async function open(name) {
  const tab = await browser.newPage({ viewport: { width: 1280, height: 900 } }), complaints = [];
  tab.on("console", (m) => m.type() === "error" && complaints.push(m.text()));
  tab.on("pageerror", (e) => complaints.push(e.message));
  await tab.goto(`file://${join(out(name), "report.html")}`);
  await tab.waitForFunction(() => window.porthos?.stage, null, { timeout: 60000 });
  return { tab, complaints, close: async () => { expect(complaints.length === 0, `${name}: no error ${complaints.join("; ")}`); await tab.close(); } };
}
/** Where the first body stands in the picture at some times, in halves of its width and height, with its height above the ground [m]. */
const seen = (tab, times) => tab.evaluate((all) => {
  const s = porthos.stage;
  s.camera.updateMatrixWorld();
  return all.map((t) => {
    s.seek(t);
    s.scene.updateMatrixWorld();
    const at = s.camera.position.clone().setFromMatrixPosition(s.casts[0].nodes[0].matrixWorld), p = at.clone().project(s.camera);
    return { x: p.x, y: p.y, above: s.ground.worldToLocal(at).z };
  });
}, times);

console.log("the ground");
{
  const page = await open("bounce"), [start, touch, late] = await seen(page.tab, [0, 0.475, 0.98]);
  const first = await page.tab.evaluate(() => ({ ride: porthos.stage.options.ride, grids: porthos.stage.ground.planes.length, chosen: document.querySelector('#playback option[value="world"]').selected }));
  expect(first.ride === "world" && first.chosen && first.grids === 1, `a ball over a plane: the camera stands in the ${first.ride}, ${first.grids} grid`);
  expect(start.y - touch.y > 0.5, `it is seen to fall by ${(start.y - touch.y).toFixed(2)} of the half picture, more than 0.5 expected`);
  const most = Math.max(...[start, touch, late].flatMap((p) => [Math.abs(p.x), Math.abs(p.y)]));
  expect(most < 1, `it stays in the picture: at most ${most.toFixed(2)} of the half, less than 1 expected`);
  expect(Math.abs(touch.above - 0.1) < 0.03 && Math.abs(start.above - 1.2) < 1e-6, `its centre stands ${touch.above.toFixed(3)} m above the grid when it touches, 0.1 expected, and 1.2 at the start`);
  await page.tab.evaluate(() => { porthos.stage.set("ride", "place"); porthos.stage.look("iso"); });
  const still = await seen(page.tab, [0, 0.475]);
  expect(Math.abs(still[0].y - still[1].y) < 1e-6, "control: a camera that follows its place does not see it fall");
  expect(Math.abs(still[1].above - touch.above) < 1e-6, "the ground passes by then");
  const shown = await page.tab.evaluate(async () => {  // as render() draws: a pose of no record, with its origin
    const s = porthos.stage;
    s.show([0, 0, 0, 1, 0, 0, 0], [7, 0, 3]);
    const { patch, cell } = s.ground.patches[0];
    return { at: s.ground.position.toArray().join(), patch: patch.position.x, cell };
  });
  expect(shown.at === "-7,0,-3" && Math.abs(shown.patch - 7) <= shown.cell, `for a pose of no record the world stands at ${shown.at}, its grid beneath the ball at x = ${shown.patch.toFixed(1)} m`);
  await page.close();

  const table = await open("table"), [above, onto] = await seen(table.tab, [0, 0.3]);
  const world = await table.tab.evaluate(() => ({ solids: porthos.stage.ground.boxes.map((b) => [b.max.z, b.max.x]), clear: porthos.stage.materials.get("touched-clear").transparent, size: porthos.stage.camera.position.distanceTo(porthos.stage.controls.target), fallen: -Math.min(...porthos.stage.spread(true).map((p) => p.z)) }));
  expect(world.solids.length === 1 && Math.abs(world.solids[0][0] - 0.75) < 1e-6 && world.clear, `a table of the world: its top at ${world.solids[0]?.[0].toFixed(3)} m, 0.75 expected, translucent`);
  expect(Math.abs(above.above - 1.25) < 1e-6 && onto.above < 1.05 && Math.max(Math.abs(above.y), Math.abs(onto.y)) < 1, `the ball falls on it from ${above.above.toFixed(2)} m to ${onto.above.toFixed(2)} m in the picture`);
  expect(world.size < 10 && world.fallen > 20, `what falls off the table, for ${world.fallen.toFixed(0)} m, does not widen the frame: the camera is ${world.size.toFixed(1)} m away, less than 10 expected`);
  await table.close();
}

console.log("shapes of contacts");
{
  const solids = async (name) => {
    const page = await open(name), r = await page.tab.evaluate(() => {
      const all = [];
      porthos.stage.casts[0].nodes[0].traverse((o) => o.isMesh && all.push(`${o.geometry.type}${o.material.transparent ? " clear" : ""}`));
      return all.filter((x) => /Sphere|Box/.test(x)).sort().join(", ");
    });
    await page.close();
    return r;
  };
  const feet = await solids("feet"), bare = await solids("bare");
  expect(feet === "BoxGeometry clear, SphereGeometry, SphereGeometry, SphereGeometry", `three feet beside the body's box: ${feet}`);
  expect(bare === "BoxGeometry", `control, without contacts: ${bare}`);
}

console.log("a long run with a fast wheel");
{
  const page = await open("wheel"), r = await page.tab.evaluate(() => { const s = porthos.stage, last = s.last; s.choose(1); return { last, part: s.last, turn: s.data.acts[0].clips[0].turn }; });
  expect(r.last === 86400 && r.turn > 1.6, `the page plays ${r.last} s of 86400, though a wheel turns by ${r.turn.toFixed(2)} rad between two frames`);
  expect(r.part < 43200, `control: the beginning, record by record, ends at ${r.part} s`);
  await page.close();
  const late = film(out("wheel"), "--from", "60000", "--size", "320x200", "--out", out("late.png"));
  expect(late.status === 0 && existsSync(out("late.png")), `a picture at 60000 s ${late.stderr}`);
  const beyond = film(out("wheel"), "--from", "90000", "--out", out("beyond.png"));
  expect(beyond.status === 2 && beyond.stderr.includes("expected a time of the run, 0 to 86400 s"), `control, after the end: ${beyond.stderr.trim()}`);
}

console.log("whole paths");
{
  const page = await open("arms"), fill = (round) => page.tab.evaluate((before) => {
    const s = porthos.stage;
    s.set("ride", "world");
    s.options.whole = true;
    s.look("iso");
    if (before) {  // the frame of a ball around the paths and the mechanism at their ends
      const path = s.ground.beside([], s.start).concat(s.trails.flatMap((l) => { const v = l.geometry.getAttribute("position"); return Array.from({ length: v.count }, (_, i) => s.start.clone().fromBufferAttribute(v, i)); }));
      const low = path.reduce((a, p) => a.min(p), path[0].clone()).min(s.start.clone().set(0, 0, 0)), high = path.reduce((a, p) => a.max(p), path[0].clone()).max(s.start.clone().set(0, 0, 0));
      const middle = low.clone().add(high).multiplyScalar(0.5);
      s.camera.position.sub(s.controls.target).setLength(2.8 * (high.distanceTo(low) / 2 + s.size)).add(middle);
      s.controls.target.copy(middle);
      s.controls.update();
    }
    s.camera.updateMatrixWorld();
    return Math.max(...s.shown().flatMap((p) => { p.project(s.camera); return [Math.abs(p.x), Math.abs(p.y)]; }));
  }, round);
  const now = await fill(false), before = await fill(true);
  expect(now > 0.8 && now < 1, `paths and mechanism reach ${now.toFixed(2)} of the half picture, 0.8 to 1 expected`);
  expect(before < 0.7, `control: framed as a ball around both, ${before.toFixed(2)}`);
  await page.close();
}
await browser.close();
finish();
