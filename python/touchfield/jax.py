"""Pressures and costs as functions that JAX differentiates, compiles and maps. `import touchfield.jax` needs JAX.

Drives are arrays of complex128, so that `jax_enable_x64` must be set. As in all of JAX, the gradient of a real function of complex
drives is dL/d Re q - i dL/d Im q, the conjugate of PyTorch's. Second derivatives and forward mode are not there."""

from functools import partial

import jax
import jax.numpy as jnp
import numpy as np


def _called(function, shape, dtype, drives):
    if drives.dtype != jnp.complex128:
        raise TypeError(f"drives must be complex128, not {drives.dtype}; JAX needs jax.config.update('jax_enable_x64', True) for that")
    result = jax.ShapeDtypeStruct(shape, dtype)
    return jax.pure_callback(lambda value: np.asarray(function(np.asarray(value)), dtype), result, drives, vmap_method="sequential")


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def pressure(scattering, drives):
    """Pressures on the skin, ``scattering @ drives``. With H itself `jax.dlpack.from_dlpack(h) @ drives` does it.

    Parameters
    ----------
    scattering : Scattering
    drives : jax.Array of complex128, shape (N,) or (N, S)

    Returns
    -------
    jax.Array of complex128, shape (M,) or (M, S)
        [Pa]
    """
    return _called(scattering.matvec, (scattering.shape[0], *drives.shape[1:]), complex, drives)


@partial(jax.custom_vjp, nondiff_argnums=(0,))
def cost(problem, drives):
    """The cost of a Problem or a RadiationProblem.

    Parameters
    ----------
    problem : Problem or RadiationProblem
    drives : jax.Array of complex128, shape (N,)

    Returns
    -------
    jax.Array of float64, shape ()
    """
    return _called(problem.cost, (), float, drives)


def _pressure_back(scattering, _, slope):
    return (_called(scattering.rmatvec, (scattering.shape[1], *slope.shape[1:]), complex, slope.conj()).conj(),)


def _cost_back(problem, drives, slope):
    return (slope * _called(problem.gradient, drives.shape, complex, drives).conj(),)


pressure.defvjp(lambda scattering, drives: (pressure(scattering, drives), None), _pressure_back)
cost.defvjp(lambda problem, drives: (cost(problem, drives), drives), _cost_back)
