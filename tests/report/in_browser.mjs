// What tests of pages in a real browser share: their arguments, the browser, a scratch folder, and the count of failures.
// Exit code 77: something is missing, skipped.
import { spawnSync } from "node:child_process";
import { existsSync, mkdirSync, rmSync } from "node:fs";
import { createRequire } from "node:module";
import { join, resolve } from "node:path";

export const [cli, modules, source, work] = process.argv.slice(2).map((p) => resolve(p));
export const skip = (why) => { console.log(`skipped: ${why}`); process.exit(77); };
const browserPath = [process.env.PORTHOS_CHROMIUM, "/usr/bin/chromium", "/usr/bin/chromium-browser", "/usr/bin/google-chrome"].find((p) => p && existsSync(p));
if (!browserPath) skip("no Chromium (Debian: chromium)");
if (Number(process.versions.node.split(".")[0]) < 18) skip(`Node ${process.versions.node}, playwright-core needs 18`);
let playwright;
try { playwright = createRequire(join(modules, "package.json"))("playwright-core"); } catch { skip(`no playwright-core in ${modules}`); }

let failures = 0;
export function expect(ok, what) {
  console.log(`${ok ? "  ok  " : "  FAIL"} ${what}`);
  if (!ok) ++failures;
}
rmSync(work, { recursive: true, force: true });
mkdirSync(work, { recursive: true });
export const out = (name) => join(work, name);
export const film = (...words) => spawnSync(cli, ["film", ...words], { encoding: "utf8", env: { ...process.env, PORTHOS_CHROMIUM: browserPath } });
export const browser = await playwright.chromium.launch({ executablePath: browserPath, args: ["--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-compositing"] });
/** Ends the test. */
export function finish() {
  console.log(failures ? `${failures} FAILED` : "all as expected");
  process.exit(failures ? 1 : 0);
}
