#pragma once

#include "sim/hand/implicit_surface.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Longest edge over the thickness of the body and the width of a cleft. Measured on hands with far edges of 12 mm:
/// with 0.45 the fingers keep their volume within 4 %, with 0.55 they lose up to 8 %, without a bound up to 54 %.
/// Without a bound in clefts, 24 of 60 poses that such a mesh is carried to cut themselves; with it 3.
inline constexpr double kOfRoom = 0.45;
/// Edges that are met however little room there is [m]: skin that closes a cleft may be of any thickness.
inline constexpr double kAlwaysPossible = 5e-3;

/// A closed manifold of nearly equilateral triangles on the surface of a body. Inner cavities are filled.
///
/// Edges above kAlwaysPossible are at most kOfRoom times as long as the body is thick there, and as the air before it
/// is wide. So no thin part becomes a prism or is lost, and clefts stay clear.
///
/// The vertices stand off the surface by the mean sagitta of their faces, by 0.1 of the edge at most. So area and
/// volume are those of the body to second order in edge over radius of curvature.
///
/// sizing         wanted edge lengths: 99 % of the edges are 0.6 to 1.6 times as long as asked at their middles. The
///                number of faces is that of equilateral ones of the lengths asked for within 6 %
/// coarsest_grid  spacing [m] at which the body is sampled first, if `far` of the sizing is not finer: details below
///                are lost, gaps wider stay open; finer zones only follow the surface more closely
/// throws         NumericalError if the body falls into several pieces
TriangleMesh skin_mesh(const SoftBody& body, const EdgeSizing& sizing, double coarsest_grid);

/// The same with one edge length [m] everywhere, met by the mean edge within 2 %.
TriangleMesh skin_mesh(const SoftBody& body, double edge, double coarsest_grid);

}  // namespace touchfield
