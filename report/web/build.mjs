// node build.mjs WEB WORK PAGE: bundles WEB/src with the packages in WORK/node_modules into one html file, PAGE.
import { createRequire } from "node:module";
import { readFileSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const [web, work, page] = process.argv.slice(2);
const { build } = createRequire(join(work, "package.json"))("esbuild");
const bundle = async (entry, extra) =>
  (await build({
    entryPoints: [join(web, "src", entry)], bundle: true, write: false, minify: true, legalComments: "inline",
    nodePaths: [join(work, "node_modules")], logLevel: "warning", target: "es2022", ...extra,
  })).outputFiles[0].text;
const script = await bundle("main.js", { format: "iife" });
const style = await bundle("style.css", {});
const html = readFileSync(join(web, "src", "page.html"), "utf8")
  .replace("@STYLE@", () => style)
  .replace("@SCRIPT@", () => script.replaceAll("</script", "<\\/script"));
if (html.split("@PORTHOS_DATA@").length !== 2) throw new Error("the page needs @PORTHOS_DATA@ once");
writeFileSync(page, html);
