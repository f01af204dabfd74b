#!/usr/bin/python3
"""Pressure on a rigid prolate spheroid in a plane wave along its axis, by the method of fundamental solutions.

The scattered field is that of rings of point sources on a smaller confocal spheroid. Least squares finds their strengths, so that the
normal derivative of the total field vanishes on the surface. The focal points lie inside the source rings. The continued field is
singular there, so the residual falls exponentially with the number of rings. The output is the total pressure at 401 heights. Its
heading has the largest residual of the normal derivative over k at points between the matched ones, and the largest change of the
pressure when the rings are moved.

usage: tests/data/spheroid/make.py > tests/data/spheroid/axial.csv
"""

import math

import numpy

K = 2 * math.pi * 40e3 / 343.21
LONG, SHORT = 16e-3, 8e-3  # semi-axes along the travel and across [m]


def points(cosine, long, short):
    """Distance from the axis and height of points at these parameters."""
    return short * numpy.sqrt(1 - cosine**2), long * cosine


def ring_field(at, source, turns=256):
    """exp(ikr)/(4 pi r), averaged over rings of sources, and its gradient (radial, axial) at points of the half plane."""
    angle = 2 * math.pi * numpy.arange(turns) / turns
    value = numpy.zeros((len(at[0]), len(source[0])), complex)
    radial, axial = value.copy(), value.copy()
    rise = at[1][:, None] - source[1][None, :]
    for turn in angle:
        out = at[0][:, None] - source[0][None, :] * math.cos(turn)
        r = numpy.sqrt(out**2 + (source[0][None, :] * math.sin(turn))**2 + rise**2)
        g = numpy.exp(1j * K * r) / (4 * math.pi * r)
        slope = g * (1j * K - 1 / r) / r
        value += g
        radial += slope * out
        axial += slope * rise
    return value / turns, radial / turns, axial / turns


def normal_slope(cosine, radial, axial):
    outwards = numpy.stack([numpy.sqrt(1 - cosine**2) / SHORT, cosine / LONG])
    outwards /= numpy.linalg.norm(outwards, axis=0)
    return outwards[0][:, None] * radial + outwards[1][:, None] * axial


def middles(count):
    """Cosines of angles in the middles of equal steps."""
    return numpy.cos(math.pi * (numpy.arange(count) + 0.5) / count)


def solve(cosine, rings, roundness):
    """Pressure at these parameters, and the largest residual of the normal derivative over k."""
    focus = math.sqrt(LONG**2 - SHORT**2)
    source = points(middles(rings), focus * roundness, focus * math.sqrt(roundness**2 - 1))

    def slopes(at):
        _, radial, axial = ring_field(points(at, LONG, SHORT), source)
        incident = 1j * K * numpy.exp(1j * K * LONG * at)
        return normal_slope(at, radial, axial), normal_slope(at, 0 * incident[:, None], incident[:, None])[:, 0]

    matrix, incident = slopes(middles(4 * rings))
    strength = numpy.linalg.lstsq(matrix, -incident, rcond=1e-14)[0]
    matrix, incident = slopes(middles(4 * rings + 37))
    residual = numpy.abs(matrix @ strength + incident).max() / K
    value = ring_field(points(cosine, LONG, SHORT), source)[0]
    return value @ strength + numpy.exp(1j * K * LONG * cosine), residual


def main():
    cosine = numpy.linspace(-1, 1, 401)
    pressure, residual = solve(cosine, 60, 1.06)
    other, _ = solve(cosine, 70, 1.08)
    print(f"# semi-axes {1e3 * LONG} and {1e3 * SHORT} mm, k {K:.10g} rad/m, travel along +z; residual {residual:.1e}, "
          f"change with other rings {numpy.abs(pressure - other).max():.1e}")
    print("height_over_semi_axis,re,im")
    for c, p in zip(cosine, pressure):
        print(f"{c:.4f},{p.real:.10f},{p.imag:.10f}")


if __name__ == "__main__":
    main()
