#pragma once

#include <functional>

#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The same surface without faces so thin that their normals mean nothing: edges shorter than `thinnest` are collapsed
/// into one of their ends, and the longest edges of flat faces whose height over them is less are flipped. Faces that
/// are thicker turn by 10 degrees at a time at most, and nothing moves by more than `thinnest`. What cannot be had so
/// stays.
///
/// mesh       closed, manifold, oriented
/// thinnest   [m] at points
/// returns    a mesh on some of the vertices, closed and of the same genus
TriangleMesh without_splinters(const TriangleMesh& mesh, const std::function<Eigen::VectorXd(const Points&)>& thinnest);

}  // namespace touchfield
