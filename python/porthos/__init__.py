"""Porthos from Python: port-Hamiltonian systems, structure-preserving integrators, runs with a verdict.

    import porthos
    result = porthos.Scene("examples/ets_vii/scene.toml").run(out="results/ets_vii")
    print(result)                  # every check with its limit, and the verdict
    result["energy_error"]         # a numpy array; result.names lists all

Names are those of the C++ headers, docs/python.md shows them at work.
"""

import sys

try:
    import numpy  # noqa: F401
except ModuleNotFoundError as e:
    if e.name != "numpy":
        raise
    raise ModuleNotFoundError(f"porthos needs numpy, which {sys.executable} does not find, expected Debian's python3-numpy "
                              "(sudo apt install python3-numpy) with /usr/bin/python3, or pip install numpy for another Python",
                              name="numpy") from None

from ._core import *  # noqa: F403
from ._core import InvalidArgument, IoError, version_text
from .energy_shaping import matched_loop as _  # the submodules of this package in place of those of _core
from .vsa import formula as _  # noqa: F811
from .ensembles import EnsembleResult
from .envs import Env, VectorEnv
from .judging import judge
from .plans import Plan
from .results import Comparison, Identification, Result, Sensitivity, open
from .runs import Scene, compare, film, report, simulate, verify

__version__ = version_text().split()[1]


def plot(result, path=None, what=None, axes=None, label=None, legend=True):
    """Plots of a result (a Result, an EnsembleResult, a Comparison, or a results folder) into PNG, SVG or PDF files. what: "motion", or one panel ("joints",
    "rates of joints", "rotation of base", "energies", "works", "residual"), with axes of your own if you give them: several runs
    share them, each with its label. legend=False: without the names of lines."""
    from .plotting import plot as draw

    return draw(result, path, what, axes, label, legend)
