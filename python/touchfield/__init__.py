"""Mid-air ultrasound haptics: transducer phases that press a wanted pattern on the skin of a hand.

Lengths are in m, pressures in Pa, phases in rad, angles of bodies in degrees. The time factor is exp(-i omega t). A channel at
full drive has amplitude 1. docs/python.md has a tutorial. In the examples `tf` is this package and `np` NumPy."""

import os as _os


def _require_room():
    """As the program does (sim/core/program_start.h): OpenBLAS takes a buffer for each thread when it is loaded, and
    where that is refused it tries again for ever."""
    import mmap
    import resource

    threads = min(len(_os.sched_getaffinity(0)), 128)
    for name in ("OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS", "OMP_NUM_THREADS"):
        number = _os.environ.get(name, "").split(",")[0].strip()
        if number.isdecimal() and int(number) > 0:
            threads = min(threads, int(number))
            break
    try:
        buffers = [mmap.mmap(-1, 128 << 20, mmap.MAP_PRIVATE | mmap.MAP_ANONYMOUS) for _ in range(threads + 1)]
    except OSError:
        limits = [(resource.getrlimit(kind)[0], option) for kind, option in ((resource.RLIMIT_AS, "v"), (resource.RLIMIT_DATA, "d"))]
        most, option = min((limit for limit in limits if limit[0] != resource.RLIM_INFINITY), default=(0, ""))
        limit = f"`ulimit -{option} {most // 1024}`" if option else "the system"
        raise ImportError(f"touchfield: {limit} leaves OpenBLAS no room for its buffers, 128 MiB of address space per thread: raise "
                          "the limit, or set OMP_NUM_THREADS=1 before Python starts") from None
    for buffer in buffers:
        buffer.close()


_require_room()
# As the program does (sim/core/program_start.h). OpenMP reads it when it is loaded, which may have been before.
_open = "OMP_WAIT_POLICY" not in _os.environ and "GOMP_SPINCOUNT" not in _os.environ
if _open:
    _os.environ["GOMP_SPINCOUNT"] = "4000"
try:
    from . import _core, _exports  # which makes functions of Python's of those of the extension
finally:
    if _open:
        del _os.environ["GOMP_SPINCOUNT"]
from ._arrays import Array
from ._bodies import Mesh, hand
from ._core import (DeviceError, Error, InputError, IoError, NotBuiltError, NumericalError, Picture, Problem, RadiationProblem,
                    Scattering, Solution, TouchfieldNote, TouchfieldWarning, Wave, check, compare, eigen, evaluate, field, fit,
                    focus, force, gs, gs_pat, lbfgs, optimality_bound, paper, pattern, play, radiation, read_mesh, read_motion,
                    read_run, scatter, scene, scenes, see, skin_waves, sphere, study, surface, surface_slopes, transfer,
                    unscattered, wgs)
from ._emission import send
from ._models import Felt, Model, Motion, Pattern, Run, circle, line, run
from ._scans import Calibration, Scan, compare_scan, fit_calibration, fit_scan, read_scan
from ._sweeps import Sweep, list_sweep, read_sweep, sweep
from ._targets import Target

__version__ = _core.__version__
__all__ = [name for name in dir() if not name.startswith("_")]
for _name in __all__:
    globals()[_name].__module__ = "touchfield"


def __getattr__(name):
    now = _core._new_name("python", name)
    raise AttributeError(f"touchfield.{name} is called {now}" if now else f"module 'touchfield' has no attribute '{name}'")
