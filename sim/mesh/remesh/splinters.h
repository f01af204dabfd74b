#pragma once

#include <functional>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The same surface without splinters: faces so thin that their normals mean nothing. Edges shorter than `thinnest` are
/// collapsed into one of their ends. The longest edge of a face is flipped if the face's height over it is less than
/// `thinnest`. Thicker faces turn by at most 10 degrees at a time, and nothing moves by more than `thinnest`. Splinters
/// that cannot be removed in this way stay.
///
/// mesh       closed, manifold, oriented
/// thinnest   [m] at points
/// returns    a mesh on some of the vertices, closed and of the same genus
TriangleMesh without_splinters(const TriangleMesh& mesh, const std::function<Eigen::VectorXd(const Points&)>& thinnest);

}  // namespace touchfield
