#include "sim/field/evaluate.h"

#include <algorithm>
#include <cmath>
#include <random>
#include <utility>

#include "sim/core/rigid_motion.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "tests/support/far_field.h"
#include "tests/support/testing.h"

namespace touchfield::evaluate_test {

TransducerArray array_below() {
  ArrayLayout layout = grid_layout(4, 3, kAutd3Pitch);
  layout = transformed(layout, Eigen::Matrix3d::Identity(), Vector3(0.0, 0.0, -0.08));
  return make_array(layout, Directivity::t4010a1(), 1.0, kAutd3SourceStrength);
}

// The two ways to the same field; a box has many points whose distance is the limit itself.
TEST(Evaluate, FarAndNearFacesAreTheWholeField) {
  const TransducerArray array = array_below();
  const Eigen::MatrixXcd drive = many_drives(array.size(), 3);
  for (const auto& [mesh, absorption] :
       {std::pair(icosphere(8e-3, 6), 0.0), std::pair(box(Vector3(0.018, 0.012, 0.006), 1.5e-3).mesh, 3.0)}) {
    Medium medium = air(kRoomTemperature);
    medium.absorption = absorption;
    const Wave wave(medium, 40e3);
    const Eigen::MatrixXcd surface = skin_pressures(mesh, array, wave, drive);
    const Points points = points_about(mesh, 7);
    const FieldValues expected = evaluate_field(mesh, array, wave, points, surface, drive);
    const FarField far = reference_far_field(mesh, array, wave, points, surface, drive);
    const auto some_near = std::ranges::count_if(far.near, [](int near) { return near > 0; });
    EXPECT_GT(some_near, 0);
    EXPECT_LT(some_near, points.cols());
    const FieldValues found = with_near_faces(mesh, wave, points, surface, far.pressure, far.winding, far.near);
    EXPECT_EQ(found.inside, expected.inside);
    EXPECT_LT((found.pressure - expected.pressure).cwiseAbs().maxCoeff(),
              1e-11 * expected.pressure.cwiseAbs().maxCoeff());
  }
}

/// Random pressures, on whose sums over faces nothing cancels, and such as a field makes.
Eigen::MatrixXcd two_pressures(const TriangleMesh& mesh, const TransducerArray& array, const Wave& wave) {
  std::mt19937 random(1);
  std::normal_distribution<double> normal;
  Eigen::MatrixXcd p(mesh.face_count(), 2);
  p << Eigen::VectorXcd::NullaryExpr(mesh.face_count(), [&] { return Complex(normal(random), normal(random)); }),
      skin_pressures(mesh, array, wave, many_drives(array.size(), 1));
  return p;
}

/// The same fields by a grid, which must be what is chosen, and pair by pair.
struct BothWays {
  FieldValues by_grid, direct;
};
BothWays both_ways(const TriangleMesh& mesh, const Wave& wave, const Points& points) {
  EXPECT_TRUE(choose_field_sums(mesh, wave, field_points(points, 2)).grid.has_value());
  const TransducerArray array = array_below();
  const Eigen::MatrixXcd surface = two_pressures(mesh, array, wave);
  const Eigen::MatrixXcd silent = Eigen::MatrixXcd::Zero(array.size(), 2);
  const FarField far = reference_far_field(mesh, array, wave, points, surface, silent);
  return {evaluate_field(mesh, array, wave, points, surface, silent),
          with_near_faces(mesh, wave, points, surface, far.pressure, far.winding, far.near)};
}

// Points in the body, just off its skin and far from it. Faces of the hand are so large that they are near beyond the
// reach of the local kernel.
TEST(Evaluate, AGridMakesTheSumsOverFaces) {
  HandOptions coarse;
  coarse.edge = 4.5e-3;
  for (const auto& [mesh, absorption] : {std::pair(icosphere(20e-3, 12), 3.0), std::pair(hand(coarse).mesh, 0.0)}) {
    Medium medium = air(kRoomTemperature);
    medium.absorption = absorption;
    const Points about = points_about(mesh, 8);
    const Vector3 low = mesh.vertices().rowwise().minCoeff();
    const Vector3 high = mesh.vertices().rowwise().maxCoeff();
    const Points points = about.cwiseMax(low.replicate(1, about.cols())).cwiseMin(high.replicate(1, about.cols()));
    const auto [by_grid, direct] = both_ways(mesh, Wave(medium, 40e3), points);
    EXPECT_EQ(by_grid.inside, direct.inside);
    const Eigen::MatrixXcd difference = by_grid.pressure - direct.pressure;
    for (Eigen::Index s = 0; s < 2; ++s) {
      const double size = direct.pressure.col(s).norm();
      EXPECT_LT(difference.col(s).norm(), 1.5 * kFieldTolerance * size);  // two-sided: a grid is what was used
      EXPECT_GT(difference.col(s).norm(), 0.03 * kFieldTolerance * size);
      EXPECT_LT(difference.col(s).cwiseAbs().maxCoeff(),
                10.0 * kFieldTolerance * size / std::sqrt(static_cast<double>(points.cols())));
    }
  }
}

// Planes in flat faces of a body that is turned: rounding puts their points on either side, on edges and corners too.
TEST(Evaluate, PointsOnTheSkinHaveItsPressure) {
  const Eigen::Matrix3d turn = extrinsic_rotation({0.3, -0.5, 0.2});
  const Vector3 size(0.048, 0.036, 0.024);
  const Vector3 shift(0.01, -0.02, 0.03);
  const TriangleMesh mesh = transformed(box(size, 1.5e-3).mesh, turn, shift);
  for (const double off : {0.0, 4e-8, -4e-8}) {
    Points points(3, 3 * 23 * 23);
    for (Eigen::Index j = 0; j < points.cols(); ++j) {
      const Eigen::Index axis = j / (23 * 23);
      Vector3 at = 0.5 * size;
      at((axis + 1) % 3) *= static_cast<double>(j % 23) / 11.0 - 1.0;
      at((axis + 2) % 3) *= static_cast<double>(j / 23 % 23) / 11.0 - 1.0;
      at(axis) += off;
      points.col(j) = turn * at + shift;
    }
    const Wave wave(air(kRoomTemperature), 40e3);
    const Eigen::MatrixXcd surface = two_pressures(mesh, array_below(), wave);
    const auto [by_grid, direct] = both_ways(mesh, wave, points);
    for (const FieldValues* found : {&by_grid, &direct}) {
      EXPECT_EQ(std::ranges::count(found->inside, 0), points.cols()) << off;
      for (Eigen::Index j = 0; j < points.cols(); ++j) {
        Eigen::Index face = 0;
        EXPECT_EQ((surface.rowwise() - found->pressure.row(j)).rowwise().norm().minCoeff(&face), 0.0)
            << off << " " << j;
        EXPECT_LT(FaceTree(TriangleMesh(mesh.vertices(), mesh.triangles().col(face))).nearest(points.col(j)).distance,
                  1e-7);
      }
    }
  }
}

TEST(FieldGrid, APlaneHasBothBordersAndOneLayer) {
  const FieldGrid grid = centred_grid("side", {0, 0, 0.2}, {0.12, 0.0, 0.24}, 1e-3);
  EXPECT_EQ(grid.count, (std::array<int, 3>{121, 1, 241}));
  const Points x = grid.points();
  EXPECT_EQ(x.cols(), grid.size());
  EXPECT_LT((x.col(0) - Vector3(-0.06, 0, 0.08)).norm(), 1e-15);
  EXPECT_LT((x.col(1) - Vector3(-0.059, 0, 0.08)).norm(), 1e-15);  // x fastest
  EXPECT_LT((x.col(x.cols() - 1) - Vector3(0.06, 0, 0.32)).norm(), 1e-14);
}

TEST(FieldGrid, SpacingShrinksToFitTheSize) {
  const FieldGrid grid = centred_grid("cube", Vector3::Zero(), {0.01, 0.01, 0.01}, 3e-3);
  EXPECT_EQ(grid.count, (std::array<int, 3>{5, 5, 5}));
  EXPECT_DOUBLE_EQ(grid.spacing.x(), 2.5e-3);
}

}  // namespace touchfield::evaluate_test
