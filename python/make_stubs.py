"""Writes the type stubs of the compiled module from its docstrings.

    python3 make_stubs.py FOLDER [--check]     FOLDER: python/porthos in the sources; --check: compare, write nothing

pybind11 puts a signature in front of every docstring; that is all this reads. A constructor that takes the members of a
struct as keywords is written with those keywords. Run it with the module on PYTHONPATH.
"""
import enum
import inspect
import re
import sys
from pathlib import Path

sys.path = [p for p in sys.path if Path(p or ".").resolve() != Path(__file__).resolve().parent]  # the sources have no _core

from porthos import _core  # noqa: E402
from porthos.arguments import split  # noqa: E402

HEAD = '''"""{doc}"""
# Written by python/make_stubs.py: do not edit.
import typing
from typing import Any, Callable, Optional

import numpy
from numpy.typing import NDArray
{more}
'''
SIGNATURE = re.compile(r"^(?:\d+\. )?(\w+)\((.*)\) -> (.+)$")
ARRAYS = {"float64": "NDArray[numpy.float64]", "int64": "NDArray[numpy.int64]", "longdouble": "NDArray[numpy.longdouble]"}


def type_of(text):
    """A type as pybind11 writes it, as Python does."""
    text = re.sub(r"porthos\._core\.(energy_shaping|vsa)\.", "", text) if "_core" in text else text
    text = text.replace("porthos._core.", "")
    text = re.sub(r"numpy\.ndarray\[numpy\.(\w+)\]", lambda m: ARRAYS.get(m[1], "NDArray[Any]"), text)
    text = re.sub(r"numpy\.ndarray\b(?!\[)", "NDArray[Any]", text)
    text = re.sub(r"\bobject\b", "Any", text)
    text = re.sub(r"\bfunction\b", "Callable[..., Any]", text)
    text = re.sub(r"\bfloat\[\d+\]", "float", text)  # of a std::array
    text = re.sub(r"Annotated\[([^,\]]+(?:\[[^\]]*\])?), [^\]]*\]", r"\1", text)
    for old, new in {"List[": "list[", "Dict[": "dict[", "Tuple[": "tuple[", "buffer": "Any", "iterable": "Any"}.items():
        text = text.replace(old, new)
    return re.sub(r"\b(handle|array)\b", "Any", text)


ARRAY = "NDArray[numpy.float64]"


def argument(text, arrays=False, pair=False):
    """arrays: what pybind11 calls an object is an array, checked by the function itself; pair: `out` is two of them."""
    if text.startswith("*") or ":" not in text:
        return text
    name, rest = text.split(":", 1)
    kind, _, default = rest.partition(" = ")
    kind = type_of(kind.strip())
    if name == "self":
        return "self"
    if arrays and kind == "Any":
        kind = f"tuple[{ARRAY}, {ARRAY}]" if pair and name == "out" else ARRAY
    if not default:
        return f"{name}: {kind}"
    if default == "None":
        kind = kind if kind == "Any" or kind.startswith("Optional") else f"Optional[{kind}]"
    plain = re.fullmatch(r"None|True|False|-?[\d.e+-]+|'[^']*'|\[\]|\{\}|\([^<>]*\)", default)
    return f"{name}: {kind} = {default if plain else '...'}"


def quoted(doc, indent):
    doc = inspect.cleandoc(doc)
    if not doc:
        return ""
    doc = doc.replace("\\", "\\\\").replace('"""', "'''")
    if "\n" in doc:
        doc += "\n"
    return "\n".join(indent + line if line else "" for line in f'"""{doc}"""'.split("\n")) + "\n"


def signatures(doc):
    """(name, arguments, result, text) of each overload of a function."""
    lines = (doc or "").splitlines()
    if not lines:
        return []
    if len(lines) > 1 and lines[1].strip() == "Overloaded function.":
        blocks = re.split(r"\n(?=\d+\. \w+\()", "\n".join(lines[2:]).strip())
    else:
        blocks = ["\n".join(lines)]
    found = []
    for b in blocks:
        head, _, text = b.partition("\n")
        if m := SIGNATURE.match(head):
            found.append((m[1], m[2], m[3], text.strip("\n")))
    return found


def function(doc, indent="", members=None, static=False, arrays=False):
    out = []
    all = signatures(doc)
    for name, arguments, result, text in all:
        parts = split(arguments)
        arrays = arrays or (bool(parts) and parts[0].startswith("mechanism:"))
        pair = arrays and result == "tuple"
        if pair:
            result = f"tuple[{ARRAY}, {ARRAY}]"
        elif arrays and result == "object":
            result = f"typing.Union[float, {ARRAY}]"
        a = [argument(t, arrays, pair) for t in parts]
        if members is not None and any(t.startswith("**") for t in a):
            a = [t for t in a if not t.startswith("**")] + ["*"] + [f"{n}: {t} = ..." for n, t in members] if members else a
        if len(all) > 1:
            out.append(f"{indent}@typing.overload\n")
        if static:
            out.append(f"{indent}@staticmethod\n")
        body = quoted(text, indent + "    ")
        out.append(f"{indent}def {name}({', '.join(a)}) -> {type_of(result)}:" + (f"\n{body}{indent}    ...\n" if body else " ...\n"))
    return "".join(out)


def property_type(p):
    doc = p.fget.__doc__ or ""
    found = re.search(r"-> (.+)", doc.split("\n")[0])
    return type_of(found[1]) if found else "Any"


def enumeration(cls):
    out = [f"class {cls.__name__}:\n", quoted(re.split(r"\n*Members:", cls.__doc__ or "")[0], "    ")]
    out += [f"    {name}: typing.ClassVar[{cls.__name__}]\n" for name in cls.__members__]
    out += ["    @property\n    def name(self) -> str: ...\n    @property\n    def value(self) -> int: ...\n",
            "    def __init__(self, value: int) -> None: ...\n"]
    return "".join(out)


def class_(cls, indent=""):
    if hasattr(cls, "__members__"):
        return "".join(indent + line + "\n" if line else "\n" for line in enumeration(cls).rstrip("\n").split("\n"))
    bases = [b.__name__ for b in cls.__bases__ if b.__name__ not in ("pybind11_object", "object")]
    out = [f"{indent}class {cls.__name__}{'(' + ', '.join(bases) + ')' if bases else ''}:\n"]
    inner = indent + "    "
    out.append(quoted(cls.__doc__ or "", inner))
    own = {n: v for n, v in vars(cls).items()}
    members = [(n, property_type(p).replace("tuple", "typing.Sequence[float]")) for n, p in own.items() if isinstance(p, property) and p.fset]
    empty = len(out)
    for name, value in own.items():
        if isinstance(value, type):
            out.append(class_(value, inner))
        elif isinstance(value, property):
            out.append(f"{inner}@property\n{inner}def {name}(self) -> {property_type(value)}:")
            doc = value.__doc__ or ""
            out.append(f"\n{quoted(doc, inner + '    ')}{inner}    ...\n" if doc else " ...\n")
            if value.fset:
                out.append(f"{inner}@{name}.setter\n{inner}def {name}(self, value: {property_type(value)}) -> None: ...\n")
        elif name == "__init__" or not name.startswith("_") or name in ("__call__", "__bool__", "__str__", "__neg__", "__float__", "__abs__") \
                or re.fullmatch(r"__r?(add|sub|mul|truediv|pow)__|__(lt|gt|le|ge)__", name):
            doc = getattr(cls, name).__doc__
            out.append(function(doc, inner, members, isinstance(value, staticmethod), cls.__name__ == "System"))
    if len(out) == empty:
        out.append(f"{inner}...\n")
    return "".join(out)


def module(m, more):
    out = [HEAD.format(doc=m.__doc__, more=more)]
    classes = [v for v in vars(m).values() if isinstance(v, type)]
    for c in classes:
        if issubclass(c, Exception):
            out.append(f"\nclass {c.__name__}({c.__base__.__name__}):\n{quoted(c.__doc__ or '', '    ')}    ...\n")
        else:
            out.append("\n" + class_(c))
    functions = [v for v in vars(m).values() if inspect.isbuiltin(v)]
    out += ["\n" + function(f.__doc__) for f in functions]
    text = "".join(out)
    return re.sub(r"[ \t]+\n", "\n", text)


def stubs():
    core = "\nfrom . import energy_shaping as energy_shaping, vsa as vsa\n"
    sub = "\nfrom . import Function, Law, MechanicalModel, Model, Network\n"
    return {"_core/__init__.pyi": module(_core, core),
            "_core/energy_shaping.pyi": module(_core.energy_shaping, sub),
            "_core/vsa.pyi": module(_core.vsa, sub)}


def main(arguments):
    folder, check = Path(arguments[0]), "--check" in arguments
    status = 0
    for name, text in stubs().items():
        if "::" in text:
            raise SystemExit(f"{name}: a C++ type without a Python name: " + "; ".join(t for t in text.splitlines() if "::" in t))
        compile(text, name, "exec")  # a stub must be Python
        path = folder / name
        if check:
            if not path.exists() or path.read_text(encoding="utf-8") != text:
                print(f"{path} is not what the module says: run python/make_stubs.py python/porthos")
                status = 1
        else:
            path.parent.mkdir(exist_ok=True)
            path.write_text(text, encoding="utf-8")
    return status


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]) if len(sys.argv) > 1 else (print(__doc__), 2)[1])
