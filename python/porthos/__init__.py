"""Porthos from Python: port-Hamiltonian systems, structure-preserving integrators, runs with a verdict.

    import porthos
    result = porthos.Scene("examples/ets_vii/scene.toml").run(out="results/ets_vii")
    print(result)                  # every check with its limit, and the verdict
    result["energy_error"]         # a numpy array; result.names lists all

Names are those of the C++ headers, docs/python.md shows them at work.
"""

from . import energy_shaping, vsa
from ._core import *  # noqa: F403
from ._core import InvalidArgument, IoError, version_text
from .ensembles import EnsembleResult
from .envs import Env, VectorEnv
from .plans import Plan
from .results import Comparison, Identification, Result, Sensitivity, open
from .runs import Scene, compare, film, report, simulate, verify

__version__ = version_text().split()[1]


def plot(result, path=None, what=None, axes=None):
    """Plots of a result (a Result, an EnsembleResult, or a results folder) into PNG, SVG or PDF files. what: "motion", or one panel ("joints",
    "rates of joints", "rotation of base", "energies", "works", "residual"), with axes of your own if you give them."""
    from .plotting import plot as draw

    return draw(result, path, what, axes)
