"""Variable-stiffness actuators, every family behind one elastic energy: docs/actuators.md."""

from . import _core  # noqa: F401  registers its submodules
from ._core.vsa import *  # noqa: F403
