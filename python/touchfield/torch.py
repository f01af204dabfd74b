"""Pressures and costs as functions that PyTorch differentiates. `import touchfield.torch` needs PyTorch.

Drives are tensors of complex128 on the processor. As in all of PyTorch, the gradient of a complex leaf is dL/d Re q + i dL/d Im q.
Second derivatives are not there."""

import torch
from torch.autograd.function import once_differentiable


def _numpy(tensor):
    if tensor.dtype != torch.complex128 or tensor.device.type != "cpu":
        raise TypeError(f"drives must be complex128 on the processor, not {tensor.dtype} on {tensor.device}: use drives.to('cpu', torch.complex128)")
    return tensor.detach().resolve_conj().resolve_neg().numpy()


class _Pressure(torch.autograd.Function):
    @staticmethod
    def forward(ctx, scattering, drives):
        ctx.scattering = scattering
        return torch.from_numpy(scattering @ _numpy(drives))

    @staticmethod
    @once_differentiable
    def backward(ctx, slope):
        return None, torch.from_numpy(ctx.scattering.rmatvec(_numpy(slope)))


class _Cost(torch.autograd.Function):
    @staticmethod
    def forward(ctx, problem, drives):
        ctx.problem, ctx.drives = problem, _numpy(drives).copy()
        return torch.tensor(problem.cost(ctx.drives), dtype=torch.float64)

    @staticmethod
    @once_differentiable
    def backward(ctx, slope):
        return None, slope * torch.from_numpy(ctx.problem.gradient(ctx.drives))


def pressure(scattering, drives):
    """Pressures on the skin, ``scattering @ drives``. With H itself `torch.from_dlpack(h) @ drives` does it.

    Parameters
    ----------
    scattering : Scattering
    drives : torch.Tensor of complex128, shape (N,) or (N, S)

    Returns
    -------
    torch.Tensor of complex128, shape (M,) or (M, S)
        [Pa]
    """
    return _Pressure.apply(scattering, drives)


def cost(problem, drives):
    """The cost of a Problem or a RadiationProblem.

    Parameters
    ----------
    problem : Problem or RadiationProblem
    drives : torch.Tensor of complex128, shape (N,)

    Returns
    -------
    torch.Tensor of float64, shape ()
    """
    return _Cost.apply(problem, drives)
