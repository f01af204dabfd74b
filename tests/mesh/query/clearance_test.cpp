#include "sim/mesh/query/clearance.h"

#include <cmath>
#include <numbers>
#include <random>
#include <vector>

#include <Eigen/Geometry>

#include "sim/hand/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "tests/support/mesh_support.h"
#include "tests/support/random_support.h"
#include "tests/support/testing.h"

namespace touchfield::clearance_test {

using Index = Eigen::Index;

constexpr double kRounding = 1e-13;  // [m], of coordinates of some m after some products and quotients

TriangleMesh turned_inside_out(const TriangleMesh& mesh) {
  return {mesh.vertices(), mesh.triangles().colwise().reverse()};
}

TriangleMesh block(double x, double y, double z, double edge = 4e-3) { return box({x, y, z}, edge).mesh; }

/// Distance of two convex surfaces by going to and fro between nearest points: from above, and to the limit.
double distance_to_and_fro(const TriangleMesh& first, const TriangleMesh& second) {
  const FaceTree one(first);
  const FaceTree other(second);
  Vector3 x = first.vertices().col(0);
  double distance = 0;
  for (int i = 0; i < 1000; ++i) {
    const Vector3 y = other.nearest(x).at;
    x = one.nearest(y).at;
    distance = (x - y).norm();
  }
  return distance;
}

TEST(LeastClearance, OfTwoTrianglesIsTheLimitOfGoingToAndFro) {
  std::mt19937 random(2);
  Triangles triangle(3, 1);
  triangle << 0, 1, 2;
  int apart = 0;
  int reached = 0;
  for (int round = 0; round < 300; ++round) {
    Points points(3, 3);
    points << point_in_cube(random), point_in_cube(random), point_in_cube(random);
    const TriangleMesh first(points, triangle);
    points << point_in_cube(random), point_in_cube(random), point_in_cube(random);
    const TriangleMesh second(points.colwise() + 0.7 * point_in_cube(random), triangle);
    const Clearance found = least_clearance(first, second);
    const double expected = distance_to_and_fro(first, second);
    // Attained by points of both, and no larger than what is reached to and fro, mostly in the limit.
    EXPECT_LE(found.distance, expected + kRounding) << round;
    apart += found.meeting == Meeting::kApart ? 1 : 0;
    reached += expected - found.distance < 1e-9 ? 1 : 0;
    EXPECT_NEAR((found.on_first - found.on_second).norm(), found.distance, kRounding);
    EXPECT_LT(FaceTree(first).nearest(found.on_first).distance, kRounding);
    EXPECT_LT(FaceTree(second).nearest(found.on_second).distance, kRounding);
  }
  EXPECT_GT(apart, 100);
  EXPECT_LT(apart, 290);
  EXPECT_GT(reached, 250);
}

// Boxes side against side, edge against edge and corner against corner.
TEST(LeastClearance, OfTwoBoxesIsThatOfTheirSidesEdgesOrCorners) {
  std::mt19937 random(3);
  const TriangleMesh first = block(0.02, 0.03, 0.04);
  const TriangleMesh second = block(0.01, 0.01, 0.01, 3e-3);
  const Vector3 reach(0.015, 0.02, 0.025);  // sum of the half sides
  for (const Vector3& gap : {Vector3(0.002, 0, 0), Vector3(0, 0.003, 0), Vector3(0.003, 0.004, 0),
                             Vector3(0.002, 0.003, 0.006), Vector3(0.5, 0.5, 0.5), Vector3(0, 0, 1e-7)}) {
    Vector3 shift = Vector3(0.001, 0.0013, 0.0017);
    for (int i = 0; i < 3; ++i) {
      shift(i) = gap(i) > 0 ? reach(i) + gap(i) : shift(i);
    }
    for (int round = 0; round < 5; ++round) {
      const Eigen::Matrix3d rotation = some_rotation(random);
      const Vector3 by = 0.3 * point_in_cube(random);
      const TriangleMesh one = transformed(first, rotation, by);
      const TriangleMesh other = transformed(shifted(second, shift), rotation, by);
      const Clearance found = least_clearance(one, other);
      EXPECT_EQ(found.meeting, Meeting::kApart);
      EXPECT_NEAR(found.distance, gap.norm(), kRounding);
      EXPECT_NEAR((found.on_first - found.on_second).norm(), gap.norm(), kRounding);
      EXPECT_NEAR(FaceTree(one).nearest(found.on_second).distance, gap.norm(), kRounding);
      const TriangleMesh face(one.vertices(), one.triangles().col(found.first_face));
      const TriangleMesh other_face(other.vertices(), other.triangles().col(found.second_face));
      EXPECT_LT(FaceTree(face).nearest(found.on_first).distance, kRounding);
      EXPECT_LT(FaceTree(other_face).nearest(found.on_second).distance, kRounding);
      EXPECT_NEAR(least_clearance(other, one).distance, gap.norm(), kRounding);
    }
  }
}

TEST(LeastClearance, TellsHowBodiesMeet) {
  const TriangleMesh outer = block(0.04, 0.04, 0.04);
  const TriangleMesh inner = block(0.01, 0.01, 0.01);
  const Clearance inside = least_clearance(inner, outer);
  EXPECT_EQ(inside.meeting, Meeting::kFirstInside);
  EXPECT_EQ(inside.distance, 0);
  EXPECT_NEAR((inside.on_first - inside.on_second).norm(), 0.015, kRounding);
  EXPECT_EQ(least_clearance(outer, inner).meeting, Meeting::kSecondInside);

  const Clearance cut = least_clearance(outer, shifted(inner, {0.02, 0.001, 0.002}));
  EXPECT_EQ(cut.meeting, Meeting::kCut);
  EXPECT_EQ(cut.distance, 0);
  EXPECT_NEAR(cut.on_first.x(), 0.02, kRounding);  // on both skins
  EXPECT_NEAR((cut.on_first - cut.on_second).norm(), 0, kRounding);

  // One through another like a spit: no corner of either is inside the other.
  EXPECT_EQ(least_clearance(outer, block(0.1, 0.01, 0.01, 0.2)).meeting, Meeting::kCut);
  EXPECT_EQ(least_clearance(outer, outer).meeting, Meeting::kCut);

  // Side on side: coplanar faces overlap. Edge on side and corner on corner only touch.
  EXPECT_EQ(least_clearance(outer, shifted(inner, {0.025, 0, 0})).meeting, Meeting::kCut);
  const TriangleMesh on_edge =
      transformed(inner, Eigen::AngleAxisd(std::numbers::pi / 4, Vector3::UnitY()).toRotationMatrix(),
                  {0.02 + 0.01 / std::numbers::sqrt2, 0.001, 0});
  EXPECT_EQ(least_clearance(outer, on_edge).meeting, Meeting::kApart);
  EXPECT_NEAR(least_clearance(outer, on_edge).distance, 0, kRounding);
  EXPECT_EQ(least_clearance(outer, shifted(inner, {0.025, 0.025, 0.025})).meeting, Meeting::kApart);
  EXPECT_NEAR(least_clearance(outer, shifted(inner, {0.025, 0.025, 0.025})).distance, 0, kRounding);
}

TEST(LeastClearance, KnowsAHollowFromFlesh) {
  const TriangleMesh shell = together(block(0.04, 0.04, 0.04), turned_inside_out(block(0.03, 0.03, 0.03)));
  const TriangleMesh inner = block(0.01, 0.01, 0.01);
  const Clearance hollow = least_clearance(shell, inner);
  EXPECT_EQ(hollow.meeting, Meeting::kApart);
  EXPECT_NEAR(hollow.distance, 0.01, kRounding);
  const TriangleMesh crumb = block(0.001, 0.001, 0.001, 1e-3);
  EXPECT_EQ(least_clearance(shell, shifted(crumb, {0.0175, 0, 0})).meeting, Meeting::kSecondInside);
  // One piece of two is inside, the other outside.
  const TriangleMesh pieces = together(shifted(crumb, {0.1, 0, 0}), shifted(crumb, {0, 0.0175, 0}));
  EXPECT_EQ(least_clearance(pieces, shell).meeting, Meeting::kFirstInside);
  // Faces that touch at a corner on their way to a cut elsewhere do not hide it.
  const TriangleMesh touching = together(shifted(crumb, {0.0205, 0.0205, 0.0205}), shifted(crumb, {-0.02, 0, 0.001}));
  EXPECT_EQ(least_clearance(block(0.04, 0.04, 0.04), touching).meeting, Meeting::kCut);
}

// Inside a box the distance is that to the nearest side; outside, to the box as a set.
TEST(PointClearances, OfABoxAreItsDistances) {
  std::mt19937 random(5);
  const Vector3 half(0.01, 0.015, 0.02);
  const TriangleMesh body = block(0.02, 0.03, 0.04);
  Points points(3, 500);
  for (auto x : points.colwise()) {
    x = 0.03 * point_in_cube(random);
  }
  const std::vector<PointClearance> found = point_clearances(body, points);
  ASSERT_EQ(found.size(), 500u);
  int inside = 0;
  for (Index i = 0; i < points.cols(); ++i) {
    const Vector3 beyond = points.col(i).cwiseAbs() - half;
    const PointClearance& each = found[static_cast<std::size_t>(i)];
    const bool is_inside = beyond.maxCoeff() < 0;
    inside += is_inside ? 1 : 0;
    EXPECT_EQ(each.inside, is_inside);
    EXPECT_NEAR(each.distance, is_inside ? -beyond.maxCoeff() : beyond.cwiseMax(0.0).norm(), kRounding);
    const TriangleMesh face(body.vertices(), body.triangles().col(each.face));
    EXPECT_NEAR(FaceTree(face).nearest(points.col(i)).distance, each.distance, kRounding);
  }
  EXPECT_GT(inside, 50);  // 24 of 216 parts of the cube
  EXPECT_TRUE(point_clearances(body, Points(3, 0)).empty());
}

/// count_x x count_y points at a pitch in the plane z = 0, about the origin.
Points grid(int count_x, int count_y, double pitch) {
  Points points(3, count_x * count_y);
  for (int j = 0; j < count_y; ++j) {
    for (int i = 0; i < count_x; ++i) {
      points.col(j * count_x + i) << (i - 0.5 * (count_x - 1)) * pitch, (j - 0.5 * (count_y - 1)) * pitch, 0;
    }
  }
  return points;
}

Points moved(const Points& points, const Eigen::Matrix3d& rotation, const Vector3& by) {
  return (rotation * points).colwise() + by;
}

const Eigen::VectorXi kOnePlate = Eigen::VectorXi::Zero(18 * 14);

// A finger between the transducers of a board, none of them inside it.
TEST(PlateCollision, SeesAFingerBetweenTransducers) {
  const Points board = grid(18, 14, 0.01);
  const TriangleMesh finger =
      transformed(capsule(3e-3, 0.05, 1e-3).mesh,
                  Eigen::AngleAxisd(std::numbers::pi / 2, Vector3::UnitX()).toRotationMatrix(), {0.02, 0.01, 0.01});
  for (const PointClearance& each : point_clearances(finger, board)) {
    EXPECT_FALSE(each.inside);
    EXPECT_GT(each.distance, 1e-3);
  }
  const auto found = plate_collision(finger, board, kOnePlate, 0);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->distance, 0);
  EXPECT_EQ(found->plate, 0);
  EXPECT_NEAR(found->at.z(), 0, kRounding);
  EXPECT_NEAR((found->at - Vector3(0.02, 0.01, 0)).norm(), 3e-3, 0.1e-3);  // facets: 1 / (8 3) mm
  // Beside the board, and above it.
  EXPECT_FALSE(plate_collision(shifted(finger, {0.07, 0, 0}), board, kOnePlate, 1e-3));
  EXPECT_FALSE(plate_collision(shifted(finger, {0, 0, 0.03}), board, kOnePlate, 1e-3));
}

TEST(PlateCollision, MeasuresTheDistanceToThePlate) {
  std::mt19937 random(9);
  const Points board = grid(18, 14, 0.01);  // 170 x 130 mm
  const TriangleMesh body = block(0.01, 0.01, 0.01);
  struct Case {
    Vector3 at;
    double distance;
  };
  for (const Case& each : {Case{{0.003, 0.004, 0.007}, 0.002}, Case{{0.093, 0.009, 0.009}, 0.005},
                           Case{{0.093, 0.074, 0.0}, std::hypot(0.003, 0.004)}, Case{{0.003, 0.002, 0.005}, 0.0}}) {
    for (int round = 0; round < 5; ++round) {
      const Eigen::Matrix3d rotation = some_rotation(random);
      const Vector3 by = point_in_cube(random);
      const TriangleMesh there = transformed(shifted(body, each.at), rotation, by);
      const Points positions = moved(board, rotation, by);
      if (each.distance > 0) {
        EXPECT_FALSE(plate_collision(there, positions, kOnePlate, each.distance - 1e-9));
      }
      const auto found = plate_collision(there, positions, kOnePlate, each.distance + 1e-9);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->distance, each.distance, kRounding);
      EXPECT_NEAR(FaceTree(there).nearest(found->at).distance, each.distance, kRounding);
    }
  }
}

TEST(PlateCollision, SeesAPlateInsideABody) {
  const TriangleMesh body = block(0.2, 0.2, 0.2, 0.02);
  const auto found = plate_collision(body, grid(18, 14, 0.01), kOnePlate, 0);
  ASSERT_TRUE(found);
  EXPECT_EQ(found->distance, 0);
  // Its rim on the body's skin all round.
  const TriangleMesh same(block(0.17, 0.13, 0.05, 0.3));
  EXPECT_TRUE(plate_collision(same, grid(18, 14, 0.01), kOnePlate, 0));
  // In the hollow of a shell.
  const TriangleMesh shell = together(body, turned_inside_out(block(0.19, 0.19, 0.19, 0.02)));
  EXPECT_FALSE(plate_collision(shell, grid(18, 14, 0.01), kOnePlate, 5e-3));
}

// Two boards face to face, a body between them through the upper one; numbers mixed.
TEST(PlateCollision, TreatsEachPlateAlone) {
  const Points board = grid(5, 4, 0.01);
  Points both(3, 40);
  Eigen::VectorXi plates(40);
  for (int i = 0; i < 20; ++i) {
    both.col(2 * i) = board.col(i);
    both.col(2 * i + 1) = board.col(i) + Vector3(0, 0, 0.1);
    plates(2 * i) = 7;
    plates(2 * i + 1) = 3;
  }
  const TriangleMesh body = block(0.005, 0.005, 0.005);
  EXPECT_FALSE(plate_collision(shifted(body, {0.001, 0, 0.05}), both, plates, 0.04));  // the hull of all holds it
  const auto below = plate_collision(shifted(body, {0.001, 0, 0.02}), both, plates, 1);
  ASSERT_TRUE(below);
  EXPECT_EQ(below->plate, 7);
  EXPECT_NEAR(below->distance, 0.0175, kRounding);
  const auto above = plate_collision(shifted(body, {0.001, 0, 0.101}), both, plates, 0);
  ASSERT_TRUE(above);
  EXPECT_EQ(above->plate, 3);
  EXPECT_NEAR(above->at.z(), 0.1, kRounding);
}

}  // namespace touchfield::clearance_test
