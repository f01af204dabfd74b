#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/field/target.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/model/bodies.h"
#include "sim/scene/scene.h"

namespace touchfield {

struct Model;

/// What an array does: how its channels respond, and how finely it sets phases.
struct ArrayTruth {
  ChannelResponse response;
  int phase_levels = 0;  // phase levels to which phases are rounded; 0: they are not
};

/// The mesh an evaluation computes on, and how it corresponds to the one that was solved.
struct EvaluationMesh {
  TriangleMesh mesh;          // in the world's frame
  std::optional<int> splits;  // how often the faces of the solving mesh were split in four; none: a mesh of its own
  std::vector<int> owner{};   // M: number of the body a face is of, of a mesh of its own
};

/// What a run is evaluated on: mesh, scheme and channels. Built with the model, it stays while the bodies move.
struct Evaluation {
  enum class Kind {
    kNone,
    kSame,   // the model that is solved
    kTruth,  // its triangles and scheme: where the skin is and not where it is seen, with the channels that sound
    kEdge,   // the whole bodies meshed again: by edge lengths of the evaluation, or because keep_within cuts them
    kSplit,  // the solver's mesh with every face in four
  };
  Kind kind = Kind::kNone;
  Scheme scheme = kDefaultScheme;
  ArrayTruth channels;             // what sounds
  bool other_channels = false;     // whether the solver reckons with others
  std::optional<EdgeSpec> edge{};  // of kEdge; none: that of each body, which once split is at most
                                   // kCoarsestEvaluation wavelengths
  int splits = 0;                  // how often every face is split in four
  double whole_faces = 0;          // about, of the whole bodies where keep_within cuts one; else 0

  /// Whether a run is evaluated by a model other than the one that it solves.
  bool elsewhere() const { return kind != Kind::kNone && kind != Kind::kSame; }

  /// About how many faces the mesh has, without building it; 0 if the evaluation has no system of its own to solve.
  double faces(const Model& model) const;

  /// Edges per wavelength that `edge` takes on the target, in the box where they are fewest; infinite without it.
  double resolution(const Model& model, const Target& target) const;

  /// Builds the mesh. Bodies that are meshed again stand in the places of the model's own.
  /// throws   InputError as build_model; std::logic_error of kNone
  EvaluationMesh mesh(const Model& model, KeptBodies* kept = nullptr) const;
};

/// none, same, truth, edge or split.
std::string to_string(Evaluation::Kind kind);

/// The evaluation of a scene.
///
/// scene   its `auto` is decided here: the solving model where it has all that counts, finely enough; else whole
///         bodies, with edges that are a fifth shorter near the target
/// model   of the scene, without its evaluation
/// whole   the bodies that keep_within cut, before it did
Evaluation build_evaluation(Scene& scene, const Model& model, const std::vector<PlacedBodies::Whole>& whole);

/// The difference of pressures on a mesh from those on an evaluation's mesh of the same body, at the centroids of the
/// former:
///
///   sqrt( sum A |p - P(x)|^2 / sum A |P(x)|^2 )
///
/// P is the evaluation's pressure. On the same mesh it is that of the same face. On a mesh with split faces it is that
/// of the middle face of those that a face was split into. Where the evaluation has a mesh of its own, P is fitted to
/// the evaluation's faces around x (SurfaceFit). The sums are over the faces that are skin in both.
class EvaluationComparison {
 public:
  /// splits   how often the faces of `mesh` were split in four, 0 if not at all; none: a mesh of the evaluation's own
  /// skin     M: 1 where faces count; empty: everywhere
  /// Both meshes outlive this.
  EvaluationComparison(const TriangleMesh& mesh, const TriangleMesh& evaluation, std::optional<int> splits,
                       std::vector<unsigned char> skin = {});
  EvaluationComparison(const TriangleMesh&&, const TriangleMesh&, std::optional<int>,
                       std::vector<unsigned char> = {}) = delete;
  EvaluationComparison(const TriangleMesh&, const TriangleMesh&&, std::optional<int>,
                       std::vector<unsigned char> = {}) = delete;

  /// own      M x S [Pa];  evaluated   Mj x S [Pa]
  /// returns  S differences
  Eigen::VectorXd differences(const Eigen::MatrixXcd& own, const Eigen::MatrixXcd& evaluated) const;

  /// P at the mesh's centroids, M x S; 0 where faces do not count.
  Eigen::MatrixXcd at_centroids(const Eigen::MatrixXcd& evaluated) const;

 private:
  const TriangleMesh& mesh_;
  const TriangleMesh& evaluation_;
  std::optional<int> splits_;
  std::vector<Eigen::Index> counted_;  // faces
};

inline constexpr double kTargetReach = 15e-3;  // [m]

/// The target's surroundings: 1 on faces within kTargetReach of the centroid of a target face, M.
std::vector<unsigned char> target_surroundings(const TriangleMesh& mesh, const std::vector<Eigen::Index>& target_faces);

/// Area-weighted relative L2 difference of a from b.
double relative_difference(const Eigen::VectorXd& areas, const Eigen::VectorXcd& a, const Eigen::VectorXcd& b);

}  // namespace touchfield
