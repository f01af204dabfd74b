#pragma once

#include <numbers>

#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

constexpr double kCreaseAngle = 50.0 / 180.0 * std::numbers::pi;  // [rad]

/// A closed surface of any triangles, meshed again with nearly equilateral faces of the wanted size: the remesher of
/// remesh.h, projecting on the original's flat triangles. The shape stays as it is given: nothing is rounded, a coarse
/// original keeps its facets.
///
/// original       closed, manifold, oriented outwards; of any triangles, coarse, fine, thin or mixed; several pieces
///                are allowed
/// crease_angle   edges whose faces' normals are more than this apart stay sharp, e.g. the rims of caps [rad], > 0; pi:
///                none. Vertices on them move along them only, and where creases meet, turn by as much or come to a
///                point a vertex stays; see creases.h
/// returns        a closed, manifold, oriented mesh with as many pieces and holes through them. Off creases its
///                vertices stand off the original by the mean distance that their faces cut below it (0.1 edges at
///                most), so that area and volume are the original's to second order in edge over radius of curvature;
///                flat sides stay exactly flat. Angles are above 15 degrees but between creases that are nearer than
///                half an edge to each other, or meet at less. Where faces next to flat are left, or faces cut each
///                other, it is meshed again: first without creases about the place, then with shorter edges there
/// limits         a part thinner than its edges loses its shape: see thickness in inspect.h
/// throws         InputError if the original is not closed, manifold and oriented, the angle is out of range, or the
///                sizing asks for more than 5 million faces
///                RemeshError, with the place and an edge to use, if a face without area is left or the volume changes
///                by more than a tenth: the edges are too long for the shape, or the body is a sheet without thickness
TriangleMesh remeshed_surface(const TriangleMesh& original, const EdgeSizing& sizing,
                              double crease_angle = kCreaseAngle);

/// Of the faces round each vertex.
struct VertexMeans {
  explicit VertexMeans(const TriangleMesh& mesh);

  Points normals;         // 3 x V unit vectors, means by area; 0 where there are no faces
  Eigen::VectorXd areas;  // V [m2], of them all: thrice a vertex' share of the skin
};

/// A mesh with its vertices moved off the surface that it is inscribed in. Each moves by the mean distance by which its
/// faces cut below the surface. Area and volume are then the surface's to second order in edge over radius of
/// curvature.
///
/// heights   mean height of the surface above each face along its normal [m]
/// most      no vertex is moved farther [m]; 0 for those that stay
TriangleMesh with_mean_height_zero(const TriangleMesh& mesh, const Eigen::VectorXd& heights,
                                   const Eigen::VectorXd& most);

}  // namespace touchfield
