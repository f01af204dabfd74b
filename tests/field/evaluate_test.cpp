#include "sim/field/evaluate.h"

#include <algorithm>
#include <utility>

#include <gtest/gtest.h>

#include "sim/body/shapes.h"
#include "tests/support/far_field.h"

namespace touchfield {
namespace {

TransducerArray array_below() {
  ArrayLayout layout = grid_layout(4, 3, kAutd3Pitch);
  layout = transformed(layout, Eigen::Matrix3d::Identity(), Vector3(0.0, 0.0, -0.08));
  return make_array(layout, Directivity::t4010a1(), 1.0, kAutd3SourceStrength);
}

// The two ways to the same field; a box has many points whose distance is the limit itself.
TEST(Evaluate, FarAndNearFacesAreTheWholeField) {
  const TransducerArray array = array_below();
  const Eigen::MatrixXcd drive = support::many_drives(array.size(), 3);
  for (const auto& [mesh, absorption] :
       {std::pair(icosphere(8e-3, 6), 0.0), std::pair(box(Vector3(0.018, 0.012, 0.006), 1.5e-3).mesh, 3.0)}) {
    Medium medium = air(kRoomTemperature);
    medium.absorption = absorption;
    const Wave wave(medium, 40e3);
    const Eigen::MatrixXcd surface = support::skin_pressures(mesh, array, wave, drive);
    const Points points = support::points_about(mesh, 7);
    const FieldValues expected = evaluate_field(mesh, array, wave, points, surface, drive);
    const FarField far = support::reference_far_field(mesh, array, wave, points, surface, drive);
    const auto some_near = std::ranges::count_if(far.near, [](int near) { return near > 0; });
    EXPECT_GT(some_near, 0);
    EXPECT_LT(some_near, points.cols());
    const FieldValues found = with_near_faces(mesh, wave, points, surface, far.pressure, far.winding, far.near);
    EXPECT_EQ(found.inside, expected.inside);
    EXPECT_LT((found.pressure - expected.pressure).cwiseAbs().maxCoeff(),
              1e-11 * expected.pressure.cwiseAbs().maxCoeff());
  }
}

TEST(Evaluate, OfNoPointsIsNothing) {
  const TransducerArray array = array_below();
  const Wave wave(air(kRoomTemperature), 40e3);
  const TriangleMesh mesh = icosphere(8e-3, 2);
  const Eigen::MatrixXcd drive = support::many_drives(array.size(), 2);
  const Eigen::MatrixXcd surface = support::skin_pressures(mesh, array, wave, drive);
  const Points none(3, 0);
  EXPECT_EQ(evaluate_field(mesh, array, wave, none, surface, drive).pressure.rows(), 0);
  EXPECT_EQ(with_near_faces(mesh, wave, none, surface, Eigen::MatrixXcd(0, 2), {}, {}).inside.size(), 0U);
}

}  // namespace
}  // namespace touchfield
