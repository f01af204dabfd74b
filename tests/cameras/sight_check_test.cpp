#include <gtest/gtest.h>

#include "sim/cameras/seen_skin.h"

namespace touchfield::sight_check_test {

constexpr double kBaseline = 55e-3;

// A row of pixels: skin at 0.35 m on the left, nothing, then something at 0.3 m from column 40 on, which hides the 13
// columns before it from the second eye: 500 * 0.055 (1 / 0.3 - 1 / 0.35).
TEST(SightCheck, AHoleCountsUnlessTheSecondEyeDidNotSeeThere) {
  DepthCamera camera;
  camera.view.width = 64;
  camera.view.height = 9;
  camera.view.focal.setConstant(500);
  camera.view.centre << 32, 4.5;
  camera.view.near = 0.01;
  DepthFrame frame;
  frame.images = {{64, 9, std::vector<float>(64 * 9, 0.0F)}};
  for (std::size_t p = 0; p < frame.images[0].depth.size(); ++p) {
    frame.images[0].depth[p] = p % 64 < 4 ? 0.35F : p % 64 < 40 ? 0.0F : 0.3F;
  }
  const double columns[] = {1.5, 15.5, 22.5, 30.5, 36.5, 45.5};
  Points vertices(3, 6);
  for (Eigen::Index v = 0; v < 6; ++v) vertices.col(v) << 0.35 * (columns[v] - 32) / 500, 0, 0.35;
  const Points normals = Vector3(0, 0, -1).replicate(1, 6);
  SightCheck check;
  check_sight({camera}, frame, vertices, normals, 4e-3, kBaseline, check);
  Eigen::VectorXd confirmed(6);
  Eigen::VectorXd refuted(6);
  Eigen::VectorXd blank(6);
  confirmed << 1, 0, 0, 0, 0, 0;
  refuted.setZero();
  blank << 0, 1, 1, 0, 0, 0;
  EXPECT_EQ(check.confirmed, confirmed);
  EXPECT_EQ(check.refuted, refuted);
  EXPECT_EQ(check.blank, blank);
  EXPECT_DOUBLE_EQ(check.share(), 1.0);
  EXPECT_EQ(check.covered.sum(), 1);  // by what is nearer
  EXPECT_DOUBLE_EQ(check.evidence(), 1.0 / 4);
}

}  // namespace touchfield::sight_check_test
