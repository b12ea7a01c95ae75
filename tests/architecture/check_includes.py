#!/usr/bin/env python3
"""Keeps the doors between the rooms: who includes whom, what public headers show, how long files and functions are,
which rooms clang-tidy looks at.

    check_includes.py ROOT          print every offence as file:line: reason; exit 1 if any
    check_includes.py --self-test   negative control: each rule must catch a tree that breaks it
"""
import re
import sys
import tempfile
from pathlib import Path

# Room -> the rooms right below it. A room may include itself and everything it reaches downwards.
BELOW = {
    "phs": [],
    "mechanics": ["phs"],
    "integrators": ["phs"],
    "planning": ["mechanics", "integrators"],
    "ensemble": ["integrators"],
    "adapters": ["scene"],
    "energy_shaping": ["mechanics", "integrators"],
    "vsa": ["mechanics"],
    "space": ["mechanics", "integrators"],
    "contact": ["mechanics", "integrators"],
    "scene": ["contact", "space", "energy_shaping", "vsa", "ensemble", "planning"],
    "report": ["scene"],
    "apps": ["report", "adapters"],
    "python": ["report", "ensemble"],
}
# Folders of a room, lowest first: a file includes its own folder and those before it. "." are the files beside the folders.
FOLDERS = {
    "phs": [".", "scalars", "linear_algebra", "functions", "system", "linear", "network"],
    "integrators": ["core", "implicit", "tables", "methods", "derivatives", "rivals", ".", "control"],
    "energy_shaping": [".", "loop", "laws", "matching", "elastic", "certify"],
    "scene": ["files", "read", "assemble", "run", "plot", "compare", "session", "judge", "ensemble", "plan", "sensitivity", "identification"],
}
LIBRARIES = ["phs", "mechanics", "integrators", "planning", "ensemble", "energy_shaping", "vsa", "space", "contact", "scene", "report"]
ANYTHING_GOES = ["tests", "bench", "examples"]

INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
STANDARD = re.compile(r"[a-z0-9_]+")  # <vector>, <cmath>; nothing standard in C++ ends in .h
COMPILER = ["immintrin.h"]  # part of GCC and Clang, not a dependency


def reach(room):
    return {room}.union(*(reach(lower) for lower in BELOW[room]))


def line_cap(path):
    """The longest a file may be, and what kind of file that is. `path` is relative to the root."""
    if path.parts[0] == "tests":
        return 500, "test"
    if path.suffix != ".h" or path.name.endswith("-inl.h"):
        return 350, "source"
    if path.parts[:2] == ("mechanics", "joints"):
        return 150, "joint header"
    return 350, "public header"


def folder_of(path):
    """The folder of a room that a file lies in, or "." for one beside the folders."""
    return path.parts[1] if len(path.parts) > 2 else "."


def folder_offence(path, target):
    """Why a file of a room must not include another of the same room, or None."""
    order = FOLDERS.get(path.parts[0], [])
    mine, theirs = folder_of(path), folder_of(Path(target))
    if mine not in order or theirs not in order:
        return None  # what is generated lies beside the folders
    if order.index(theirs) > order.index(mine):
        return f"{path.parts[0]}/{mine}/ must not include {path.parts[0]}/{theirs}/ ({target})"
    return None


def is_private(name):
    """Whether a header is not installed: it lies in a folder `detail` or defines what another declares."""
    return "/detail/" in name or name.endswith("-inl.h")


def include_offence(path, mark, target):
    """Why the file at `path` must not include `target`, or None."""
    room, first = path.parts[0], target.split("/")[0]
    if room in ANYTHING_GOES:
        return None
    if first in BELOW or first in ANYTHING_GOES:
        if first not in reach(room):
            return f"{room}/ must not include {first}/ ({target})"
        if first == room and (reason := folder_offence(path, target)):
            return reason
        if first != room and "/detail/" in target:
            return f"{target} is private to {first}/"
    elif mark == '"':
        return f'"{target}" does not start at the repository root'
    if room in LIBRARIES and path.suffix == ".h" and not is_private(path.as_posix()):
        if is_private(target):
            return f"a public header must not include a private one ({target})"
        known = first == "Eigen" or target in COMPILER or STANDARD.fullmatch(target)
        if mark == "<" and not known:
            return f"a public header includes std and Eigen only, not <{target}>"
    return None


NO_FUNCTION = re.compile(r"namespace|struct|class|enum|union|extern|template|constexpr [^(]*= *\{|[}#/]")
LONGEST_FUNCTION = 80  # of its body's lines, as in .clang-tidy
RAW_STRING = re.compile(r'\bR"(\w*)\(')


def raw_end(line, end):
    """What ends the raw string that is open after a line, or None. `end`: the same before the line."""
    while True:
        if end:
            _, found, line = line.partition(end)
            if not found:
                return end
        opens = RAW_STRING.search(line)
        if not opens:
            return None
        end, line = f'){opens[1]}"', line[opens.end():]


def long_functions(lines):
    """(line, length) of each function that is too long. It counts on clang-format: a body ends with a brace at the margin."""
    start = signature = raw = None
    for number, line in enumerate(lines, 1):
        inside, raw = raw, raw_end(line, raw)
        if inside:
            continue  # the text of a raw string stands at the margin
        if line == "}" and start:
            if number - start > LONGEST_FUNCTION and "readability-function-size" not in lines[start - 2]:
                yield start, number - start
            start = None
        elif line and not line[0].isspace():
            opens = not NO_FUNCTION.match(line) and "(" in line
            start = number if opens and line.endswith("{") else None
            signature = number if opens and not line.endswith(("{", ";")) else None
        elif signature and line.endswith("{"):
            start, signature = signature, None


def unfiltered(root):
    """The rooms whose findings clang-tidy would not show: it looks at sources as parts of unity files."""
    lines = (root / ".clang-tidy").read_text(encoding="utf-8").splitlines()
    number, line = next((n, line) for n, line in enumerate(lines, 1) if line.startswith("HeaderFilterRegex:"))
    shown = re.compile(line.split("'")[1])
    for room in BELOW:
        if not shown.search(f"/{room}/a.cpp"):
            yield f".clang-tidy:{number}: HeaderFilterRegex leaves out {room}/"


def offences(root):
    yield from unfiltered(root)
    files = [p for room in [*BELOW, *ANYTHING_GOES] for p in sorted((root / room).rglob("*"))]
    for file in files:
        if file.suffix not in (".h", ".cpp") or not file.is_file():
            continue
        path = file.relative_to(root)
        if folder_of(path) not in FOLDERS.get(path.parts[0], [folder_of(path)]):
            yield f"{path}:1: lies in none of {path.parts[0]}/{{{', '.join(FOLDERS[path.parts[0]])}}}"
        lines = file.read_text(encoding="utf-8").splitlines()
        for number, line in enumerate(lines, 1):
            if len(line) > 100 and line.lstrip().startswith("//"):
                yield f"{path}:{number}: a comment has at most 100 columns"
            if found := INCLUDE.match(line):
                if reason := include_offence(path, *found.groups()):
                    yield f"{path}:{number}: {reason}"
        if path.parts[0] in BELOW and path.suffix == ".cpp":
            for number, length in long_functions(lines):
                yield f"{path}:{number}: a function of {length} lines, at most {LONGEST_FUNCTION}"
        cap, kind = line_cap(path)
        if len(lines) > cap:
            yield f"{path}:{len(lines)}: a {kind} has at most {cap} lines"


def self_test():
    tidy = "Checks: >\nHeaderFilterRegex: '/(%s)/.*\\.(h|cpp)$'\n"
    good = {
        ".clang-tidy": tidy % "|".join(BELOW),
        "phs/a.h": "#include <vector>\n#include <Eigen/Core>\n#include <immintrin.h>\n",
        "phs/b.h": "#include \"phs/a.h\"\n",
        "phs/a-inl.h": "#include \"phs/a.h\"\n",
        "phs/network/detail/d.h": "#include <nlohmann/json.hpp>\n",
        "phs/f.cpp": "void f(int a,\n       int b) {\n" + "  a;\n" * 78 + "}\n",
        "phs/a.cpp": "#include <quadmath.h>\n#include \"phs/a-inl.h\"\n",
        "mechanics/joints/j.h": "#include \"phs/a.h\"\n" + "\n" * 149,
        "vsa/v.h": "#include \"mechanics/joints/j.h\"\n#include \"phs/a.h\"\n",
        "scene/files/s.cpp": "#include <hdf5.h>\n#include \"vsa/v.h\"\n#include \"integrators/i.h\"\n",
        "scene/run/r.cpp": "#include \"scene/read/r.h\"\n#include \"scene/build_info.h\"\n",
        "apps/main.cpp": "#include <CLI/CLI.hpp>\n#include \"scene/s.h\"\n",
        "tests/phs/t.cpp": "#include \"scene/s.h\"\n#include \"phs/a-inl.h\"\n",
    }
    bad = {  # one file each, added to the good tree or in place of its own, and words its report must have
        ".clang-tidy": (tidy % "|".join(room for room in BELOW if room != "contact"), "leaves out contact/"),
        "phs/x.h": ('#include "mechanics/m.h"\n', "phs/ must not include mechanics/"),
        "mechanics/x.cpp": ('  #  include "integrators/i.h"\n', "mechanics/ must not include integrators"),
        "integrators/core/x.h": ('#include "integrators/c.h"\n', "integrators/core/ must not include integrators/./"),
        "integrators/x.h": ("#include <mechanics/m.h>\n", "integrators/ must not include mechanics/"),
        "vsa/x.h": ('#include "energy_shaping/e.h"\n', "vsa/ must not include energy_shaping/"),
        "scene/run/x.cpp": ('#include "apps/main.h"\n', "scene/ must not include apps/"),
        "phs/y.cpp": ('#include "tests/helper.h"\n', "phs/ must not include tests/"),
        "phs/z.cpp": ('#include "z.h"\n', "does not start at the repository root"),
        "phs/q.h": ("#include <quadmath.h>\n", "std and Eigen only, not <quadmath.h>"),
        "scene/read/x.cpp": ('#include "scene/run/r.h"\n', "scene/read/ must not include scene/run/"),
        "phs/scalars/x.h": ('#include "phs/system/s.h"\n', "phs/scalars/ must not include phs/system/"),
        "phs/u.h": ('#include "phs/scalars/s.h"\n', "phs/./ must not include phs/scalars/"),
        "scene/loose.h": ("", "lies in none of scene/{files, read,"),
        "scene/read/t.h": ("#include <toml++/toml.h>\n", "std and Eigen only, not <toml++/toml.h>"),
        "phs/i.h": ('#include "phs/a-inl.h"\n', "must not include a private one"),
        "phs/network/d.h": ('#include "phs/network/detail/d.h"\n', "must not include a private one"),
        "vsa/d.cpp": ('#include "phs/network/detail/d.h"\n', "phs/network/detail/d.h is private to phs/"),
        "phs/wide.h": ("// " + 98 * "x" + "\n", "a comment has at most 100 columns"),
        "phs/long.h": ("\n" * 351, "a public header has at most 350 lines"),
        "phs/long.cpp": ("\n" * 351, "a source has at most 350 lines"),
        "phs/function.cpp": ("\nvoid f(int a,\n       int b) {\n" + "  a;\n" * 79 + "}\n", "a function of 81 lines"),
        "phs/raw.cpp": ("\nvoid f() {\n" + 27 * '  a(R"x(Of\ntwo (2)")x", R"(and\nmore)");\n' + "}\n", "a function of 82 lines"),
        "mechanics/joints/long.h": ("\n" * 151, "a joint header has at most 150 lines"),
        "tests/phs/long.cpp": ("\n" * 501, "a test has at most 500 lines"),
    }

    def report(tree):
        with tempfile.TemporaryDirectory() as root:
            for name, text in tree.items():
                file = Path(root, name)
                file.parent.mkdir(parents=True, exist_ok=True)
                file.write_text(text, encoding="utf-8")
            return list(offences(Path(root)))

    failures = [f"the good tree was refused: {line}" for line in report(good)]
    for name, (text, words) in bad.items():
        found = report(good | {name: text})
        if len(found) != 1 or not found[0].startswith(name) or words not in found[0]:
            failures.append(f"{name}: expected one report with '{words}', got {found}")
    print("\n".join(failures) or f"self-test: the good tree passes, {len(bad)} bad ones are caught")
    return 1 if failures else 0


def main(arguments, usage, offences, self_test, clean):
    """What a check of the sources does with its arguments: the exit code. `clean` is printed where there is no offence."""
    if arguments == ["--self-test"]:
        return self_test()
    if len(arguments) != 1:
        print(usage, file=sys.stderr)
        return 2
    found = list(offences(Path(arguments[0])))
    print("\n".join(found) or clean)
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], __doc__, offences, self_test, "includes and lengths: as architecture says"))
