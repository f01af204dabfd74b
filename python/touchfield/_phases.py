"""Transfer matrices, pressures, and the methods that find phases."""

import dataclasses

import numpy as np

from . import _core
from ._arrays import Array, Wave, drives_of, wave_core
from ._bodies import Mesh
from ._plain import Part, core, new_arguments
from ._progress import reporting
from ._targets import Target


@dataclasses.dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """The drive vector that a phase method found.

    Attributes
    ----------
    phases : numpy.ndarray, shape (N,)
        0 to 2 pi [rad].
    amplitudes : numpy.ndarray, shape (N,)
        0 to 1.
    drives : numpy.ndarray of complex, shape (N,)
        amplitude exp(i phase).
    cost_history : numpy.ndarray
        Cost before the first and after each iteration; empty for a direct method.
    iterations : int
        Steps tried.
    status : str
        converged, iteration_limit, stalled or direct.
    """

    phases: np.ndarray
    amplitudes: np.ndarray
    drives: np.ndarray
    cost_history: np.ndarray
    iterations: int
    status: str

    @classmethod
    def _of(cls, core):
        return cls(**{field.name: getattr(core, field.name) for field in dataclasses.fields(cls)})

    def __repr__(self):
        return f"<touchfield.Solution: {len(self.phases)} channels, {self.status} after {self.iterations} iterations>"


class Problem(Part):
    """The misfit on the skin that `surface` minimises: sum_j w_j (abs(h_j q) - p'_j)^2 + abs(R q)^2.

    Parameters
    ----------
    target : array_like of complex, shape (K, N)
        Rows h_j of the transfer matrix at the faces of the target [Pa].
    amplitudes : array_like, shape (K,)
        Wanted pressure amplitudes p' [Pa].
    weights : array_like, shape (K,)
        w, areas of the faces [m2].
    outside : array_like of complex, shape (r, N), optional
        R, rows of the skin outside the target [Pa m].

    Raises
    ------
    InputError
        On sizes that do not fit, or a number that is not finite.

    Examples
    --------
    >>> problem = tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1])
    >>> problem.cost([1, 0])
    0.0
    """

    @new_arguments
    def __init__(self, target, amplitudes, weights, outside=None):
        self._core = _core.Problem(target, amplitudes, weights, outside)

    @classmethod
    @new_arguments
    def of(cls, h, target, outside_weight=1.0, threads=None):
        """The problem of a transfer matrix and a target.

        Parameters
        ----------
        h : array_like of complex, shape (M, N) or (K, N)
            Of every face of `target.mesh`, or of those of the target alone, without the skin outside.
        target : Target
        outside_weight : float
            Weight of the skin outside the target, >= 0.
        threads : int, optional

        Returns
        -------
        Problem

        Examples
        --------
        >>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
        >>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 800)
        >>> problem = tf.Problem.of(tf.transfer(ball, array), target)
        """
        part = core(target, Target, "target")
        if np.shape(h)[:1] == (len(target),):
            return cls(h, target.amplitudes, target.mesh.areas[target.faces])
        return cls._of(_core.Problem.of_transfer(h, target.mesh._core, part, outside_weight, threads))

    @classmethod
    def of_model(cls, model, threads=None):
        """The problem of the methods of a scene.

        Parameters
        ----------
        model : Model
        threads : int, optional

        Returns
        -------
        Problem
            With it methods find what a run of the scene finds.

        Examples
        --------
        >>> problem = tf.Problem.of_model(tf.Model("scenes/quick.yaml"))
        """
        return cls._of(_core.Problem.of_model(model._core, threads))

    @property
    def target(self):
        """Rows of the transfer matrix, shape (K, N) [Pa]."""
        return self._core.target

    @property
    def amplitudes(self):
        """Wanted pressure amplitudes, shape (K,) [Pa]."""
        return self._core.amplitudes

    @property
    def weights(self):
        """Areas, shape (K,) [m2]."""
        return self._core.weights

    @property
    def outside(self):
        """Rows of the skin outside the target, shape (r, N) [Pa m]."""
        return self._core.outside

    def cost(self, drives):
        """The misfit of a drive vector.

        Parameters
        ----------
        drives : array_like of complex, shape (N,), or Solution

        Returns
        -------
        float
            [Pa2 m2]

        Examples
        --------
        >>> tf.Problem([[1, 1]], [1], [1]).cost([1, 1])
        1.0
        """
        return self._core.cost(drives_of(drives))


def transfer(mesh, array, wave=None, *, faces=None, scheme="burton_miller_polished", device=None, threads=None, progress=None):
    """The transfer matrix H: pressures on the skin are ``H @ drives``.

    Parameters
    ----------
    mesh : Mesh
        A closed surface.
    array : Array
    wave : Wave, optional
        Default: ``Wave()``.
    faces : array_like of int, shape (K,), optional
        Rows that are wanted; default: all.
    scheme : {"paper", "paper_corrected", "chief", "burton_miller", "burton_miller_polished"}
        Scheme of the boundary elements.
    device : {"auto", "cpu", "cuda", "cuda:N"}, optional
    threads : int, optional
        Default: OMP_NUM_THREADS, or all.
    progress : callable or bool, optional
        A function of stage and fraction, or True for a bar.

    Returns
    -------
    numpy.ndarray of complex, shape (M, N) or (K, N)
        Pressure of each channel at full drive on each face [Pa]. Your own, in Fortran order: PyTorch and JAX (with
        `jax_enable_x64`) take it by `from_dlpack` without a copy.

    Raises
    ------
    InputError
        On an open surface, or a transducer nearer than 1 mm to the skin.
    NumericalError
        If a solution misses its tolerance.

    Examples
    --------
    >>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
    >>> tf.transfer(ball, array, faces=[0, 1]).shape
    (2, 16)
    """
    with reporting(progress):
        return _core.transfer(core(mesh, Mesh, "mesh"), core(array, Array, "array"), wave_core(wave), faces=faces, scheme=scheme,
                              device=device, threads=threads)


def scatter(mesh, array, drives, wave=None, *, scheme="burton_miller_polished", device=None, threads=None, progress=None):
    """The pressure of a drive vector on the skin, without the transfer matrix: one solve in place of many.

    Parameters
    ----------
    mesh : Mesh
        A closed surface.
    array : Array
    drives : array_like of complex, shape (N,) or (N, S), or Solution
        Amplitudes 0 to 1 and phases of the channels.
    wave, scheme, device, threads, progress
        As of `transfer`.

    Returns
    -------
    numpy.ndarray of complex, shape (M,) or (M, S)
        On every face [Pa].

    Raises
    ------
    InputError, NumericalError
        As `transfer`.

    Examples
    --------
    >>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
    >>> pressure = tf.scatter(ball, array, array.focus([0, 0, -8e-3]))
    """
    given = drives_of(drives)
    with reporting(progress):
        pressure = _core.scatter(core(mesh, Mesh, "mesh"), core(array, Array, "array"), given, wave_core(wave), scheme=scheme,
                                 device=device, threads=threads)
    return pressure if np.ndim(given) == 2 else pressure[:, 0]


def field(mesh, array, pressure, drives, points, wave=None, threads=None):
    """The pressure off the skin.

    Parameters
    ----------
    mesh : Mesh
    array : Array
    pressure : array_like of complex, shape (M,)
        On every face, of `scatter` or ``H @ drives`` [Pa].
    drives : array_like of complex, shape (N,), or Solution
        That made it.
    points : array_like, shape (J, 3)
        [m]
    wave : Wave, optional
        Default: ``Wave()``.
    threads : int, optional

    Returns
    -------
    numpy.ndarray of complex, shape (J,)
        [Pa]; 0 inside the body, NaN on a transducer.

    Examples
    --------
    >>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
    >>> drives = array.focus([0, 0, -8e-3])
    >>> beside = tf.field(ball, array, tf.scatter(ball, array, drives), drives, [[0, 0.02, 0]])
    """
    return _core.field(core(mesh, Mesh, "mesh"), core(array, Array, "array"), pressure, drives_of(drives), points, wave_core(wave),
                       threads)


def force(mesh, pressure, wave=None):
    """The acoustic radiation force on the skin.

    Parameters
    ----------
    mesh : Mesh
    pressure : array_like of complex, shape (M,)
        On every face [Pa].
    wave : Wave, optional
        Default: ``Wave()``.

    Returns
    -------
    numpy.ndarray, shape (M,)
        Time-averaged force on each face along its inward normal [N].

    Examples
    --------
    >>> ball = tf.sphere(8e-3, 3e-3)
    >>> bool(np.isclose(tf.force(ball, np.ones(len(ball))).sum(), ball.areas.sum() / (4 * 1.2041 * 343.21**2)))
    True
    """
    return _core.radiation_pressure(core(mesh, Mesh, "mesh"), pressure, wave_core(wave)) * mesh.areas


def optimality_bound(problem, threads=None):
    """The optimality bound: a proved lower bound of the cost over all drive vectors.

    Parameters
    ----------
    problem : Problem
    threads : int, optional

    Returns
    -------
    dict
        `bound` [Pa2 m2], `relaxed`, `iterations`, `converged`.

    Examples
    --------
    >>> problem = tf.Problem([[1, 1j], [1j, 1], [1, 1]], [1, 1, 0.1], [1, 1, 1])
    >>> tf.optimality_bound(problem)["bound"] <= problem.cost(tf.surface(problem))
    True
    """
    return _core.optimality_bound(core(problem, Problem, "problem"), threads)


def _solved(method, h, target, outside_weight, threads, progress, **options):
    problem = h if isinstance(h, Problem) else Problem.of(h, target, outside_weight, threads)
    if isinstance(options.get("start"), Solution):
        options["start"] = options["start"].drives
    with reporting(progress):
        return Solution._of(_core.solve(method, problem._core, threads=threads, **options))


@new_arguments
def surface(h, target=None, *, iterations=30, start=None, free_amplitudes=False, free_level=True, tolerances=None, outside_weight=1.0,
            threads=None, progress=None):
    """Minimises the misfit of the pressure amplitudes on the skin, by Levenberg-Marquardt.

    Parameters
    ----------
    h : array_like of complex, shape (M, N) or (K, N), or Problem
        The transfer matrix, of every face or of those of the target.
    target : Target
        Not needed with a `Problem`.
    iterations : int
    start : {"adjoint", "spectral", "zero"} or array_like of complex, shape (N,), or Solution, optional
        Default: several starts are tried.
    free_amplitudes : bool
        Whether the amplitudes of the channels are found too.
    free_level : bool
        Whether their common amplitude is found too.
    tolerances : dict, optional
        How far the channels of the real array may be from their design, rms over the array: "phase" [rad], "gain" (relative) and
        "dead" (share of the channels). The expected misfit is then minimised, over phases and a common amplitude.
    outside_weight : float
        Weight of the skin outside the target.
    threads : int, optional
    progress : callable or bool, optional
        A function of stage and fraction, or True for a bar.

    Returns
    -------
    Solution

    Raises
    ------
    InputError
        On sizes that do not fit, or a number that is not finite.

    Examples
    --------
    >>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
    >>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 20)
    >>> solution = tf.surface(tf.transfer(ball, array), target, iterations=10)
    >>> robust = tf.surface(tf.transfer(ball, array), target, tolerances={"phase": 0.35, "gain": 0.1})
    """
    return _solved("surface", h, target, outside_weight, threads, progress, iterations=iterations, start=start,
                   free_amplitudes=free_amplitudes, free_level=free_level, tolerances=tolerances or {})


@new_arguments
def lbfgs(h, target=None, *, iterations=30, start=None, outside_weight=1.0, threads=None, progress=None):
    """Minimises the misfit of `surface` over the phases by limited-memory BFGS.

    Parameters
    ----------
    h, target, iterations, start, outside_weight, threads, progress
        As of `surface`; default of `start`: zero.

    Returns
    -------
    Solution

    Examples
    --------
    >>> solution = tf.lbfgs(tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1]), start="adjoint")
    """
    return _solved("lbfgs", h, target, outside_weight, threads, progress, iterations=iterations, start=start)


def gs(h, target=None, *, iterations=30, start=None, threads=None, progress=None):
    """Gerchberg-Saxton on the faces of the target.

    Parameters
    ----------
    h, target, iterations, start, threads, progress
        As of `surface`; default of `start`: zero.

    Returns
    -------
    Solution

    Examples
    --------
    >>> solution = tf.gs(tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1]), iterations=100)
    """
    return _solved("gs", h, target, 0.0, threads, progress, iterations=iterations, start=start)


def wgs(h, target=None, *, iterations=30, start=None, threads=None, progress=None):
    """Weighted Gerchberg-Saxton, which equalises the faces.

    Parameters
    ----------
    h, target, iterations, start, threads, progress
        As of `surface`; default of `start`: zero.

    Returns
    -------
    Solution

    Examples
    --------
    >>> solution = tf.wgs(tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1]), iterations=100)
    """
    return _solved("wgs", h, target, 0.0, threads, progress, iterations=iterations, start=start)


def gs_pat(h, target=None, *, iterations=30, threads=None):
    """GS-PAT: Gerchberg-Saxton in the space of the faces.

    Parameters
    ----------
    h, target, iterations, threads
        As of `surface`.

    Returns
    -------
    Solution

    Examples
    --------
    >>> solution = tf.gs_pat(tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1]))
    """
    return _solved("gs_pat", h, target, 0.0, threads, None, iterations=iterations)


def eigen(h, target=None, *, threads=None):
    """Eigensolver: the phases on the faces that reinforce each other most, then least squares.

    Parameters
    ----------
    h, target, threads
        As of `surface`.

    Returns
    -------
    Solution

    Examples
    --------
    >>> solution = tf.eigen(tf.Problem([[1, 1j], [1j, 1]], [1, 1], [1, 1]))
    """
    return _solved("eigen", h, target, 0.0, threads, None)


def focus(h, target):
    """Phase conjugation: the sound of all channels arrives in phase at the central face of the target.

    Parameters
    ----------
    h : array_like of complex, shape (M, N) or (K, N)
        The transfer matrix, of every face or of those of the target.
    target : Target

    Returns
    -------
    Solution

    Examples
    --------
    >>> ball, array = tf.sphere(8e-3, 3e-3), tf.Array.grid(4, 4, at=[0, 0, -0.1])
    >>> target = tf.Target.box(ball, [0, 0, -8e-3], [8e-3, 8e-3, 6e-3], 800)
    >>> solution = tf.focus(tf.transfer(ball, array), target)
    """
    core(target, Target, "target")
    row = target.centre if len(h) != len(target) else int(np.searchsorted(target.faces, target.centre))
    return Solution._of(_core.focus(np.asarray(h)[row]))


def paper(model, *, iterations=30, faces="equal", threads=None, progress=None):
    """The published optimisation of the scattered field. It works on the equations of the skin itself, not on H.

    Parameters
    ----------
    model : Model
        Of a scene; of parts: ``Model({"array": array, "body": mesh, "target": target, "solve": {"methods": ["paper"]}})``.
    iterations : int
    faces : {"equal", "area"}
        Weights of the faces in the misfit: as published, or their areas.
    threads : int, optional
    progress : callable or bool, optional

    Returns
    -------
    Solution

    Examples
    --------
    >>> solution = tf.paper(tf.Model("scenes/quick.yaml"), iterations=3)
    """
    with reporting(progress):
        return Solution._of(_core.solve_paper(model._core, iterations=iterations, faces=faces, threads=threads))


def unscattered(model, *, iterations=30, faces="equal", threads=None, progress=None):
    """The method `paper` as if the body did not scatter, for comparison.

    Parameters
    ----------
    model, iterations, faces, threads, progress
        As of `paper`.

    Returns
    -------
    Solution

    Examples
    --------
    >>> solution = tf.unscattered(tf.Model("scenes/quick.yaml"), iterations=3)
    """
    with reporting(progress):
        return Solution._of(_core.solve_paper(model._core, iterations=iterations, faces=faces, scattered=False, threads=threads))


__all__ = ["Problem", "Solution", "Wave", "eigen", "field", "focus", "force", "gs", "gs_pat", "lbfgs", "optimality_bound", "paper",
           "scatter", "surface", "transfer", "unscattered", "wgs"]
