"""Pressure on a rigid sphere at 40 kHz in air at 20 C, by the series; time factor exp(-i omega t)."""

import math

import numpy
from support import faces, relative_l2

SPEED = 343.21
K = 2 * math.pi * 40e3 / SPEED


def hankel(order, x):
    """h_0 ... h_order, by upward recurrence: stable, since h_n is dominated by its growing part."""
    h = [-1j * numpy.exp(1j * x) / x, -(1 + 1j / x) * numpy.exp(1j * x) / x]
    for n in range(1, order):
        h.append((2 * n + 1) / x * h[n] - h[n - 1])
    return h


def legendre(order, x):
    p = [numpy.ones_like(x), x]
    for n in range(1, order):
        p.append(((2 * n + 1) * x * p[n] - n * p[n - 1]) / (n + 1))
    return p


def surface_factor(h, n, ka):
    return 1j / (ka**2 * (n / ka * h[n] - h[n + 1]))


def terms(ka):
    """Beyond ka the terms fall off faster than any power: 35 more leave less than 1e-12 up to ka 30."""
    return int(ka) + 35


def point_source(radius, distance, cosine):
    """p of g = exp(ikr)/(4 pi r) at `distance` on a sphere's surface; cosine from the source's direction."""
    ka, order = K * radius, terms(K * radius)
    near, far, p = hankel(order + 2, ka), hankel(order + 1, K * distance), legendre(order + 1, cosine)
    return 1j * K / (4 * math.pi) * sum(
        (2 * n + 1) * far[n] * p[n] * surface_factor(near, n, ka) for n in range(order))


def plane_wave(radius, cosine):
    ka, order = K * radius, terms(K * radius)
    near, p = hankel(order + 2, ka), legendre(order + 1, cosine)
    return sum((2 * n + 1) * 1j**n * p[n] * surface_factor(near, n, ka) for n in range(order))


def plane_wave_errors(run, radius, methods):
    """Relative L2 of the complex pressure of a run's methods on a sphere at the origin, in a wave of 1 Pa along z."""
    centroid, area = faces(run)
    exact = plane_wave(radius, centroid[:, 2] / numpy.linalg.norm(centroid, axis=1))
    return {method: relative_l2(area, run[f"methods/{method}/pressure"][:], exact) for method in methods}
