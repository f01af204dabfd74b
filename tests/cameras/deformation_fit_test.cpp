#include <random>

#include "sim/cameras/deformation.h"
#include "sim/cameras/seen_skin.h"
#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/query/face_tree.h"
#include "tests/support/random_support.h"
#include "tests/support/sight_support.h"
#include "tests/support/testing.h"

namespace touchfield::deformation_fit_test {

constexpr DeformationPriors kRigidOnly{.rigid = 1, .rest = 0, .before = 0};

/// A body without symmetry that no plane constraint leaves free.
const TriangleMesh& pebble() {
  static const TriangleMesh kMesh = [] {
    Points vertices = capsule(20e-3, 60e-3, 4e-3).mesh.vertices();
    vertices.row(2) *= 0.6;
    vertices.row(0) += (8 * vertices.row(1).array().square()).matrix();
    return TriangleMesh(vertices, capsule(20e-3, 60e-3, 4e-3).mesh.triangles());
  }();
  return kMesh;
}

DeformationFit pebble_fit() { return DeformationFit(DeformationGraph(pebble(), 9e-3)); }

/// The centroids of the faces of which keep(centroid) holds, each to come to the plane of the same face moved.
template <class Keep>
SkinTargets face_targets(const TriangleMesh& from, const TriangleMesh& to, const Keep& keep) {
  std::vector<Eigen::Index> faces;
  SkinTargets targets;
  for (Eigen::Index f = 0; f < from.face_count(); ++f) {
    if (keep(Vector3(from.centroids().col(f)))) {
      faces.push_back(f);
      targets.skin.face.push_back(static_cast<int>(f));
    }
  }
  targets.skin.weights = Points::Constant(3, static_cast<Eigen::Index>(faces.size()), 1.0 / 3);
  targets.at = from.centroids()(Eigen::all, faces);
  targets.target = to.centroids()(Eigen::all, faces);
  targets.normal = to.normals()(Eigen::all, faces);
  targets.weight = Eigen::VectorXd::Ones(targets.at.cols());
  return targets;
}

const auto kAll = [](const Vector3&) { return true; };

RigidMotion small_motion() { return {extrinsic_rotation(Vector3(6, -4, 8) * kDegree), Vector3(3e-3, -5e-3, 4e-3)}; }

TriangleMesh moved_by(const TriangleMesh& mesh, const RigidMotion& motion) {
  return transformed(mesh, motion.rotation, motion.shift);
}

TEST(DeformationFit, ReproducesARigidMotionOfWhatIsSeenAlsoWhereNothingIs) {
  DeformationFit fit = pebble_fit();
  const RigidMotion motion = small_motion();
  for (const bool whole : {true, false}) {
    const SkinTargets targets =
        face_targets(pebble(), moved_by(pebble(), motion), [&](const Vector3& x) { return whole || x.y() < 0.01; });
    NodeMotions motions = fit.graph().motions(pebble().vertices(), {});
    for (int call = 0; call < 12; ++call) fit.fit(targets, kRigidOnly, {}, 2, motions);
    Points vertices = pebble().vertices();
    fit.graph().apply(motions, vertices);
    EXPECT_LT((vertices - motion(pebble().vertices())).cwiseAbs().maxCoeff(), 1e-8);
    EXPECT_LT(fit.linearise(targets, kRigidOnly, {}, motions).energy, 1e-16);
  }
}

TEST(DeformationFit, GradientIsThatOfTheEnergy) {
  DeformationFit fit = pebble_fit();
  std::mt19937 random(1);
  const auto some_shifts = [&] {
    Points shifts(3, fit.graph().node_count());
    for (auto shift : shifts.colwise()) shift = 1e-3 * point_in_cube(random);
    return shifts;
  };
  const Points before = some_shifts();
  const NodeMotions motions = fit.graph().motions(pebble().vertices(), some_shifts());
  SkinTargets targets = face_targets(pebble(), moved_by(pebble(), small_motion()), kAll);
  for (double& weight : targets.weight) weight = uniform(random, 0, 2);
  const DeformationPriors priors{.rigid = 0.7, .rest = 0.3, .before = 0.2};
  const Eigen::VectorXd gradient = fit.linearise(targets, priors, before, motions).gradient;
  constexpr double kStep = 1e-5;
  for (int trial = 0; trial < 20; ++trial) {
    const auto i = static_cast<Eigen::Index>(uniform(random, 0, 1) * static_cast<double>(gradient.size()));
    NodeMotions more = motions;
    NodeMotions less = motions;
    more.shift(i % 3, i / 3) += kStep;
    less.shift(i % 3, i / 3) -= kStep;
    const double slope =
        (fit.linearise(targets, priors, before, more).energy - fit.linearise(targets, priors, before, less).energy) /
        (2 * kStep);
    EXPECT_NEAR(2 * gradient(i), slope, 1e-7 * gradient.norm());
  }
}

TEST(DeformationFit, PriorsHoldWhatNothingIsSeenOf) {
  DeformationFit fit = pebble_fit();
  const SkinTargets none = face_targets(pebble(), pebble(), [](const Vector3&) { return false; });
  const Points before = Points::Constant(3, fit.graph().node_count(), 1e-3);
  NodeMotions motions = fit.graph().motions(pebble().vertices(), before);
  EXPECT_EQ(fit.fit(none, {.rigid = 0, .rest = 0, .before = 1}, before, 2, motions), 0);
  EXPECT_LT((DeformationGraph::shifts(motions) - before).cwiseAbs().maxCoeff(), 1e-15);
  fit.fit(none, {.rigid = 0, .rest = 1, .before = 1}, before, 2, motions);
  EXPECT_LT((DeformationGraph::shifts(motions) - 0.5 * before).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_THROW(fit.fit(none, {.rigid = 0, .rest = 0, .before = 0}, before, 1, motions), NumericalError);
}

}  // namespace touchfield::deformation_fit_test
