#include <algorithm>
#include <cmath>
#include <limits>
#include <set>

#include "sim/field/target.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"

namespace touchfield::skin_strokes_test {

std::set<Eigen::Index> faces_of(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  const Target target = make_target(mesh, boxes, TargetProfile::kUniform, 1.0);
  std::set<Eigen::Index> faces;
  for (Eigen::Index i = 0; i < target.size(); ++i) {
    if (target.shares(i) > 0.5) {
      faces.insert(target.faces[static_cast<std::size_t>(i)]);
    }
  }
  return faces;
}

double distance_to_path(const Vector3& x, const std::vector<Vector3>& path) {
  double least = std::numeric_limits<double>::infinity();
  for (const Vector3& at : path) {
    least = std::min(least, (x - at).norm());
  }
  return least;
}

/// The skin nearest to the straight lines from point to point that looks somewhere, every 0.1 mm.
std::vector<Vector3> path_on(const TriangleMesh& mesh, const std::vector<Vector3>& points, const Vector3& facing) {
  const FaceTree tree(mesh);
  std::vector<Vector3> path;
  for (std::size_t i = 1; i < points.size(); ++i) {
    const int steps = static_cast<int>((points[i] - points[i - 1]).norm() / 1e-4);
    for (int s = 0; s <= steps; ++s) {
      path.push_back(tree.nearest_facing(points[i - 1] + (points[i] - points[i - 1]) * s / steps, facing, 0.5).at);
    }
  }
  return path;
}

/// All faces within 0.9 of half the width of the path, and none beyond `reach` of it.
void expect_along(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, const std::vector<Vector3>& path,
                  double width, double reach) {
  const std::set<Eigen::Index> held = faces_of(mesh, boxes);
  Eigen::Index within = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 x = mesh.centroids().col(f);
    const double distance = distance_to_path(x, path);
    const double to_end = std::min((x - path.front()).norm(), (x - path.back()).norm());
    const bool at_end = path.front() != path.back() && to_end < 0.5 * width;
    if (distance < 0.45 * width && !at_end) {
      ++within;
      EXPECT_TRUE(held.contains(f)) << "face " << f << ", " << distance << " m from the path";
    }
    if (distance > reach * 0.5 * width) {
      EXPECT_FALSE(held.contains(f)) << "face " << f << ", " << distance << " m from the path";
    }
  }
  EXPECT_GT(within, 50);
}

TEST(SkinStrokes, PlacesOffTheSkinAreRefused) {
  const TriangleMesh mesh = shifted(icosphere(10e-3, 8), {0, 0, 80e-3});
  const auto refusal = [&](const Vector3& at) {
    return support::message_of<InputError>([&] { SkinStrokes(mesh).on_skin(at, "target.points[2]"); });
  };
  EXPECT_THAT(refusal({0, 0, 58e-3}),
              AllOf(HasSubstr("target.points[2]: (0.0, 0.0, 58.0) mm (scene coordinates) is 12.0 mm off the skin"),
                    HasSubstr("the nearest skin is at (0.0, 0.0, 70.0) mm"), Not(HasSubstr("coordinates are on it"))));
  EXPECT_THAT(refusal({0, 0, 70e-6}), HasSubstr("a thousand times these coordinates are on it"));
  EXPECT_THAT(refusal({0, 0, 70}), HasSubstr("a thousandth of these coordinates is on it"));
  EXPECT_NEAR(SkinStrokes(mesh).on_skin({0, 0, 61e-3}, "").distance, 9e-3, 1e-4);
  EXPECT_NEAR(SkinStrokes(mesh, 1.0).on_skin({0, 0, 58e-3}, "").distance, 12e-3, 1e-4);
}

TEST(SkinStrokes, ADiscIsRoundAndOnTheNearestSkin) {
  const TriangleMesh mesh = icosphere(10e-3, 24);
  const Vector3 pole = Vector3(1, -2, -2) / 3;
  const TargetBox disc = SkinStrokes(mesh).disc(17e-3 * pole, 8e-3, 0.5, "target.points[0]");
  const std::set<Eigen::Index> held = faces_of(mesh, {disc});
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const Vector3 x = mesh.centroids().col(f);
    const double beside = (x - x.dot(pole) * pole).norm();
    if (x.dot(pole) < 0 || beside > 4.15e-3) {
      EXPECT_FALSE(held.contains(f));
    } else if (beside < 3.85e-3) {
      EXPECT_TRUE(held.contains(f));
    }
  }
  EXPECT_EQ(make_target(mesh, {disc}, TargetProfile::kUniform, 300.0).amplitudes.maxCoeff(), 150.0);
}

TEST(SkinStrokes, ALineGoesRoundASphere) {
  const TriangleMesh mesh = icosphere(10e-3, 24);
  const std::vector<Vector3> points = {{-9e-3, 0, 0}, {0, 0, -12e-3}, {10e-3, 0, 0}};
  const std::vector<TargetBox> boxes = SkinStrokes(mesh).strip(points, 4e-3, 1.0, "target.lines[0]");
  std::vector<Vector3> circle;
  for (int i = 0; i <= 1000; ++i) {
    circle.push_back(10e-3 * Vector3(-std::cos(M_PI * i / 1000), 0, -std::sin(M_PI * i / 1000)));
  }
  expect_along(mesh, boxes, circle, 4e-3, 1.1);
  for (const TargetBox& box : boxes) {
    EXPECT_GT(box.rotation.col(2).dot(box.centre.normalized()), 0.98);     // own z leads outwards
    EXPECT_GT(std::abs(box.rotation.col(0).dot(Vector3::UnitY())), 0.98);  // own x is across
  }
}

TEST(SkinStrokes, ALineOnAHandStaysOnOneSideOfTheFinger) {
  HandOptions options;
  options.pose = "flat";
  options.edge = 1.5e-3;
  const Body body = hand(options);
  const std::vector<Vector3> points = {position(body.mesh, find_landmark(body, "middle_pad")),
                                       position(body.mesh, find_landmark(body, "palm_centre"))};
  const std::vector<TargetBox> boxes = SkinStrokes(body.mesh).strip(points, 6e-3, 1.0, "target.lines[0]");
  EXPECT_GT(boxes.size(), 10U);
  const Vector3 palmar = body.mesh.normals().col(find_landmark(body, "middle_pad").face);
  expect_along(body.mesh, boxes, path_on(body.mesh, points, palmar), 6e-3, 1.4);
  for (const Eigen::Index f : faces_of(body.mesh, boxes)) {
    EXPECT_GT(body.mesh.normals().col(f).dot(palmar), 0.0);
  }
}

TEST(SkinStrokes, PiecesOfABendEndWhereTheirOuterCornersMeet) {
  const double width = 8e-3;
  const double angle = 0.4;
  const Vector3 bend(0, 0, -60e-3);
  const std::vector<Vector3> points = {bend - 10e-3 * Vector3::UnitX(), bend,
                                       bend + 10e-3 * Vector3(std::cos(angle), std::sin(angle), 0)};
  const SkinStrokes strokes(icosphere(60e-3, 60));
  int pieces = 0;
  for (const TargetBox& box : strokes.strip(points, width, 1.0, "target.lines[0]")) {
    const Vector3 at = box.rotation.transpose() * (strokes.on_skin(bend, "").at - box.centre);
    const double behind = 0.5 * box.size.y() - std::abs(at.y());
    if (behind > 0) {
      ++pieces;
      EXPECT_GT(behind, 0.5 * std::tan(0.5 * angle) * width);
      EXPECT_LT(behind, (0.5 * std::tan(0.5 * angle) + 0.1) * width);
    }
  }
  EXPECT_EQ(pieces, 2);
}

TEST(SkinStrokes, AClosedPathHasNoGapAtItsCorners) {
  const TriangleMesh mesh = icosphere(60e-3, 60);
  std::vector<Vector3> points;
  for (const auto& [x, y] : {std::pair{-9, -9}, {9, -9}, {9, 9}, {-9, -9}}) {  // a triangle: 90 and 135 degrees
    points.emplace_back(x * 1e-3, y * 1e-3, -60e-3);
  }
  const std::vector<TargetBox> boxes = SkinStrokes(mesh).strip(points, 5e-3, 1.0, "target.lines[0]");
  expect_along(mesh, boxes, path_on(mesh, points, -Vector3::UnitZ()), 5e-3, 1.5);
}

/// Levels of a mesh's faces by their centroids.
template <class Level>
std::vector<double> levels_of(const TriangleMesh& mesh, const Level& level) {
  std::vector<double> levels;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    levels.push_back(level(Vector3(mesh.centroids().col(f))));
  }
  return levels;
}

/// 1 in a strip 8 mm wide along y at the lowest skin of a ball, 0.5 beside it where x > 0.
double strip_level(const Vector3& x) {
  if (x.z() > 0 || std::abs(x.y()) > 12e-3) {
    return 0.0;
  }
  return std::abs(x.x()) < 4e-3 ? 1.0 : x.x() > 0 && x.x() < 7e-3 ? 0.5 : 0.0;
}

TEST(SkinStrokes, AMaskIsThatOfAnyMeshOfTheSkinAndMovesWithIt) {
  const TriangleMesh marked = icosphere(20e-3, 40);
  TargetBox box = masked_box(marked, levels_of(marked, strip_level), "target.mask_file");
  EXPECT_GT(std::abs(box.rotation.col(0).x()), 0.98);  // own x is across the strip
  EXPECT_LT(box.rotation.col(2).z(), -0.98);           // own z leads outwards
  const Eigen::Matrix3d turn = Eigen::AngleAxisd(2.0, Vector3(1, 2, 3).normalized()).toRotationMatrix();
  const Vector3 shift(0.01, -0.2, 0.03);
  box.centre = turn * box.centre + shift;
  box.rotation = turn * box.rotation;
  const TriangleMesh other = icosphere(20e-3, 27);  // another mesh of it
  const Target target = make_target(transformed(other, turn, shift), {box}, TargetProfile::kUniform, 1.0);
  const double edge = marked.mean_edge();
  std::size_t held = 0;
  for (Eigen::Index f = 0; f < other.face_count(); ++f) {
    const Vector3 x = other.centroids().col(f);
    const auto found = std::ranges::find(target.faces, f);
    const double level = found == target.faces.end() ? 0.0 : target.amplitudes(found - target.faces.begin());
    held += level > 0 ? 1 : 0;
    const bool at_border = strip_level(x - Vector3(edge, 0, 0)) != strip_level(x + Vector3(edge, 0, 0)) ||
                           strip_level(x - Vector3(0, edge, 0)) != strip_level(x + Vector3(0, edge, 0));
    if (!at_border) {
      EXPECT_EQ(level, strip_level(x)) << x.transpose();
    }
  }
  EXPECT_GT(held, 200U);
  EXPECT_THAT(support::message_of<InputError>([&] {
                make_target(transformed(other, turn, shift + Vector3(0, 0, 0.05)), {box}, TargetProfile::kUniform, 1.0);
              }),
              HasSubstr("target.mask_file: the box about"));  // the skin is elsewhere
}

TEST(SkinStrokes, LinesThatLeaveTheSkinAreRefused) {
  const TriangleMesh mesh = together(icosphere(5e-3, 8), shifted(icosphere(5e-3, 8), {20e-3, 0, 0}));
  const auto refusal = [&](const std::vector<Vector3>& points, double width) {
    return support::message_of<InputError>([&] { SkinStrokes(mesh).strip(points, width, 1.0, "target.lines[3]"); });
  };
  EXPECT_THAT(refusal({{0, 0, -5e-3}, {20e-3, 0, -5e-3}}, 2e-3),
              AllOf(HasSubstr("target.lines[3]: no skin leads from"), HasSubstr("give points between them")));
  EXPECT_THAT(refusal({{0, 0, -9e-3}, {0, 0, -9e-3}}, 2e-3),
              HasSubstr("target.lines[3]: points[0] and points[1] are at the same place of the skin"));
  EXPECT_THAT(refusal({{0, 0, -5e-3}, {5e-3, 0, 0}}, 2e-6), HasSubstr("needs more than 1000 pieces of 0.002 mm"));
}

}  // namespace touchfield::skin_strokes_test
