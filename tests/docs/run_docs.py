#!/usr/bin/env python3
"""Runs the code of the documentation as a reader would: run_docs.py BUILD PAGE...

What a block is for stands behind its language, where no reader sees it:

    toml file=arm.toml     is written to that file (any language)
    console                lines that begin with "$ " are run; "# exits with N" at the end of a line expects N, else 0 is expected
    cpp check              compiles
    cpp part               goes before the next `cpp run` or `cpp check` of the page
    cpp run                compiles with the parts before it, links, runs and returns 0
    text printed           each of its lines is printed by the command before it, with these numbers, to 1e-6; those with an exponent within a
                           factor of 3, and rounding errors, which differ between instruction sets, within one of 10
    toml of=scene.toml     each of its lines is one of that file of the tree, but for comments and spaces

A page runs in a folder of its own, where `porthos` is the command of BUILD and examples/ and docs/ are those of the tree.
Blocks without such a word are not looked at; --list counts them. --self-test shows that each kind can fail.
"""
import os
import re
import shlex
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
NUMBER = re.compile(r"[-+]?(?:\d{1,3}(?: \d{3})+(?!\d)|\d+)(?:\.\d+)?(?:e[-+]?\d+)?|\bnan\b|\binf\b")
ROUNDING = 1e-12
FENCE = re.compile(r"^```(\w+)[ \t]*([^\n]*)\n(.*?)^```$", re.M | re.S)


class Wrong(Exception):
    pass


def line_of(text, position):
    return text.count("\n", 0, position) + 1


def shape(line):
    """A line without its numbers and spacing."""
    return " ".join(NUMBER.sub("#", line).split())


def same(stated, printed):
    """Whether two numbers are the same, as far as they have to be."""
    a, b = (float(x.replace(" ", "")) for x in (stated, printed))
    if stated == printed or abs(a - b) <= 1e-6 * max(abs(a), abs(b)):
        return True
    factor = 10 if max(abs(a), abs(b)) < ROUNDING else 3
    return ("e" in stated or "e" in printed) and a * b > 0 and 1 / factor < a / b < factor


def agree(stated, printed):
    """Whether a line of a page is one that was printed."""
    return shape(stated) == shape(printed) and all(map(same, NUMBER.findall(stated), NUMBER.findall(printed)))


def entry(line):
    """A line of TOML without its comment and spaces; "": there is nothing else."""
    return " ".join(re.sub(r"(^|\s)#.*", "", line).split())


class Page:
    def __init__(self, build, folder, compiler):
        self.build, self.folder, self.compiler = build, folder, compiler
        self.parts, self.printed = [], ""
        for name in ["examples", "docs"]:
            (folder / name).symlink_to(ROOT / name)

    def run(self, command, expected):
        path = f"{self.build / 'apps'}:{os.environ['PATH']}"
        done = subprocess.run(["bash", "-c", command], cwd=self.folder, env={**os.environ, "PATH": path}, stdin=subprocess.DEVNULL,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=600)
        self.printed = done.stdout
        if done.returncode != expected:
            raise Wrong(f"'{command}' ended with {done.returncode}, expected {expected}\n{done.stdout}")

    def console(self, text):
        for line in text.splitlines():
            if line.startswith("$ "):
                expected = re.search(r"# exits with (\d+)$", line)
                self.run(line[2:], int(expected[1]) if expected else 0)

    def cpp(self, text, link):
        source = self.folder / "program.cpp"
        source.write_text("\n".join(self.parts + [text]))
        self.parts = []
        compile_, libraries = self.compiler
        command = [*compile_, "-c" if not link else "-O1", str(source), "-o", str(self.folder / "program"), *(libraries if link else ["-fsyntax-only"])]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise Wrong(f"does not compile\n{done.stderr}")
        if link:
            self.run("./program", 0)

    def block(self, language, words, text):
        file = re.search(r"\bfile=(\S+)", words)
        if file:
            (self.folder / file[1]).write_text(text)
        elif of := re.search(r"\bof=(\S+)", words):
            known = set(map(entry, (ROOT / of[1]).read_text().splitlines())) | {""}
            for line in text.splitlines():
                if entry(line) not in known:
                    raise Wrong(f"'{line}' is no line of {of[1]}")
        elif language == "console":
            self.console(text)
        elif language == "cpp" and "part" in words:
            self.parts.append(text)
        elif language == "cpp" and words in ("run", "check"):
            self.cpp(text, words == "run")
        elif language == "text" and "printed" in words:
            for line in text.splitlines():
                if line.strip() not in ("", "...") and not any(agree(line, l) for l in self.printed.splitlines()):
                    raise Wrong(f"'{line}' was not printed by the command before; this was:\n{self.printed}")
        else:
            return False
        return True


def run_page(build, page, compiler, text=None):
    text = text if text is not None else page.read_text()
    count = other = 0
    with tempfile.TemporaryDirectory() as folder:
        state = Page(build, Path(folder), compiler)
        for match in FENCE.finditer(text):
            try:
                done = state.block(match[1], match[2].strip(), match[3])
            except Wrong as wrong:
                raise Wrong(f"{page}:{line_of(text, match.start())}: {wrong}") from None
            count, other = count + done, other + (not done)
    return count, other


def flags(build):
    """Compiler and flags of a program beside the build, from what an installed Porthos says of itself."""
    pc = dict(re.findall(r"^(\w+)[:=] *(.*)$", (build / "porthos.pc").read_text(), re.M))
    cflags = [f for f in shlex.split(pc["Cflags"]) if not f.startswith("-I")]
    rooms = re.findall(r"-lporthos_(\w+)", pc["Libs"])
    archives = [str(build / room / f"libporthos_{room}.a") for room in rooms]
    rest = [f for f in shlex.split(pc["Libs"] + " " + pc.get("Libs.private", "")) if not f.startswith(("-lporthos_", "-L$"))]
    needed = [r for r in shlex.split(pc.get("Requires", "") + " " + pc.get("Requires.private", "").replace(",", " ")) if re.match(r"[A-Za-z]", r)]
    if needed:
        rest += shlex.split(subprocess.run(["pkg-config", "--libs", *needed], capture_output=True, text=True, check=True).stdout)
    return [os.environ.get("CXX", "c++"), "-std=c++20", *cflags, f"-I{ROOT}"], [*archives, *rest]


WRONG = [("1.25", "1.26"), ("16", "17"), ("2e-07", "7e-07"), ("2e-07", "-2e-07"), ("1e-15", "2e-14"), ("10 000", "20 000"), ("0", "1e-3"), ("8  9.5", "8  9.4"), ("1.00001", "1.00002")]
RIGHT = [("1.25", "1.250"), ("1.00000001", "1.00000002"), ("2e-07", "5e-07"), ("1e-15", "7e-15"), ("10 000", "10 000"), ("nan", "nan"), ("8  9.5", "8 9.5")]


def self_test(build, compiler):
    wrong = {
        "a command that fails": "```console\n$ porthos run nothing.toml\n```\n",
        "a command that does not fail": "```console\n$ porthos methods # exits with 1\n```\n",
        "a program that does not compile": "```cpp check\nint main() { return x; }\n```\n",
        "a program that fails": "```cpp run\nint main() { return 1; }\n```\n",
        "an output that is not printed": "```console\n$ echo one 1\n```\n```text printed\ntwo 2\n```\n",
        **{f"{a} printed as {b}": f"```console\n$ echo value {b} m\n```\n```text printed\nvalue {a} m\n```\n" for a, b in WRONG},
        "a line of no scene": "```toml of=examples/ets_vii_orbit/scene.toml\n[orbit]\naltitude = 560e3\n```\n",
    }
    right = [f"```console\n$ echo value {b} m\n```\n```text printed\nvalue   {a}   m\n```\n" for a, b in RIGHT]
    right += ["```toml of=examples/ets_vii_orbit/scene.toml\n[orbit]   # a circle\n\naltitude   = 550e3\n```\n"]
    for text in right:
        run_page(build, Path("self-test"), compiler, text)
    for what, text in wrong.items():
        try:
            run_page(build, Path("self-test"), compiler, text)
        except Wrong:
            continue
        raise SystemExit(f"not found: {what}")
    print(f"self-test: {len(wrong)} faults found")


def main():
    build, *rest = sys.argv[1:]
    build = Path(build).resolve()
    compiler = flags(build)
    if rest == ["--self-test"]:
        return self_test(build, compiler)
    for page in rest:
        try:
            count, other = run_page(build, Path(page), compiler)
        except Wrong as wrong:
            raise SystemExit(str(wrong))
        print(f"{page}: {count} blocks run or checked, {other} others")


if __name__ == "__main__":
    main()
