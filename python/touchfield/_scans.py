"""Scans of a field with a microphone: how they were taken, and what they tell of the channels. Needs SciPy: touchfield[calibration]."""

import dataclasses
import os
import re

import numpy as np

from . import _core
from ._core import Array, Run, Wave
from ._plain import require

# Value of a setting: its group, a change that a scan shows, its bounds. Places in m, turns in rad.
_VALUES = {"x": ("place", 1e-3, -10, 10), "y": ("place", 1e-3, -10, 10), "z": ("place", 1e-3, -10, 10),
           "turn_x": ("turn", 0.02, -6.3, 6.3), "turn_y": ("turn", 0.02, -6.3, 6.3), "turn_z": ("turn", 0.02, -6.3, 6.3),
           "size": ("size", 0.01, 0.1, 10), "receiver": ("receiver", 1e-3, 0, 0.05), "sound_speed": ("sound_speed", 0.005, 0.5, 2)}
_NAMES = list(_VALUES)
_GROUPS = sorted({group for group, *_ in _VALUES.values()})
_UNCHANGED = {name: 1.0 if name in ("size", "sound_speed") else 0.0 for name in _NAMES}
_FEW, _MANY = 300, 1000  # points: of the search for a start, of the fit
_FIRST_RADIUS = 2e-3  # at 0 the reading has no slope [m]
_LEAST_DETERMINED = 1e-4  # least singular value over the largest, of columns by their steps
# The mean over a disc by its middle and six places on a ring: exact for polynomials up to the fifth degree
# (Abramowitz, Stegun, 25.4.61).
_RING = np.sqrt(2 / 3) * np.array([[np.cos(a), np.sin(a), 0] for a in np.arange(6) * np.pi / 3])
_SPREAD = 0.5  # of responses about 1: dead channels too are to be found
_DEAD_GAIN = 0.2
_MOST_ERROR = 0.1  # standard deviation of a response
_POINTS_PER_CHANNEL = 1.2


def _scipy():
    try:
        import scipy.optimize
    except ImportError:
        raise ImportError("touchfield: a fit needs SciPy: pip install 'touchfield[calibration]'") from None
    return scipy.optimize


def read_scan(path):
    """The points of a table with the columns x_mm, y_mm, z_mm and p_pa (a magnitude), or p_re and p_im.

    Parameters
    ----------
    path : str or os.PathLike

    Returns
    -------
    points : numpy.ndarray, shape (J, 3)
        [m]
    pressure : numpy.ndarray, shape (J,)
        Real magnitudes or complex.

    Examples
    --------
    >>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
    >>> points = [[x, 0, 0.02] for x in (-0.01, 0, 0.01)]
    >>> tf.compare_scan(run, points, abs(run.field(points)["focus"])).save("scan.csv")
    >>> points, pressure = tf.read_scan("scan.csv")
    >>> points.shape, pressure.shape
    ((3, 3), (3,))
    """
    try:
        table = np.genfromtxt(os.fspath(path), delimiter=",", names=True, ndmin=1)
    except OSError as error:
        raise _core.IoError(f"read_scan: {error}") from None
    names = table.dtype.names or ()
    values = next((wanted for wanted in (("p_pa",), ("p_re", "p_im")) if set(wanted) <= set(names)), None)
    if values is None or not {"x_mm", "y_mm", "z_mm"} <= set(names):
        raise _core.InputError(f"{path}: the header must name x_mm, y_mm, z_mm and p_pa, or p_re and p_im")
    columns = [table[name] for name in ("x_mm", "y_mm", "z_mm", *values)]
    if not np.isfinite(columns).all():
        raise _core.InputError(f"{path}: every row must hold numbers")
    pressure = columns[3] if len(values) == 1 else columns[3] + 1j * columns[4]
    return 1e-3 * np.stack(columns[:3], axis=1), pressure


def _rotation(setting):
    """About the fixed x, then y, then z axis."""
    (cx, sx), (cy, sy), (cz, sz) = ((np.cos(setting[f"turn_{a}"]), np.sin(setting[f"turn_{a}"])) for a in "xyz")
    return (np.array([[cz, -sz, 0], [sz, cz, 0], [0, 0, 1]]) @ np.array([[cy, 0, sy], [0, 1, 0], [-sy, 0, cy]])
            @ np.array([[1, 0, 0], [0, cx, -sx], [0, sx, cx]]))


def _placed(points, middle, setting):
    return middle + [setting["x"], setting["y"], setting["z"]] + setting["size"] * (points - middle) @ _rotation(setting).T


def _over_opening(placed, setting, field):
    """The mean over the microphone's opening of what `field` makes of points, a row per point."""
    if setting["receiver"] == 0:
        return field(placed)
    ring = setting["receiver"] * _RING @ _rotation(setting).T
    values = field(np.concatenate([placed, *(placed + place for place in ring)]))
    values = values.reshape(7, len(placed), *values.shape[1:])
    return 0.25 * values[0] + 0.125 * values[1:].sum(axis=0)


def _wave(run, setting):
    """The run's, at the true speed of sound."""
    frequency, speed, *air = run._wave.__getstate__()
    wave = Wave.__new__(Wave)
    wave.__setstate__((frequency, speed * setting["sound_speed"], *air))
    return wave


def _match(computed, measured):
    """The factor with which what was computed meets what was measured, and the correlation; of magnitudes both are real."""
    if not np.iscomplexobj(measured):
        computed = np.abs(computed)
    length, wanted = np.linalg.norm(computed), np.linalg.norm(measured)
    if not length > 0 or not wanted > 0:
        raise _core.InputError(f"the {'measured' if length > 0 else 'computed'} pressure is 0 at every point, there is nothing to fit")
    product = np.vdot(computed, measured)
    return product / length**2 * computed, abs(product) / (length * wanted)


@dataclasses.dataclass(frozen=True, eq=False)
class Scan:
    """A scan beside the field of a run, times one factor.

    Attributes
    ----------
    run : Run
    method : str
    setting : dict
        How the scan was taken: a point p of the file was measured at middle + (x, y, z) + R size (p - middle), with the mean of the
        points as the middle and R the rotations turn_x, turn_y, turn_z about the fixed axes [m, rad]. `receiver` is the radius of
        the microphone's opening, a disc that lies in the file's plane z = const and turns along [m]. `sound_speed` is the true speed
        over that of the run; pressures on the skin stay those of the run.
    points : numpy.ndarray, shape (J, 3)
        Where they were measured [m].
    used : numpy.ndarray of bool, shape (J,)
        False inside the body, nearer to the skin than the longest edge there, and on a transducer.
    measured, computed : numpy.ndarray, shape (J,)
        As in the file; of the run, times the factor.
    relative, correlation, about_means : float
        Difference (L2), correlation, and of magnitudes the correlation without their means.
    """

    run: Run
    method: str
    setting: dict
    points: np.ndarray
    used: np.ndarray
    measured: np.ndarray
    computed: np.ndarray
    relative: float
    correlation: float
    about_means: float

    def save(self, path):
        """Writes the table that `touchfield compare --points` reads, with the points where they were measured.

        Parameters
        ----------
        path : str or os.PathLike
        """
        parts = [self.measured.real, self.measured.imag] if np.iscomplexobj(self.measured) else [self.measured]
        header = "x_mm,y_mm,z_mm," + ("p_re,p_im" if len(parts) == 2 else "p_pa")
        np.savetxt(path, np.column_stack([1e3 * self.points, *parts]), "%.12g", ",", header=header, comments="")


def compare_scan(run, points, pressure, *, method=None, setting=None):
    """The field of a run at measured points. It is scaled, and for complex values turned, to meet them by least squares.

    Parameters
    ----------
    run : Run
    points : array_like, shape (J, 3)
        [m]
    pressure : array_like, shape (J,)
        Measured magnitudes, or complex values of the time factor exp(-i omega t), in any unit.
    method : str, optional
        Default: the first of the run.
    setting : dict, optional
        How the scan was taken, see `Scan`; what is missing is as the points say.

    Returns
    -------
    Scan

    Examples
    --------
    >>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
    >>> points = [[x, 0, z] for x in (-0.01, 0, 0.01) for z in (0.02, 0.03)]
    >>> scan = tf.compare_scan(run, points, 0.3 * abs(run.field(points)["focus"]))
    >>> scan.relative < 1e-9
    True
    """
    require(run, Run, "run")
    method = run.methods[0] if method is None else method
    if method not in run.methods:
        raise _core.InputError(f"method = '{method}' must be one of {', '.join(run.methods)}")
    unknown = sorted(set(setting or {}) - set(_NAMES))
    if unknown:
        raise _core.InputError(f"setting: {unknown[0]} must be one of {', '.join(_NAMES)}")
    setting = {**_UNCHANGED, **(setting or {})}
    points, measured = np.asarray(points, float), np.asarray(pressure)
    if points.ndim != 2 or points.shape[1] != 3 or measured.shape != points.shape[:1]:
        raise _core.InputError(f"points of shape {points.shape} and pressure of shape {measured.shape} must be (J, 3) and (J,)")
    placed = _placed(points, points.mean(axis=0), setting)
    computed = _reading(run, method, placed, setting)
    used = np.isfinite(computed) & np.array(run._clear(placed))
    if used.sum() < 2:
        raise _core.InputError(f"{used.sum()} of {len(points)} measured points can be compared, there must be two")
    scaled, correlation = _match(computed[used], measured[used])
    values = np.full(len(points), np.nan, scaled.dtype)
    values[used] = scaled
    wanted, about_means = measured[used], np.nan
    if not np.iscomplexobj(measured):
        left, right = scaled - scaled.mean(), wanted - wanted.mean()
        about_means = left @ right / (np.linalg.norm(left) * np.linalg.norm(right))
    relative = np.linalg.norm(scaled - wanted) / np.linalg.norm(wanted)
    return Scan(run, method, setting, placed, used, measured, values, float(relative), float(correlation), float(about_means))


def _reading(run, method, placed, setting):
    wave = _wave(run, setting)
    return _over_opening(placed, setting, lambda at: run.field(at, wave=wave)[method])


def fit_scan(run, points, pressure, fit=("place", "turn"), *, method=None, start=None):
    """How a scan was taken: the setting with which the field of a run, times one factor, meets the measured values by least squares.

    If the place is asked for, the start is first moved along x and y to the best fit within two wavelengths.

    Parameters
    ----------
    run, points, pressure, method
        As of `compare_scan`.
    fit : sequence of {"place", "turn", "size", "receiver", "sound_speed"}
    start : dict, optional
        A setting, see `Scan`; held where `fit` does not name it.

    Returns
    -------
    Scan

    Raises
    ------
    InputError
        If the points do not determine a value that is asked for.

    Examples
    --------
    >>> run = tf.run("capsule", set={"solve.methods": ["focus"]})
    >>> points = np.array([[x, y, 0.03] for x in np.linspace(-0.02, 0.02, 9) for y in np.linspace(-0.02, 0.02, 9)])
    >>> measured = abs(run.field(points + [0.002, 0, 0.001])["focus"])
    >>> scan = tf.fit_scan(run, points, measured, ["place"])
    >>> round(1e3 * scan.setting["x"], 2), round(1e3 * scan.setting["z"], 2)
    (2.0, 1.0)
    """
    optimize = _scipy()
    unknown = sorted(set(fit) - set(_GROUPS))
    if unknown:
        raise _core.InputError(f"fit: {unknown[0]} must be one of {', '.join(_GROUPS)}")
    first = compare_scan(run, points, pressure, method=method, setting=start)
    at, free = dict(first.setting), [name for name in _NAMES if _VALUES[name][0] in fit]
    counting = np.flatnonzero(first.used)
    if len(free) >= len(counting):
        raise _core.InputError(f"fit: {len(free)} values of {len(counting)} measured points that count, must be fewer than points")
    points = np.asarray(points, float)
    middle = points.mean(axis=0)

    def residual_of(most):
        picked = counting[np.arange(min(most, len(counting))) * len(counting) // min(most, len(counting))]
        measured = first.measured[picked]

        def residual(setting):
            computed = _reading(run, first.method, _placed(points[picked], middle, setting), setting)
            if not np.isfinite(computed).all():  # a point lies on a transducer
                return np.full(2 * len(picked), np.inf)
            rest = (_match(computed, measured)[0] - measured) / np.linalg.norm(measured)
            return np.concatenate([rest.real, rest.imag])

        return residual

    if "receiver" in free and at["receiver"] == 0:
        at["receiver"] = _FIRST_RADIUS
    if "x" in free:
        half, residual = 0.5 * run._wave.wavelength, residual_of(_FEW)
        starts = [at, *({**at, "x": at["x"] + i * half, "y": at["y"] + j * half} for i in range(-4, 5) for j in range(-4, 5))]
        at = min(starts, key=lambda setting: np.sum(residual(setting) ** 2))
    if free:
        residual = residual_of(_MANY)
        steps, low, high = (np.array([_VALUES[name][k] for name in free]) for k in (1, 2, 3))

        def setting_of(x):
            return {**at, **{name: float(value) for name, value in zip(free, x * steps, strict=True)}}

        found = optimize.least_squares(lambda x: residual(setting_of(x)), [at[name] / step for name, step in zip(free, steps, strict=True)],
                                       bounds=(low / steps, high / steps), diff_step=1e-4, xtol=1e-5, ftol=1e-10, max_nfev=100)
        _, values, vectors = np.linalg.svd(found.jac)
        if not values[-1] > _LEAST_DETERMINED * values[0]:
            name = free[int(np.argmax(abs(vectors[-1])))]
            raise _core.InputError(f"fit: the measured points do not determine {name}, alone or with the others; fit fewer values, or "
                                   "measure points that extend in all directions")
        at = setting_of(found.x)
    return compare_scan(run, points, pressure, method=method, setting=at)


@dataclasses.dataclass(frozen=True, eq=False)
class Calibration:
    """Responses of the channels: gains relative to the median, 0 where dead, and phases relative to the common one [rad]."""

    gain: np.ndarray
    phase: np.ndarray
    error: np.ndarray  # standard deviation of each response
    noise: float  # of the scan, over its root mean square

    @property
    def dead(self):
        """Number of channels below 0.2 of the median gain."""
        return int((self.gain == 0).sum())

    def save(self, path):
        """Writes the table that `array.calibration.file` reads.

        Parameters
        ----------
        path : str or os.PathLike
        """
        table = np.column_stack([np.arange(len(self.gain)), self.gain, self.phase, self.gain > 0])
        np.savetxt(path, table, ["%d", "%.17g", "%.17g", "%d"], ",", header="channel,gain,phase_rad,alive", comments="")


def fit_calibration(scan):
    """The response of every channel, from a complex scan of the array as designed.

    With A the readings of each driven channel, p what the body of the run scatters, m the scan and s the common factor, the responses
    are c = y / s of min |A y - m + s p|^2 / sigma^2 + |y - s|^2 / (0.5 |s|)^2. The noise sigma is what plain least squares leaves.

    Parameters
    ----------
    scan : Scan
        Of `fit_scan` or `compare_scan`.

    Returns
    -------
    Calibration

    Raises
    ------
    InputError
        If the scan has no phases, fewer points than 1.2 per channel, a channel that is not driven, or one whose response would
        have a standard deviation above 0.1; if the run's array is not as designed.

    Examples
    --------
    >>> run = tf.run("capsule", set={"solve.methods": ["focus"], "array.grid.count": [4, 4]})
    >>> points = np.array([[x, y, 0.02] for x in np.linspace(-0.03, 0.03, 9) for y in np.linspace(-0.03, 0.03, 9)])
    >>> calibration = tf.fit_calibration(tf.compare_scan(run, points, 2j * run.field(points)["focus"]))
    >>> bool(abs(calibration.gain - 1).max() < 0.01), calibration.dead
    (True, 0)
    """
    require(scan, Scan, "scan")
    run, setting = scan.run, scan.setting
    if re.search(r"^\s+(calibration|tolerances|phase_levels):", run.scene, re.MULTILINE):
        raise _core.InputError("fit_calibration: the run must have the array as designed: leave array.calibration, "
                               "tolerances and phase_levels out")
    if not np.iscomplexobj(scan.measured):
        raise _core.InputError("fit_calibration: the points have magnitudes alone, must be complex")
    drive, measured, placed = run.drives[scan.method], scan.measured[scan.used], scan.points[scan.used]
    channels, count = len(drive), len(measured)
    if not drive.all():
        raise _core.InputError(f"fit_calibration: channel {np.flatnonzero(drive == 0)[0]} is not driven in method {scan.method}, all must be")
    if count < _POINTS_PER_CHANNEL * channels:
        raise _core.InputError(f"fit_calibration: {count} points that count, must be at least {int(np.ceil(_POINTS_PER_CHANNEL * channels))} "
                               f"for {channels} channels")
    wave = _wave(run, setting)
    readings = _over_opening(placed, setting, lambda at: run.array.transfer(at, wave)) * drive
    scattered = _reading(run, scan.method, placed, setting) - readings.sum(axis=1)
    together = readings.sum(axis=1) + scattered
    factor = np.vdot(together, measured) / np.linalg.norm(together) ** 2
    rest = measured - factor * together
    normal, gradient = readings.conj().T @ readings, readings.conj().T @ rest
    plain = np.linalg.lstsq(readings, rest, rcond=None)[0]
    variance = np.linalg.norm(rest - readings @ plain) ** 2 / (count - channels)
    prior = max(variance, 1e-24 * np.linalg.norm(measured) ** 2) / (_SPREAD * abs(factor)) ** 2
    posterior = np.linalg.inv(normal + prior * np.eye(channels))
    error = np.sqrt(variance * posterior.diagonal().real) / abs(factor)
    if error.max() > _MOST_ERROR:
        raise _core.InputError(f"fit_calibration: the scan determines the response of channel {error.argmax()} within {error.max():.2g} "
                               f"(standard deviation), must be within {_MOST_ERROR}; scan a larger plane, nearer to the array, or with less noise")
    responses = 1 + posterior @ gradient / factor
    middle = np.median(abs(responses))
    gain = abs(responses) / middle
    alive = gain >= _DEAD_GAIN
    phase = np.angle(responses * np.exp(-1j * np.angle(responses.sum())))
    return Calibration(np.where(alive, gain, 0), np.where(alive, phase, 0), error / middle,
                       float(np.sqrt(variance * count) / np.linalg.norm(measured)))
