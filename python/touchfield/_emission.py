"""Phases to an array."""

import os
import pickle
import subprocess
import sys

import numpy as np

from . import _core
from ._core import Array, Motion, Run, Solution
from ._models import one_method
from ._plain import named


def _process(work):
    """This interpreter with the package from where it is now, and nothing from the current folder."""
    folder = os.path.dirname(os.path.dirname(os.path.abspath(__file__)))
    return [sys.executable, "-c", f"import sys; sys.path = [{folder!r}, *filter(None, sys.path)]; import touchfield._emission; {work}"]


_GUARD = _process("touchfield._core._serve_link()")


def _frames(drives):
    """Phases and amplitudes, both F x N, of a drive vector, of several, or of solutions."""
    if isinstance(drives, Solution):
        return drives.phases[None], drives.amplitudes[None]
    if isinstance(drives, (list, tuple)) and all(isinstance(drive, Solution) for drive in drives):
        return np.array([drive.phases for drive in drives]), np.array([drive.amplitudes for drive in drives])
    try:
        drives = np.atleast_2d(np.asarray(drives))
    except ValueError:
        raise _core.InputError("send: drives must have as many values in every frame") from None
    if not np.iscomplexobj(drives):
        return drives, np.ones(drives.shape)
    amplitudes = np.abs(drives)
    amplitudes = np.where(abs(amplitudes - 1) <= _core._amplitude_rounding, 1, amplitudes)
    if (amplitudes > 1).any():
        raise _core.InputError(f"send: drives: the amplitude {amplitudes.max():.9g} must be 0 to 1")
    return np.angle(drives), amplitudes


def _of_results(source, method):
    """The array, phases and amplitudes of a run, of several, or of a motion."""
    runs = [source] if isinstance(source, Run) else source
    if isinstance(source, Motion):
        name = one_method(source, method, "send")
        return source.array, source.phases[name], source.amplitudes[name]
    if not isinstance(runs, (list, tuple)) or not runs or not all(isinstance(run, Run) for run in runs):
        raise TypeError(f"send: source must be an Array, a Run, a list of them or a Motion, not {type(source).__name__}")
    names = [one_method(run, method, "send") for run in runs]
    return (runs[0].array, np.array([run.phases[name] for run, name in zip(runs, names)]),
            np.array([run.amplitudes[name] for run, name in zip(runs, names)]))


def send(source, drives=None, *, method=None, to="dry-run", emit=False, rate=None, seconds=None, repeat=False, level=None, max_level=0.5,
         max_seconds=10.0, modulation=None, depth=1.0, force=False):
    """Checks and rounds phases for a device, by the rules of `touchfield send`. Emits no sound unless `emit` is true.

    Parameters
    ----------
    source : Array, Run, list of Run, Motion or Pattern
        With an array `drives` are sent, otherwise what the results hold.
    drives : array_like, shape (N,) or (F, N), Solution, or list of Solution, optional
        Phases [rad] or complex drives; F frames are a sequence.
    method : str, optional
        Of the results; default: the only one.
    to : str
        Link to the device: dry-run, dry-run:FILE, sonicsurface:PORT, autd3-udp:ADDRESS, ...
    emit : bool
        Emit sound. It is done by a process of its own, with a guard that leaves the array silent whatever happens to it.
    rate : float, optional
        Frames per second; default: that of a pattern, or 10.
    seconds : float, optional
        Time of emission [s]; default: 1 for one frame, otherwise one pass.
    repeat : bool
        Whether a sequence begins again.
    level : float, optional
        Level that stands for full amplitude; default: 0.5, or 1 if the device has no other.
    max_level, max_seconds : float
        Caps on level and time.
    modulation : float, optional
        Frequency of a sine that modulates the amplitude [Hz].
    depth : float
        Of that modulation.
    force : bool
        Whether existing files of a dry run are replaced.

    Returns
    -------
    dict
        `device`, `transducers`, `frames`, `rate_hz`, `seconds`, `level`, `worst_phase_error_rad`, `drive_loss`, `files`,
        `emitted`, `silent`, ...

    Raises
    ------
    InputError
        Before the device hears anything: on a value out of range or above its cap, or an array that is not the device's.
    DeviceError
        If the device fails.

    Examples
    --------
    >>> array = tf.Array.sonicsurface()
    >>> report = tf.send(array, [array.focus([x, 0, 0.15]) for x in (-0.01, 0, 0.01)])
    >>> report["frames"], report["emitted"]
    (3, False)
    """
    if isinstance(source, Array):
        if drives is None or method is not None:
            raise TypeError("send: an Array needs drives, and no method, which is of results")
        array = source
        phases, amplitudes = _frames(drives)
    else:
        if drives is not None:
            raise TypeError("send: drives need an Array; results have their own")
        array, phases, amplitudes = _of_results(source, method)
    rate = getattr(source, "frames_per_second", 10.0) if rate is None else rate
    options = {"to": to, "rate": rate, "seconds": seconds, "repeat": repeat, "level": level, "max_level": max_level,
               "max_seconds": max_seconds, "modulation": modulation, "depth": depth, "force": force}
    if not emit:
        return named(_core._send(array, phases, amplitudes, **options))
    child = subprocess.Popen(_process("touchfield._emission._emit()"), stdin=subprocess.PIPE, stdout=subprocess.PIPE)
    child.stdin.write(pickle.dumps((array, phases, amplitudes, options)))
    child.stdin.close()
    try:
        answer = child.stdout.read()
    except KeyboardInterrupt:  # which it heard too: it silences the array
        child.wait()
        raise
    if child.wait() != 0 or not answer:
        raise _core.DeviceError(f"send: the process that emits ended with exit code {child.returncode}; its guard silences the array")
    report = pickle.loads(answer)
    if isinstance(report, BaseException):
        raise report
    return named(report)


def _emit():
    """In the process that emits: this thread takes its signals."""
    array, phases, amplitudes, options = pickle.loads(sys.stdin.buffer.read())
    try:
        report = _core._send(array, phases, amplitudes, guard=_GUARD, **options)
    except _core.Error as error:
        report = error
    sys.stdout.buffer.write(pickle.dumps(report))
