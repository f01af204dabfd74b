#pragma once

#include "sim/body/implicit_surface.h"
#include "sim/mesh/remesh/edge_sizing.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// A closed manifold of nearly equilateral triangles on the surface of a body. Inner cavities are filled.
///
/// sizing         wanted edge lengths: 99 % of the edges are 0.6 to 1.6 times as long as asked at their middles, and
///                the number of faces is that of equilateral ones of the lengths asked for within 6 %
/// coarsest_grid  spacing [m] at which the body is sampled first, if `far` of the sizing is not finer: details below
///                are lost, gaps wider stay open; finer zones only follow the surface more closely
/// The vertices stand off the surface by the mean sagitta of their faces, by 0.1 of the edge at most, so that area and
/// volume are those of the body to second order in edge over radius of curvature.
/// throws         NumericalError if the body falls into several pieces
TriangleMesh skin_mesh(const SoftBody& body, const EdgeSizing& sizing, double coarsest_grid);

/// The same with one edge length [m] everywhere, met by the mean edge within 2 %.
TriangleMesh skin_mesh(const SoftBody& body, double edge, double coarsest_grid);

}  // namespace touchfield
