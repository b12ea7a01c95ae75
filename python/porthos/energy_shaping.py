"""Controllers as closed loops with an energy of their own and a certificate: docs/controllers.md."""

from typing import Any, Mapping, Sequence

from . import _core  # registers its submodules
from ._core.energy_shaping import *  # noqa: F403
from ._core.energy_shaping import MatchedLoop, matched_from_texts


def _formula(expression: Any) -> str:
    """A text as Porthos reads it, of a text, a number or an expression of SymPy."""
    return str(expression).replace("**", "^")


def matched_loop(plant: "_core.Model", *, actuated: Sequence[str], coordinates: Sequence[str], Md: Sequence[Sequence[Any]], Vd: Any,
                 gains: Mapping[str, float], lower: Sequence[float], upper: Sequence[float], rest: Sequence[float] = (),
                 solve_skew: bool = False, rate: float = 1.0, samples: int = 2000, matching: float = 1e-10, refuse: bool = True,
                 name: str = "matched by formulas") -> MatchedLoop:
    """A plant under interconnection and damping assignment (IDA-PBC) by formulas of your own: H_d = p^T Md(q)^-1 p / 2 + Vd(q).

    plant: canonical, of n = 2 or 3 coordinates, without quaternions or closed loops. actuated: its ports with an actuator.
    coordinates: names of q in the formulas, (n,). Md: (n, n) formulas, Vd: one [J], each a text, a number or an expression of
    SymPy, of the coordinates and the gains (their language: porthos.vsa.formula). gains: numbers by name, with "kv" of the
    damping; SIMD lanes of sweep() may change them. solve_skew: J2 from the kinetic matching equation, for one coordinate
    without actuator; else J2 = 0. The matching equations are checked at `samples` places of the box lower to upper, (n,), rates
    up to `rate`; rest: q*, (n,), all 0. Derivatives are exact, in every number type; a step allocates nothing.

    Raises InvalidArgument for what is no formula (at which character), and for a condition that fails, with its worst place;
    refuse=False lets the certificate say it instead. Source: Ortega, Spong, Gomez-Estern, Blankenstein 2002.
    """
    return matched_from_texts(plant, list(actuated), list(coordinates), [[_formula(m) for m in row] for row in Md], _formula(Vd),
                              [(k, float(v)) for k, v in gains.items()], solve_skew, list(rest), list(lower), list(upper), rate, samples,
                              matching, refuse, name)
