#!/usr/bin/env python3
"""Every class, enum and function of a public header has a comment; one of a function names the arrays it takes.
Every path in CONTRIBUTING.md exists.

    check_docs.py ROOT          print every offence as file:line: reason; exit 1 if any
    check_docs.py --self-test   negative control: each rule must catch a header that breaks it

What stands at namespace level is looked at, as clang-format leaves it: nothing indented. A comment serves all declarations up to
the next blank line. A path is what stands in backticks with a slash or the ending of a source; it may leave out the folders before it.
"""
import os
import re
import sys
import tempfile
from fnmatch import fnmatch
from pathlib import Path

from check_includes import LIBRARIES, is_private, main

# The elementary functions and operators of every scalar: their names are those of the standard library.
ELEMENTARY = ["phs/scalars/pack.h", "phs/scalars/quad.h", "phs/scalars/scalar.h", "phs/scalars/trig.h"]

OPENS = re.compile(r"(template <|requires\b|\[\[)")
TYPE = re.compile(r"(class|struct|enum)\b")
# A family's entries are explained in integrators/catalogue.h; a member has its comment in the class.
KNOWN = re.compile(r".*(\w+_entries\(\);|\w::\w+\()")
PASSED = re.compile(r"(namespace|using|extern|static_assert|typedef|concept|constexpr|inline constexpr|PORTHOS_)")
PATH = re.compile(r"`([\w.][\w.*/-]*/[\w.*/-]*|\w[\w*-]*\.(?:cpp|h|js|mjs|py|md|txt|\*))`")
ARRAY = re.compile(r"std::span<[^()]*?>\s+(\w+)\s*(?=[,)=])")


def declarations(lines):
    """Line number, text and comment of each declaration at namespace level."""
    comment, shared, i = [], "", 0
    while i < len(lines):
        line, number = lines[i], i + 1
        i += 1
        if line.startswith("///"):
            comment.append(line[3:].strip())
        elif not line or line[0] == "#":
            comment, shared = [], ""
        elif line[0] in " \t/}" or OPENS.match(line) and not re.search(r"[;{]$", line):
            continue
        else:
            while not re.search(r"[;{}]\s*(//.*)?$", line) and i < len(lines):
                line += " " + lines[i].strip()
                i += 1
            shared, comment = " ".join(comment) or shared, []
            line = re.sub(r"^template <.*?> (?=class|struct)", "", line)
            if not PASSED.match(line) and not KNOWN.match(line) and not re.fullmatch(r"(class|struct) \w+;", line):
                yield number, line, shared


def endings(root):
    """The paths of all files and folders, each also without the folders before it."""
    for folder, folders, files in os.walk(root):
        folders[:] = [name for name in folders if name not in ("build", ".git", "node_modules")]
        parts = Path(folder).relative_to(root).parts
        for name in [*files, *folders]:
            path = [*parts, name]
            yield from ("/".join(path[i:]) for i in range(len(path)))


def unknown_paths(root):
    known = set(endings(root))
    for number, line in enumerate((root / "CONTRIBUTING.md").read_text(encoding="utf-8").splitlines(), 1):
        for path in PATH.findall(line):
            name = path.rstrip("/")
            if name not in known and not ("*" in name and any(fnmatch(one, name) for one in known)):
                yield f"CONTRIBUTING.md:{number}: there is no {path}"


def offences(root):
    yield from unknown_paths(root)
    for room in LIBRARIES:
        for file in sorted((root / room).rglob("*.h")):
            path = file.relative_to(root).as_posix()
            if is_private(path) or path in ELEMENTARY:
                continue
            for number, text, comment in declarations(file.read_text(encoding="utf-8").splitlines()):
                name = re.search(r"(\w+|operator.{1,3})\(" if not TYPE.match(text) else r"(\w+)\W*[{:]?[^{]*$", text)
                if not comment and "///<" not in text:
                    yield f"{path}:{number}: '{text[:60]}' has no comment"
                elif name and not TYPE.match(text):
                    for array in ARRAY.findall(text):
                        if not re.search(rf"\b{array}\b", comment):
                            yield f"{path}:{number}: the comment of {name[1]}() says nothing of the array {array}"


def self_test():
    good = """#pragma once
#include <span>
namespace porthos::phs {
class Later;

/// y = A x. @param x size n
template <class T>
void product(std::span<const double> A, std::span<const T> x,
             std::span<T> y);
/// Two numbers.
struct Pair {
  double a, b;
};
}  // namespace porthos::phs
"""
    bad = {
        "struct Bare {\n": "'struct Bare {' has no comment",
        "void bare(int n);\n": "'void bare(int n);' has no comment",
        "template <class T>\nT bare(T x) {\n": "'T bare(T x) {' has no comment",
        "/// A sum.\ndouble sum(std::span<const double> terms);\n": "the comment of sum() says nothing of the array terms",
    }

    page = "`phs/`, `phs/a.h`, `a.h`, `a.*`; no paths: `.h`, `a/ b`, `phs/<name>`, `-DX=1`. "
    bad_pages = {f"`{path}`": f"CONTRIBUTING.md:1: there is no {path}" for path in ("b.h", "phs/b.*", "mechanics/", "hs/a.h")}

    def report(text, page):
        with tempfile.TemporaryDirectory() as root:
            file = Path(root, "phs/a.h")
            file.parent.mkdir()
            file.write_text(text, encoding="utf-8")
            Path(root, "CONTRIBUTING.md").write_text(page, encoding="utf-8")
            return list(offences(Path(root)))

    failures = [f"what is good was refused: {line}" for line in report(good, page)]
    cases = [(text, words, report(good + "\n" + text, page)) for text, words in bad.items()]
    cases += [(text, words, report(good, page + text)) for text, words in bad_pages.items()]
    for text, words, found in cases:
        if len(found) != 1 or words not in found[0]:
            failures.append(f"{text!r}: expected one report with {words!r}, got {found}")
    print("\n".join(failures) or f"self-test: the good header and page pass, {len(cases)} bad ones are caught")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:], __doc__, offences, self_test, "every public declaration has a comment, every path exists"))
