"""Compares fast sequences of patterns with one pattern.

Skin that feels the mean square over a sequence of T patterns receives |h_j q|^2 averaged over T. The cost is that of `surface` with
the root of this mean in place of |h_j q|. A single pattern is the case T = 1. The optimality bound holds for both (docs/theory.md).
"""

import dataclasses
import pathlib

import h5py
import numpy
import scipy.optimize

from runs import table, write_table

FRAMES = [1, 2, 4, 8, 16]
STEPS = 400


@dataclasses.dataclass
class Problem:
    """Transfer matrix [Pa] and wanted pressure of a run. `bound` is NaN if the run has no optimality bound."""

    target: numpy.ndarray  # [K, N]
    outside: numpy.ndarray  # [r, N]
    weight: numpy.ndarray  # [K]
    wanted: numpy.ndarray  # [K]
    surface: float  # cost of method surface [Pa2 m2]
    bound: float


def read(folder):
    with h5py.File(pathlib.Path(folder) / "run.h5") as run:
        transfer, = run["transfer"].values()
        known = run["methods/surface"].attrs
        return Problem(*(transfer[name][:] for name in ("target", "outside", "weight")), run["target/amplitude"][:],
                       float(known["cost"]), float(known["cost_bound"]))


def cost_and_slope(problem, phase):
    """Cost of a sequence with phases [N, T], and its derivatives with respect to the phases."""
    drives = numpy.exp(1j * phase) / numpy.sqrt(phase.shape[1])
    loud, rest = problem.target @ drives, problem.outside @ drives
    root = numpy.sqrt((numpy.abs(loud) ** 2).sum(axis=1))
    misfit = root - problem.wanted
    cost = (problem.weight * misfit**2).sum() + (numpy.abs(rest) ** 2).sum()
    pull = (problem.weight * misfit / numpy.maximum(root, 1e-300))[:, None] * loud
    slope = problem.target.conj().T @ pull + problem.outside.conj().T @ rest
    return cost, 2 * numpy.imag(drives.conj() * slope)


def least(problem, frames, seed, steps=STEPS):
    """Least cost that limited-memory BFGS finds from random phases, and the phases [N, T] of this sequence."""
    shape = problem.target.shape[1], frames
    start = numpy.random.default_rng([seed, frames]).uniform(0, 2 * numpy.pi, shape)
    scale = (problem.weight * problem.wanted**2).sum()

    def of(flat):
        cost, slope = cost_and_slope(problem, flat.reshape(shape))
        return cost / scale, slope.ravel() / scale

    found = scipy.optimize.minimize(of, start.ravel(), jac=True, method="L-BFGS-B",
                                    options={"maxiter": steps, "maxfun": 2 * steps, "maxcor": 20, "ftol": 1e-12, "gtol": 1e-10})
    return found.fun * scale, found.x.reshape(shape)


def rows(problem, frames=FRAMES, steps=STEPS):
    """One row per number of frames: cost, misfit, relative distance from the bound."""
    silence = (problem.weight * problem.wanted**2).sum()
    found = []
    for count in frames:
        cost = least(problem, count, 1, steps)[0]
        found.append({"frames": count, "starts": 1, "cost_pa2m2": f"{cost:.9g}", "worst_start_pa2m2": f"{cost:.9g}",
                      "misfit": f"{numpy.sqrt(cost / silence):.6f}", "above_bound": f"{cost / problem.bound - 1:.6g}",
                      "bound_pa2m2": f"{problem.bound:.9g}", "surface_cost_pa2m2": f"{problem.surface:.9g}",
                      "surface_misfit": f"{numpy.sqrt(problem.surface / silence):.6f}",
                      "surface_above_bound": f"{problem.surface / problem.bound - 1:.6g}",
                      "target_rows": len(problem.target), "outside_rows": len(problem.outside), "channels": problem.target.shape[1]})
    return found


def kept_rows(work, quick, origin):
    """The rows. They are computed again only if the run is newer than the kept table."""
    run, kept = work / "panels/width_8mm/run.h5", work / "sequences.csv"
    if not kept.exists() or kept.stat().st_mtime < run.stat().st_mtime:
        problem = read(run.parent)
        write_table(kept, rows(problem, FRAMES[:2], 60) if quick else rows(problem), origin)
    return table(kept)
