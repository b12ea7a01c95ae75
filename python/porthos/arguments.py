"""One sentence for a call of the compiled part whose arguments do not fit: which one, its value, what was expected."""

from __future__ import annotations

import difflib
import os
import re
import traceback
from typing import Any, List, NamedTuple, Optional

_words = {"str": "a text", "int": "a whole number", "float": "a number", "bool": "True or False", "None": "None", "function": "a function",
          "buffer": "an array", "dict": "a dict", "Dict": "a dict", "list": "a list", "tuple": "a tuple", "Tuple": "a tuple", "Callable": "a function", "os.PathLike": "a path", "Path": "a path"}
_many = {"str": "texts", "int": "whole numbers", "float": "numbers"}
# What a type that does not fit has in place of the function.
_instead = {("certify", "Lqr"): "; an Lqr has falling_level() and certify_sampled()"}


class _Parameter(NamedTuple):
    name: str
    kind: str
    optional: bool


def sentence(function: str, text: str, arguments: tuple, keywords: dict) -> str:
    """function: its name; text: pybind11's error, which lists its signatures; arguments and keywords: those of the call."""
    if function == "__init__":
        function, arguments = type(arguments[0]).__name__, arguments[1:]
    signatures = [_parameters(line) for line in re.findall(r"^    \d+\. (.*)$", text, re.M)]
    if not signatures:
        return text
    if signatures[0][:1] and signatures[0][0].name == "self":  # a method, or the function behind a property
        signatures, arguments = [s[1:] for s in signatures], arguments[1:]
        if [p.name for p in signatures[0]] == ["arg0"] and len(arguments) == 1 and len(signatures) == 1:
            return f"{function} is {_told(arguments[0])}, expected {_expected(signatures[0][0].kind)}"
    found = [_faults(s, arguments, keywords) for s in signatures]
    fewest = min(found, key=len)
    if any(map(_carries_derivatives, [*arguments, *keywords.values()])) and (not fewest or "Dual" in fewest[0][0]):
        return (f"{function}() takes no numbers that carry derivatives: systems and continuous laws are also called with such; "
                "compute with them, or give the law a period > 0")
    if not fewest:
        wanted = " or ".join(f"{function}({', '.join(p.name for p in s)})" for s in signatures)
        return f"{function}(): {', '.join(map(_told, arguments)) or 'nothing'} does not fit, expected {wanted}"
    same = [f for f in found if len(f) == len(fewest) and f[0][0] == fewest[0][0]]
    told, _ = fewest[0]
    wanted = list(dict.fromkeys(f[0][1] for f in same))
    instead = [_instead.get((function, type(a).__name__), "") for a in [*arguments, *keywords.values()]]
    return f"{function}(): {told}, expected {' or '.join(wanted)}{''.join(instead)}"


def tell_place(error: Exception, who: str, t: float) -> None:
    """Adds to the text of an error whose code it was, the time, and the last line outside of this package."""
    here = os.path.dirname(__file__) + os.sep
    lines = [f for f in traceback.extract_tb(error.__traceback__) if not f.filename.startswith(here)][-1:]
    where = f"{who} at t = {t:.6g} s" + "".join(f", {os.path.basename(f.filename)}:{f.lineno}" for f in lines)
    if len(error.args) == 1 and isinstance(error.args[0], str):
        error.args = (f"{error.args[0]} ({where})",)
    elif hasattr(error, "add_note"):  # Python 3.11
        error.add_note(where)


def _faults(parameters: List[_Parameter], arguments: tuple, keywords: dict) -> list:
    """Pairs: what is wrong, what was expected."""
    named = [p for p in parameters if not p.name.startswith("*")]
    names = [p.name for p in named]
    stars = [p.name for p in parameters]
    placed = names[:stars.index("*")] if "*" in stars else names  # the others by name only
    given = dict(zip(names if "*args" in stars else placed, arguments))
    faults = []
    if len(arguments) > len(placed) and "*args" not in stars:
        others = f", and by name: {', '.join(names[len(placed):])}" if len(names) > len(placed) else ""
        most = f"at most {len(placed)}: {', '.join(placed)}{others}" if placed else "keywords only" if parameters else "none"
        faults.append((f"it got {len(arguments)} argument{'s' if len(arguments) > 1 else ''}", most))
    for name in keywords:
        if name in given:
            faults.append((f"'{name}' is given twice", "it once"))
        elif name not in names and not any(p.name.startswith("**") for p in parameters):
            near = difflib.get_close_matches(name, names, 1)
            faults.append((f"it has no argument '{name}'", f"'{near[0]}'" if near else ", ".join(names) or "none"))
    given = {**keywords, **given}
    for p in named:
        if p.name not in given:
            if not p.optional:
                faults.append((f"'{p.name}' is missing", _expected(p.kind)))
        elif _fits(given[p.name], p.kind) is False:
            faults.append((f"'{p.name}' is {_told(given[p.name])}", _expected(p.kind) + _hint(given[p.name], p.kind)))
    return faults


def _hint(value: Any, kind: str) -> str:
    """What makes the expected class of a value that is no such, but holds all of it."""
    return ": porthos.MechanicalModel(mechanism)" if kind.endswith(".Model") and type(value).__name__ == "Mechanism" else ""


def _carries_derivatives(value: Any) -> bool:
    """A Dual, or an array of them: what a system's functions are called with for their derivatives."""
    if getattr(value, "dtype", None) == object and value.size:
        value = value.flat[0]
    return type(value).__name__ == "Dual"


def _told(value: Any) -> str:
    """A value in an error's text."""
    if value is None or isinstance(value, bool):
        return repr(value)
    if hasattr(value, "shape") and hasattr(value, "dtype") and value.shape:
        return f"an array of shape {tuple(value.shape)} of {value.dtype}"
    text = repr(value)
    kind = type(value).__name__
    if text.startswith("<"):
        return f"of the type {kind}"
    return f"{kind} {text if len(text) <= 40 else text[:37] + '...'}"


def split(text: str) -> List[str]:
    """At the commas outside of brackets and quotes."""
    parts, depth, quote, start = [], 0, "", 0
    for i, c in enumerate(text):
        if quote:
            quote = "" if c == quote and text[i - 1] != "\\" else quote
        elif c in "'\"":
            quote = c
        elif c in "([{<":
            depth += 1
        elif c in ")]}>":
            depth -= 1
        elif c == "," and depth == 0:
            parts.append(text[start:i])
            start = i + 1
    return [p.strip() for p in [*parts, text[start:]] if p.strip()]


def _parameters(signature: str) -> List[_Parameter]:
    """Those of "(a: int, b: List[float] = [1.0], **kwargs) -> float" and of "module.Class(a: int)"."""
    inner = re.sub(r"\) -> [^)]*$", ")", signature)
    inner = inner[inner.index("(") + 1:inner.rindex(")")]
    return [_Parameter((m := re.match(r"(\*{0,2}\w*)(?:: ([^=]*[^= ]))?( = .*)?$", p, re.S)).group(1), m.group(2) or "object", bool(m.group(3)))
            for p in split(inner) if p != "/"]


def _generic(kind: str) -> "tuple[str, List[str]]":
    m = re.match(r"([\w.]+)\[(.*)\]$", kind)
    return (m.group(1), split(m.group(2))) if m else (kind, [])


def _expected(kind: str) -> str:
    outer, inner = _generic(kind)
    if outer in ("Union", "Optional"):
        return " or ".join(dict.fromkeys([*map(_expected, inner), *(["None"] if outer == "Optional" else [])]))
    if outer in ("List", "Sequence", "Iterable", "Set") and inner:
        return f"a list of {_many.get(inner[0]) or _expected(inner[0])}"
    if outer == "numpy.ndarray":
        return f"a numpy array of {inner[0].rsplit('.')[-1]}" if inner else "a numpy array"
    return _words.get(outer) or kind.rsplit(".")[-1]


def _fits(value: Any, kind: str) -> Optional[bool]:
    """None where this cannot be told from the words of the signature."""
    outer, inner = _generic(kind)
    if outer == "Optional":
        return value is None or _fits(value, inner[0])
    if outer == "Union":
        each = [_fits(value, k) for k in inner]
        return True if True in each else None if None in each else False
    if outer in ("List", "Sequence", "Iterable", "Set"):
        if isinstance(value, (str, bytes, dict)) or not hasattr(value, "__iter__"):
            return False
        each = [_fits(v, inner[0]) for v in value] if inner and hasattr(value, "__len__") else []
        return False if False in each else None if None in each else True
    if outer in ("Dict", "dict"):
        return isinstance(value, dict)
    if outer in ("Callable", "function"):
        return callable(value)
    if kind == "str":
        return isinstance(value, (str, bytes))
    if kind == "bool":
        return type(value).__name__ in ("bool", "bool_")
    if kind == "float":
        return isinstance(value, (int, float)) or (hasattr(value, "__float__") and not getattr(value, "shape", ()))
    if kind == "int":
        return hasattr(value, "__index__")
    if kind in ("os.PathLike", "Path"):
        return isinstance(value, str) or hasattr(value, "__fspath__")
    if kind == "None":
        return value is None
    if kind.startswith("porthos._core."):
        return any(f"{c.__module__}.{c.__qualname__}" == kind or c.__name__ == kind.rsplit(".")[-1] for c in type(value).__mro__)
    return None
