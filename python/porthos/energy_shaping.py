"""Controllers as closed loops with an energy of their own and a certificate: docs/controllers.md."""

from . import _core  # noqa: F401  registers its submodules
from ._core.energy_shaping import *  # noqa: F403
