#!/usr/bin/env python3
"""The documentation as a site: build.py BUILD [--pages-only | --no-stills]

BUILD is a finished build of Porthos, e.g. build/native; the site goes to BUILD/docs/html. The Markdown files are taken as they
are and stay readable where they are; what a site needs besides is made here: the gallery, by running the examples, and
the API reference, from the headers. Every warning is an error, so a link to a page, a section or a file that is not
there fails. Nothing is fetched: links to other sites are listed and not followed. The reports of the gallery's examples
are part of the site; where there is a Chromium it takes a picture of each mechanism from them.
"""
import argparse
import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
ROOMS = ["phs", "mechanics", "integrators", "planning", "ensemble", "energy_shaping", "vsa", "space", "contact", "scene", "report"]
STUBS = ROOT / "python/porthos/_core"
MATHJAX = Path("/usr/share/javascript/mathjax")
MATHJAX_PARTS = ["MathJax.js", "config/TeX-AMS_SVG.js", "jax/input/TeX", "jax/element", "jax/output/SVG", "extensions"]

# Examples in the order of the gallery. Long ones are shown in part; their pages say what the whole run gives.
GALLERY = [
    ("Free floating", ["ets_vii", "ledger", "canadarm", "dzhanibekov"]),
    ("In orbit", ["ets_vii_orbit", "envisat_tumble", "flexible_panel"]),
    ("Events", ["capture", "deployment"]),
    ("Controllers", ["cart_pole_idapbc", "reaction_wheel", "acrobot", "space_arm_regulation", "attitude", "esp_arm"]),
    ("Actuators", ["vsa_cycle", "qbmove_arm", "throwing_arm", "dc_motor_arm"]),
    ("On the ground", ["double_pendulum", "box_of_balls"]),
]
SHORTENED = {"ets_vii_orbit": 500000, "envisat_tumble": 200000, "double_pendulum": 1000, "dzhanibekov": 20000}
CHROMIUM = next(filter(None, map(shutil.which, ["chromium", "chromium-browser", "google-chrome"])), None)
# Where the ledger is one plain area, another picture says more: arguments of porthos plot.
FIGURES = {"dzhanibekov": ["--what", "residual"], "capture": ["--what", "rates of base, own axes", "--to", "120"]}
PICTURES = ["figure.svg", "plot.svg", "panels.svg", "ledgers.svg", "ledger.svg", "energy_error.svg"]  # the first there is


def say(text):
    print(text, flush=True)


def stage(source):
    """The tree's Markdown in the tree's order, so that relative links hold."""
    shutil.rmtree(source, ignore_errors=True)
    for page in [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("docs/tutorials/*.md"), *ROOT.glob("examples/README.md"), *ROOT.glob("examples/*/README.md")]:
        copy = source / page.relative_to(ROOT)
        copy.parent.mkdir(parents=True, exist_ok=True)
        copy.write_text(site_links(page))
    shutil.copytree(ROOT / "docs/images", source / "docs/images")
    for name in ["conf.py", "index.md", "static", "themes"]:
        (shutil.copytree if (HERE / name).is_dir() else shutil.copy)(HERE / name, source / name)
    index = source / "index.md"
    index.write_text(index.read_text().replace("/api/rooms", "\n".join(f"/api/{room}" for room in rooms())))


def site_links(page):
    """Links to folders go to their README; links to files that are no pages go to the text of the file, as code."""
    outside = []

    def link(match):
        text, target, anchor = match[1], match[2], match[3] or ""
        if re.match(r"[a-z]+:", target):
            outside.append(target)
            return match[0]
        if not target:
            return match[0]
        there = (page.parent / target).resolve()
        if not there.exists():
            raise SystemExit(f"{page.relative_to(ROOT)}: link to '{target}', which is not there")
        if there.is_dir() and (there / "README.md").exists():
            return f"[{text}]({target.rstrip('/')}/README.md{anchor})"
        if there.is_dir() or there.suffix not in {".md", ".svg", ".png"}:
            return f"{text} (`{there.relative_to(ROOT)}`)" if "`" not in text else text
        return match[0]

    return re.sub(r"(?<!!)\[([^\]]*)\]\(([^)#\s]*)(#[^)\s]*)?\)", link, page.read_text())


def still(build, folder, picture):
    """The playback of a run in a picture, at two fifths of its time; false if its page has none. One colour is no picture."""
    if not CHROMIUM or "\"playback\":" not in (folder / "report.html").read_text():
        return False
    at = 0.4 * json.loads((folder / "summary.json").read_text())["simulated_s"]
    subprocess.run([build / "apps/porthos", "film", folder, "--from", str(at), "--size", "900x480", "--no-text", "--out", picture],
                   stdout=subprocess.DEVNULL, timeout=120, check=True, env={**os.environ, "PORTHOS_CHROMIUM": CHROMIUM})
    if plain(picture):
        raise SystemExit(f"{folder}: its playback at {at:g} s is a picture of one colour, expected a mechanism")
    return True


def plain(picture):
    from PIL import Image  # comes with matplotlib
    return all(low == high for low, high in Image.open(picture).convert("RGB").getextrema())


def gallery(build, docs, source, stills):
    """Runs the examples, and a page of their pictures. Their reports are kept for the site."""
    out, page = docs / "gallery", ["# Gallery", "", "Every picture is drawn by the example it belongs to, run when this site was built.", ""]
    pictures, live = source / "gallery", docs / "live"
    pictures.mkdir()
    shutil.rmtree(live, ignore_errors=True)
    live.mkdir(parents=True)
    for heading, names in GALLERY:
        page += [f"## {heading}", ""]
        for name in names:
            folder, example = out / name, ROOT / "examples" / name
            if not example.exists():
                continue
            if (example / "scene.toml").exists():
                command = [build / "apps/porthos", "run", example / "scene.toml", "--out", folder]
                command += ["--duration", str(SHORTENED[name])] if name in SHORTENED else []
            else:
                command = [build / "examples" / f"example_{name}", folder]
            shutil.rmtree(folder, ignore_errors=True)
            folder.mkdir(parents=True)
            say(f"gallery: {name}")
            done = subprocess.run(list(map(str, command)), stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, stdin=subprocess.DEVNULL)
            if done.returncode:
                raise SystemExit(f"gallery: example {name} ended with {done.returncode}\n{done.stdout}{done.stderr}")
            if name in FIGURES:
                subprocess.run([build / "apps/porthos", "plot", folder, *FIGURES[name], "--out", folder / "figure.svg"], stdout=subprocess.DEVNULL, check=True)
            picture = next((p for p in (folder / n for n in PICTURES) if p.exists()), None) or next(
                (p for n in PICTURES for p in sorted(folder.glob(f"*/{n}"))), None)
            if picture is None:
                raise SystemExit(f"gallery: example {name} drew no picture in {folder}")
            shutil.copy(picture, pictures / f"{name}.svg")
            report, whole, moving = folder / "report.html", "", ""
            if report.exists():
                shutil.copy(report, live / f"{name}.html")
                said = " ".join(str(c) for c in command[1:]).replace(f" --out {folder}", "").replace(f"{ROOT}/", "")
                whole = f'\n<p><a href="live/{name}.html">The whole report</a>, made by <code>porthos {said}</code></p>\n'
                if stills and still(build, folder, pictures / f"{name}.png"):
                    moving = f"![{title_of(example)} as it stands in its playback](gallery/{name}.png)\n"
            title = title_of(example)
            note = f"\nThe first {SHORTENED[name]:,} s of it.\n".replace(",", " ") if name in SHORTENED else ""
            page += [f"### [{title}](examples/{name}/README.md)", note, moving, f"![{title}](gallery/{name}.svg)", whole, ""]
    (source / "gallery.md").write_text("\n".join(page + examples_toctree()))


def title_of(example):
    return (example / "README.md").read_text().splitlines()[0].lstrip("# ")


def examples_toctree():
    pages = sorted(p.parent.name for p in ROOT.glob("examples/*/README.md"))
    return ["```{toctree}", ":hidden:", ""] + [f"/examples/{name}/README" for name in pages] + ["```", ""]


def rooms():
    return [r for r in ROOMS if (ROOT / r).is_dir()]


def api(docs, source):
    """Doxygen reads the headers, Breathe shows them: a page per room, a section per header."""
    doxygen = docs / "doxygen"
    doxygen.mkdir(parents=True, exist_ok=True)
    settings = {
        "PROJECT_NAME": "Porthos", "OUTPUT_DIRECTORY": doxygen, "GENERATE_XML": "YES", "GENERATE_HTML": "NO", "GENERATE_LATEX": "NO",
        "INPUT": " ".join(str(ROOT / r) for r in rooms()), "RECURSIVE": "YES", "FILE_PATTERNS": "*.h",
        "EXCLUDE_PATTERNS": "*-inl.h */joints/* */detail/*",
        "STRIP_FROM_PATH": ROOT, "QUIET": "YES", "WARN_IF_UNDOCUMENTED": "NO", "WARNINGS": "NO", "WARN_IF_DOC_ERROR": "NO", "WARN_IF_INCOMPLETE_DOC": "NO", "WARN_LOGFILE": "/dev/null", "XML_PROGRAMLISTING": "NO",
        "MACRO_EXPANSION": "YES", "EXPAND_ONLY_PREDEF": "YES", "PREDEFINED": "PORTHOS_INLINE=inline __extension__= PORTHOS_UNARY(name,quad,derivative)=", "SEARCH_INCLUDES": "NO", "JAVADOC_AUTOBRIEF": "YES", "MARKDOWN_SUPPORT": "YES",
    }
    say("API reference: doxygen")
    subprocess.run(["doxygen", "-"], input="\n".join(f"{k} = {v}" for k, v in settings.items()), text=True, check=True, stdout=subprocess.DEVNULL)
    folder = source / "api"
    folder.mkdir()
    table = {m[1]: m[2] for m in re.finditer(r"^\| `(\w+)/` \| [^|]+ \| ([^|]+) \|", (ROOT / "docs/architecture.md").read_text(), re.M)}
    for room in rooms():
        headers = sorted(h.relative_to(ROOT).as_posix() for h in (ROOT / room).rglob("*.h") if not h.name.endswith("-inl.h") and h.parent.name not in ("joints", "detail"))
        text = [f"# `{room}`", "", table.get(room, "").strip(), "", "Headers: " + ", ".join(f"`{h}`" for h in headers) + ".", "",
                "```{doxygennamespace} porthos::" + room, ":members:", ":content-only:", "```", ""]
        (folder / f"{room}.md").write_text("\n".join(text))


def python_api(folder):
    """What an editor reads of the Python package: its stubs, which a test holds against the module."""
    text = ["# Python", "", "Signatures and docstrings of `porthos`; [how to use it](/docs/python.md).", ""]
    for stub in sorted(STUBS.glob("*.pyi"), key=lambda s: s.name != "__init__.pyi"):
        name = "porthos" if stub.stem == "__init__" else f"porthos.{stub.stem}"
        shutil.copy(stub, folder / f"{stub.stem}.py.txt")
        text += [f"## `{name}`", "", "```{literalinclude} " + f"{stub.stem}.py.txt", ":language: python", "```", ""]
    (folder / "python.md").write_text("\n".join(text))


def main():
    try:
        import sphinx  # noqa: F401
    except ImportError:
        raise SystemExit(f"{sys.executable} has no Sphinx: ./dev setup installs Debian's, run this with /usr/bin/python3")
    arguments = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    arguments.add_argument("build", type=Path)
    arguments.add_argument("--pages-only", action="store_true", help="no gallery and no API reference: are the pages sound?")
    arguments.add_argument("--no-stills", action="store_true", help="no pictures of the mechanisms by a headless Chromium (4 s each)")
    options = arguments.parse_args()
    build = options.build.resolve()
    docs = build / ("docs_pages" if options.pages_only else "docs")
    source, html = docs / "source", docs / "html"
    stage(source)
    if options.pages_only:
        (source / "gallery.md").write_text("\n".join(["# Gallery", "", "Left out of this build.", ""] + examples_toctree()))
        (source / "api").mkdir()
        for room in rooms():
            (source / f"api/{room}.md").write_text(f"# `{room}`\n\nLeft out of this build.\n")
    else:
        gallery(build, docs, source, not options.no_stills)
        api(docs, source)
    python_api(source / "api")
    say("pages: sphinx")
    environment = {**os.environ, "PORTHOS_DOCS_BUILD": str(docs)}
    subprocess.run([sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", "-d", str(docs / "doctrees"), str(source), str(html)],
                   env=environment, check=True)
    index = (html / "index.html").read_text()  # its own HTML is not looked at by Sphinx
    dead = [to for to in re.findall(r'(?:href|src|srcset)="([\w/.-]+)[#"]', index) if not (html / to).exists()]
    if dead:
        raise SystemExit(f"docs/site/index.md: links to {', '.join(dead)}, which is not there")
    if not options.pages_only:
        shutil.copytree(docs / "live", html / "live", dirs_exist_ok=True)
    if MATHJAX.is_dir():
        for part in MATHJAX_PARTS:
            here, there = MATHJAX / part, html / "_static/mathjax" / part
            there.parent.mkdir(parents=True, exist_ok=True)
            (shutil.copytree(here, there, dirs_exist_ok=True) if here.is_dir() else shutil.copy(here, there))
    say(f"site: {html / 'index.html'}")


if __name__ == "__main__":
    main()
