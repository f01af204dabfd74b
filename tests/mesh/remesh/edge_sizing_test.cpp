#include <cmath>
#include <cstdint>
#include <limits>
#include <random>
#include <vector>

#include "sim/mesh/remesh/mesh_quality.h"
#include "tests/support/testing.h"

namespace touchfield::edge_sizing_test {

constexpr double kInfinity = std::numeric_limits<double>::infinity();

double uniform(std::mt19937_64& random, double least, double most) {
  return least + (most - least) * static_cast<double>(random() >> 11) / 9007199254740992.0;  // 2^53
}

Vector3 random_point(std::mt19937_64& random, double reach) {
  return {uniform(random, -reach, reach), uniform(random, -reach, reach), uniform(random, -reach, reach)};
}

TEST(EdgeSizing, IsFarAwayFromEveryZone) {
  const EdgeSizing uniform_sizing(3e-3);
  EXPECT_EQ(uniform_sizing.at(Vector3(1, 2, 3)), 3e-3);
  EXPECT_EQ(uniform_sizing.finest(), 3e-3);
  const EdgeSizing graded(3e-3, {{Vector3::Zero(), 1e-3, 10e-3}});
  EXPECT_EQ(graded.at(Vector3(1, 0, 0)), 3e-3);
}

TEST(EdgeSizing, IsTheZonesInsideAndGrowsOutsideIt) {
  const Vector3 centre(0.01, -0.02, 0.03);
  const EdgeSizing sizing(3e-3, {{centre, 1e-3, 10e-3}}, 0.25);
  const Vector3 along = Vector3(1, 2, -2) / 3.0;
  EXPECT_EQ(sizing.at(centre), 1e-3);
  EXPECT_NEAR(sizing.at(Vector3(centre + 9.99e-3 * along)), 1e-3, 1e-15);
  EXPECT_NEAR(sizing.at(Vector3(centre + 14e-3 * along)), 1e-3 + 0.25 * 4e-3, 1e-15);
  EXPECT_NEAR(sizing.at(Vector3(centre + 17.9e-3 * along)), 1e-3 + 0.25 * 7.9e-3, 1e-15);
  EXPECT_EQ(sizing.at(Vector3(centre + 18.1e-3 * along)), 3e-3);
  EXPECT_EQ(sizing.finest(), 1e-3);
}

TEST(EdgeSizing, TakesTheFinestOfItsZonesAndNeverExceedsFar) {
  const EdgeSizing sizing(
      3e-3, {{Vector3(0, 0, 0), 2e-3, 10e-3}, {Vector3(5e-3, 0, 0), 1e-3, 1e-3}, {Vector3(1, 0, 0), 5e-3, 1}}, 0.2);
  EXPECT_EQ(sizing.at(Vector3(5e-3, 0, 0)), 1e-3);
  EXPECT_EQ(sizing.at(Vector3(-9e-3, 0, 0)), 2e-3);
  EXPECT_NEAR(sizing.at(Vector3(8e-3, 0, 0)), 1e-3 + 0.2 * 2e-3, 1e-15);
  EXPECT_EQ(sizing.at(Vector3(1, 0, 0)), 3e-3);
  EXPECT_EQ(sizing.finest(), 1e-3);
  EXPECT_EQ(EdgeSizing(1e-3, {{Vector3::Zero(), 2e-3, 1e-3}}).finest(), 1e-3);
}

// |h(x) - h(y)| <= growth |x - y|: what makes neighbouring faces alike.
TEST(EdgeSizing, ChangesByNoMoreThanItsGrowth) {
  std::mt19937_64 random(4);
  for (const double growth : {0.02, 0.2, 0.6}) {
    std::vector<SizingZone> zones;
    for (int i = 0; i < 5; ++i) {
      zones.push_back({random_point(random, 0.05), uniform(random, 0.5e-3, 3e-3), uniform(random, 0, 20e-3)});
    }
    const EdgeSizing sizing(4e-3, zones, growth);
    double steepest = 0;
    for (int i = 0; i < 2000; ++i) {
      const Vector3 x = random_point(random, 0.1);
      const Vector3 y = x + random_point(random, 2e-3);
      const double slope = std::abs(sizing.at(x) - sizing.at(y)) / (x - y).norm();
      EXPECT_LE(slope, growth * (1 + 1e-9));
      steepest = std::max(steepest, slope);
    }
    EXPECT_GT(steepest, 0.9 * growth) << "and it does grow";
  }
}

TEST(EdgeSizing, AnswersForManyPointsAsForOne) {
  std::mt19937_64 random(7);
  const EdgeSizing sizing(3e-3, {{Vector3::Zero(), 1e-3, 5e-3}});
  Points points(3, 50);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    points.col(i) = random_point(random, 0.03);
  }
  const Eigen::VectorXd edges = sizing.at(points);
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    EXPECT_EQ(edges(i), sizing.at(Vector3(points.col(i))));
  }
  EXPECT_EQ(sizing.at(Points(3, 0)).size(), 0);
}

TEST(EdgeSizing, RefusesWhatIsNoLength) {
  const Vector3 zero = Vector3::Zero();
  for (const double bad : {0.0, -1e-3, kInfinity, std::nan("")}) {
    EXPECT_THAT([&] { EdgeSizing{bad}; }, ThrowsMessage<InputError>(HasSubstr("edge_mm.far"))) << bad;
    EXPECT_THAT(
        [&] {
          EdgeSizing(1e-3, {{zero, bad, 1e-3}});
        },
        ThrowsMessage<InputError>(HasSubstr("edge_mm.near_target")))
        << bad;
  }
  for (const double bad : {-1e-3, kInfinity, std::nan("")}) {
    EXPECT_THAT(
        [&] {
          EdgeSizing(1e-3, {{zero, 1e-3, bad}});
        },
        ThrowsMessage<InputError>(HasSubstr("edge_mm.within_mm")))
        << bad;
    EXPECT_THAT([&] { EdgeSizing(1e-3, {}, bad); }, ThrowsMessage<InputError>(HasSubstr("edge_mm.growth"))) << bad;
  }
  EXPECT_NO_THROW(EdgeSizing(1e-3, {{zero, 1e-3, 0.0}}));
  EXPECT_THROW(EdgeSizing(1e-3, {{Vector3(0, std::nan(""), 0), 1e-3, 1e-3}}), InputError);
  EXPECT_THROW(EdgeSizing(1e-3, {}, 0.019), InputError);
  EXPECT_THROW(EdgeSizing(1e-3, {}, 0.61), InputError);
  EXPECT_NO_THROW(EdgeSizing(1e-3, {}, 0.02));
  EXPECT_NO_THROW(EdgeSizing(1e-3, {}, 0.6));
}

}  // namespace touchfield::edge_sizing_test
