"""Python functions written down as formulas, which Porthos differentiates: porthos.vsa.formula."""

import inspect
from typing import Any, Callable

_SIGNS = {"add": "+", "subtract": "-", "multiply": "*", "divide": "/", "power": "^"}
_FUNCTIONS = {"sqrt": "sqrt", "exp": "exp", "log": "log", "sin": "sin", "cos": "cos", "tan": "tan", "sinh": "sinh",
              "cosh": "cosh", "tanh": "tanh", "arctan": "atan", "absolute": "abs", "fabs": "abs", "minimum": "min",
              "maximum": "max"}


def _text(x: Any) -> str:
    shape = getattr(x, "shape", ())
    if shape:
        raise TypeError(f"an energy is one number of one phi, not an array of shape {shape}, expected its terms added up")
    if hasattr(x, "item"):
        x = x.item()  # numpy.polyval makes arrays of no dimension
    if isinstance(x, _Number):
        return x.text
    try:
        value = repr(float(x))
    except (TypeError, ValueError):
        raise TypeError(f"an energy has numbers, its arguments and numpy's functions of them, not {type(x).__name__} {x!r}") from None
    return f"({value})" if value.startswith("-") else value


class _Number:
    """Stands for an argument of the function, and writes down what is done to it."""

    def __init__(self, text: str) -> None:
        self.text = text

    def _sign(self, other: Any, sign: str) -> "_Number":
        return _Number(f"({self.text} {sign} {_text(other)})")

    def _from(self, other: Any, sign: str) -> "_Number":
        return _Number(f"({_text(other)} {sign} {self.text})")

    def __add__(self, x: Any) -> "_Number":
        return self._sign(x, "+")

    def __radd__(self, x: Any) -> "_Number":
        return self._from(x, "+")

    def __sub__(self, x: Any) -> "_Number":
        return self._sign(x, "-")

    def __rsub__(self, x: Any) -> "_Number":
        return self._from(x, "-")

    def __mul__(self, x: Any) -> "_Number":
        return self._sign(x, "*")

    def __rmul__(self, x: Any) -> "_Number":
        return self._from(x, "*")

    def __truediv__(self, x: Any) -> "_Number":
        return self._sign(x, "/")

    def __rtruediv__(self, x: Any) -> "_Number":
        return self._from(x, "/")

    def __pow__(self, x: Any) -> "_Number":
        return self._sign(x, "^")

    def __rpow__(self, x: Any) -> "_Number":
        return self._from(x, "^")

    def __neg__(self) -> "_Number":
        return _Number(f"(-{self.text})")

    def __pos__(self) -> "_Number":
        return self

    def __abs__(self) -> "_Number":
        return _Number(f"abs({self.text})")

    def __array_ufunc__(self, ufunc: Any, method: str, *inputs: Any, **keywords: Any) -> "_Number":
        name = ufunc.__name__
        texts = [_text(x) for x in inputs]
        if method == "__call__" and not keywords:
            if name in _SIGNS:
                return _Number(f"({texts[0]} {_SIGNS[name]} {texts[1]})")
            if name in _FUNCTIONS:
                return _Number(f"{_FUNCTIONS[name]}({', '.join(texts)})")
            if name == "negative":
                return _Number(f"(-{texts[0]})")
            if name == "square":
                return _Number(f"({texts[0]} ^ 2)")
        known = ", ".join(sorted(_FUNCTIONS))
        raise TypeError(f"numpy.{name} is not in an energy, expected numpy's {known} or + - * / **")

    def __float__(self) -> float:
        raise TypeError("an energy takes numpy's functions, numpy.sin(phi), not those of math, which want a number")

    def _branch(self, *_: Any) -> bool:
        raise TypeError("an energy is one formula for all values, expected numpy.maximum, numpy.minimum or abs instead of a comparison")

    __bool__ = __lt__ = __le__ = __gt__ = __ge__ = __eq__ = __ne__ = _branch  # type: ignore[assignment]
    __hash__ = None  # type: ignore[assignment]


for _name, _written in _FUNCTIONS.items():  # numpy calls methods of what is in an array
    setattr(_Number, _name, lambda self, _f=_written: _Number(f"{_f}({self.text})"))


def energy_of(function: Callable[..., Any]) -> str:
    """The formula that a function of (phi) or (phi, sigma) computes.

    It is called once, with numbers that write down what is done to them. Numbers it uses from outside become constants.
    TypeError: it does something that is no formula, as a comparison."""
    if not callable(function):
        raise TypeError(f"the energy is {function!r}, expected a text or a function of (phi) or (phi, sigma)")
    count = len(inspect.signature(function).parameters)
    if count not in (1, 2):
        raise TypeError(f"the energy takes {count} arguments, expected (phi) or (phi, sigma)")
    return _text(function(*(_Number(name) for name in ("phi", "sigma")[:count])))
