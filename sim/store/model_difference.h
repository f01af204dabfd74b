#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/store/value_difference.h"
#include "sim/target/target.h"

/// How far apart the models of two runs are: mesh, array, target. `relative` is 0 for the same, infinite for parts that
/// do not correspond; `identical` is bit for bit.
namespace touchfield {

/// A text that two runs do not share; none where a run lacks it.
struct TextChange {
  std::string what;
  std::optional<std::string> a;
  std::optional<std::string> b;
};

/// Adds a change if the two texts differ.
void add_change(std::vector<TextChange>& changes, const std::string& what, const std::string& a, const std::string& b);

/// The motion that brings a's vertices nearest to b's, in the least squares' sense.
struct MeshMotion {
  Vector3 shift;        // of the vertices' mean [m]
  double angle = 0.0;   // of the rotation about it [rad], 0 to pi
  double residual = 0;  // largest distance that is left [m]
};

struct MeshDifference {
  bool identical = true;
  std::pair<Eigen::Index, Eigen::Index> faces;
  std::pair<Eigen::Index, Eigen::Index> vertices;
  bool same_triangles = true;
  std::optional<double> distance;  // largest of a vertex [m]; none: other numbers of vertices
  double relative = 0.0;           // that over the larger diagonal; infinite where the triangles differ
  std::optional<MeshMotion> motion;
};

MeshDifference compare_meshes(const TriangleMesh& a, const TriangleMesh& b);

struct ArrayDifference {
  bool identical = true;
  std::pair<Eigen::Index, Eigen::Index> channels;
  std::vector<TextChange> texts;   // kind, directivity
  bool same_numbering = true;      // devices and channels
  std::optional<double> distance;  // largest of a channel [m]; none: other numbers of channels
  std::optional<double> tilt;      // largest angle between axes [rad]
  NumbersDifference amplitudes;
  double relative = 0.0;  // the largest of all; a distance over the larger extent of the arrays
};

ArrayDifference compare_arrays(const TransducerArray& a, const TransducerArray& b);

struct TargetDifference {
  bool identical = true;
  std::pair<Eigen::Index, Eigen::Index> faces;       // 0: no target
  std::pair<Eigen::Index, Eigen::Index> only_faces;  // of one of them
  NumbersDifference amplitudes;                      // where the faces are the same
  double relative = 0.0;
};

TargetDifference compare_targets(const std::optional<Target>& a, const std::optional<Target>& b);

}  // namespace touchfield
