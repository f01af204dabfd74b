"""Mid-air ultrasound haptics: transducer phases that press a wanted pattern on the skin of a hand.

Lengths are in m, pressures in Pa, phases in rad, the time factor is exp(-i omega t). docs/python.md has a tutorial."""

import os as _os

# As the program does (solvers/linear/program_start.h). OpenMP reads it when it is loaded, which may have been before.
_open = "OMP_WAIT_POLICY" not in _os.environ and "GOMP_SPINCOUNT" not in _os.environ
if _open:
    _os.environ["GOMP_SPINCOUNT"] = "4000"
try:
    from . import _core
finally:
    if _open:
        del _os.environ["GOMP_SPINCOUNT"]
from ._core import *  # noqa: F401,F403

__version__ = _core.__version__
__all__ = [name for name in dir(_core) if not name.startswith("_") and name != "revision"]
for _name in __all__:
    if isinstance(getattr(_core, _name), type):  # as what they are imported from, in messages and help
        getattr(_core, _name).__module__ = __name__
