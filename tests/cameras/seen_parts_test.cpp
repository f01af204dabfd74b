#include <random>

#include <gtest/gtest.h>

#include "sim/cameras/hand_search.h"
#include "tests/support/random_support.h"

namespace touchfield::seen_parts_test {

/// Points in boxes of these middles and sizes, mixed, their normals up.
HandPoints points_in(const std::vector<std::pair<Vector3, Vector3>>& boxes, int each) {
  std::mt19937 random(1);
  HandPoints points;
  const auto count = static_cast<Eigen::Index>(boxes.size()) * each;
  points.at.resize(3, count);
  points.normal = Vector3::UnitZ().replicate(1, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const auto& [middle, size] = boxes[static_cast<std::size_t>(i) % boxes.size()];
    points.at.col(i) = middle + 0.5 * size.cwiseProduct(point_in_cube(random));
  }
  return points;
}

TEST(SeenParts, ThinsToAPointACube) {
  const SkinSamples samples = thinned_evenly(points_in({{Vector3(0.04, -0.04, 0.004), {0.08, 0.08, 0.004}}}, 20000));
  EXPECT_EQ(samples.at.cols(), 100);
  for (Eigen::Index i = 0; i < samples.at.cols(); ++i) {  // about the cubes' middles
    EXPECT_LT((samples.at.col(i) / 8e-3 - (samples.at.col(i) / 8e-3).array().floor().matrix() - Vector3::Constant(0.5))
                  .cwiseAbs()
                  .maxCoeff(),
              0.2);
    EXPECT_EQ(samples.normal.col(i), Vector3::UnitZ());
  }
  EXPECT_EQ(samples.thinned(30).at.cols(), 34);
  EXPECT_EQ(samples.thinned(1000).at.cols(), 100);
}

TEST(SeenParts, PartsWhatIsApartWhereverTheOriginIs) {
  for (const Vector3& at : {Vector3(0, 0, 0), Vector3(-1.003, 0.517, 2.0), Vector3(0.007, -0.011, -0.3)}) {
    // Two plates 8 mm apart are one, a third one 40 mm beside them is not, and a crumb is nothing.
    const std::vector<SkinSamples> parts =
        parts_of(thinned_evenly(points_in({{at, {0.06, 0.1, 0.002}},
                                           {at + Vector3(0.068, 0, 0), {0.06, 0.1, 0.002}},
                                           {at + Vector3(0, 0.14, 0), {0.1, 0.1, 0.002}},
                                           {at + Vector3(0, -0.2, 0), {0.01, 0.01, 0.002}}},
                                          4000)));
    ASSERT_EQ(parts.size(), 2U);
    EXPECT_GT(parts[0].at.cols(), parts[1].at.cols());
    EXPECT_NEAR((parts[0].at.rowwise().mean() - at).x(), 0.034, 4e-3);
    EXPECT_NEAR((parts[1].at.rowwise().mean() - at).y(), 0.14, 4e-3);
  }
}

TEST(SeenParts, HandsAreTheWholeOrItsEnds) {
  const auto hands = [](double length) {
    return possible_hands(thinned_evenly(points_in({{Vector3::Zero(), {0.06, length, 0.02}}}, 20000)));
  };
  EXPECT_EQ(hands(0.1).size(), 1U);
  const std::vector<PossibleHand> arm = hands(0.4);
  ASSERT_EQ(arm.size(), 4U);
  for (const PossibleHand& hand : arm) {
    const double middle = hand.samples.at.row(1).mean();
    EXPECT_NE(hand.where, 0);
    EXPECT_EQ(middle > 0, arm[hand.where == 1 ? 0U : 2U].samples.at.row(1).mean() > 0);
    const Eigen::VectorXd along = hand.samples.at.row(1);
    const double length = along.maxCoeff() - along.minCoeff();
    EXPECT_TRUE(std::abs(length - 0.19) < 9e-3 || std::abs(length - 0.12) < 9e-3);
    EXPECT_NEAR(std::abs(middle) + length / 2, 0.2, 8e-3);
  }
  EXPECT_EQ(hands(0.2).size(), 1U + 2U);  // and the ends of a fist's length
  const Eigen::Matrix3d axes = principal_axes(arm.front().samples.at);
  EXPECT_NEAR(axes.determinant(), 1, 1e-12);
  EXPECT_GT(std::abs(axes(1, 1)), 0.99);
  EXPECT_GT(std::abs(axes(2, 2)), 0.99);
}

}  // namespace touchfield::seen_parts_test
