"""Makes the modules of scripts/report importable; a test that imports this first is skipped where they cannot run."""

import os
import pathlib
import sys

os.environ.setdefault("OMP_NUM_THREADS", "1")  # small matrices, which threads slow down

try:
    import h5py  # noqa: F401
    import matplotlib  # noqa: F401
    import numpy  # noqa: F401
    import scipy  # noqa: F401
except ImportError as missing:
    print(f"skipped: {missing}")
    sys.exit(77)

SOURCE = pathlib.Path(os.environ.get("TOUCHFIELD_SOURCE_DIR", pathlib.Path(__file__).resolve().parents[2]))
sys.path.insert(0, str(SOURCE / "scripts/report"))
