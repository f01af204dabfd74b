"""The methods that find phases from a transfer matrix and a target."""

import numpy as np

from . import _core
from ._plain import new_arguments, require
from ._progress import reporting


def _solved(method, h, target, outside_weight, threads, progress, **options):
    problem = h if isinstance(h, _core.Problem) else _core.Problem.of(h, target, outside_weight, threads)
    with reporting(progress):
        return _core._solve(method, problem, threads=threads, **options)


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


def radiation(h, target=None, *, iterations=1000, start=None, free_amplitudes=False, free_level=True, tolerances=None, outside_weight=0.1,
              wave=None, threads=None, progress=None):
    """Minimises the misfit of the radiation pressure on the skin, which is what the skin feels, by limited-memory BFGS.

    Parameters
    ----------
    h : array_like of complex, shape (M, N), or RadiationProblem
        The transfer matrix of every face.
    target : Target
        Not needed with a `RadiationProblem`.
    iterations : int
        Most steps. It ends before where the cost stands still.
    start : array_like of complex, shape (N,) or (N, S), or Solution, optional
        One or several starts, of which the best continues. Default: three, one of the target and two random ones.
    free_amplitudes, free_level
        As of `surface`.
    tolerances : dict, optional
        As of `surface`: the cost of the expected radiation pressure is minimised.
    outside_weight : float
        Weight of the energy of the skin outside the target.
    wave : Wave, optional
        That of H. Default: 40 kHz at 20 degrees C.
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
    >>> solution = tf.radiation(tf.transfer(ball, array), target, iterations=10)
    """
    problem = h if isinstance(h, _core.RadiationProblem) else _core.RadiationProblem.of(h, target, outside_weight, wave, threads)
    with reporting(progress):
        return _core._radiation(problem, iterations=iterations, start=start, free_amplitudes=free_amplitudes, free_level=free_level,
                                tolerances=tolerances or {}, threads=threads)


def optimality_bound(problem, threads=None, start=None):
    """The optimality bound: a proved lower bound of the cost over all drive vectors.

    Parameters
    ----------
    problem : Problem or RadiationProblem
    threads : int, optional
    start : array_like of complex, shape (N,), or Solution, optional
        Of a `RadiationProblem`: drives near which the bound is sought, best those of `radiation`. Default: they are computed.

    Returns
    -------
    dict
        `bound` in the unit of the cost, `relaxed`, `iterations`, `converged`.

    Examples
    --------
    >>> problem = tf.Problem([[1, 1j], [1j, 1], [1, 1]], [1, 1, 0.1], [1, 1, 1])
    >>> tf.optimality_bound(problem)["bound"] <= problem.cost(tf.surface(problem))
    True
    """
    if isinstance(problem, _core.RadiationProblem):
        return _core._radiation_bound(problem, radiation(problem, threads=threads) if start is None else start, threads)
    require(problem, _core.Problem, "problem")
    return _core._bound(problem, threads)


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
    require(target, _core.Target, "target")
    row = target.centre if len(h) != len(target) else int(np.searchsorted(target.faces, target.centre))
    return _core._focus(np.asarray(h)[row])
