"""Digests of functions: whether a run is continued by the code that began it."""

from __future__ import annotations

import functools
import hashlib
import types
from typing import Any, Iterator

import numpy as np

PLAIN = (bool, int, float, complex, str, bytes, type(None), type(Ellipsis))


def of(function: Any) -> str:
    """Changes with the code of a function, its constants, defaults, and the numbers, arrays and functions that it uses by name.

    It ends in "not checked" where it uses objects of other types: their attributes are not looked at.
    """
    parts = list(_parts(function, set()))
    text = hashlib.sha256("\n".join(parts).encode()).hexdigest()
    return text + (", not checked" if any(p.startswith("?") for p in parts) else "")


def _names(code: types.CodeType) -> Iterator[str]:
    yield from code.co_names
    for inner in code.co_consts:
        if isinstance(inner, types.CodeType):
            yield from _names(inner)


def _parts(value: Any, seen: set[int]) -> Iterator[str]:
    """Texts that say what a value is; one that begins with ? where this is not known."""
    if isinstance(value, PLAIN):
        yield f"{type(value).__name__} {value!r}"
        return
    if isinstance(value, (np.ndarray, np.generic)) and value.dtype != object:
        a = np.ascontiguousarray(value)
        yield f"{a.dtype} {a.shape} {a.tobytes().hex()}"
        return
    if isinstance(value, (types.ModuleType, types.BuiltinFunctionType, type, np.ufunc)) or not hasattr(value, "__code__") and callable(value) and hasattr(value, "__name__"):
        yield f"{getattr(value, '__module__', '')}.{getattr(value, '__qualname__', value.__name__)}"
        return
    if id(value) in seen:
        yield "again"
        return
    seen.add(id(value))
    if isinstance(value, types.CodeType):
        yield f"code {value.co_code.hex()} {value.co_names} {value.co_varnames} {value.co_freevars} {value.co_argcount}"
        for constant in value.co_consts:
            yield from _parts(constant, seen)
    elif isinstance(value, types.FunctionType):
        yield from _parts(value.__code__, seen)
        yield from _parts((value.__defaults__, value.__kwdefaults__), seen)
        for cell in value.__closure__ or ():
            yield from _parts(cell.cell_contents, seen)
        for name in sorted(set(_names(value.__code__)) & set(value.__globals__)):
            yield name
            yield from _parts(value.__globals__[name], seen)
    elif isinstance(value, types.MethodType):
        yield from _parts((value.__func__, value.__self__), seen)
    elif isinstance(value, functools.partial):
        yield from _parts((value.func, value.args, value.keywords), seen)
    elif isinstance(value, (list, tuple)):
        yield f"{type(value).__name__} {len(value)}"
        for each in value:
            yield from _parts(each, seen)
    elif isinstance(value, dict):
        for key, each in value.items():
            yield from _parts((key, each), seen)
    elif isinstance(value, frozenset):
        yield " ".join(sorted(map(repr, value)))
    else:
        yield f"? {type(value).__qualname__}"
