#include "sim/mesh/cut/cut.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
#include <random>
#include <string>
#include <vector>

#include <Eigen/Geometry>

#include "sim/body/hand.h"
#include "sim/body/shapes.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"

namespace touchfield::cut_test {

using std::numbers::pi;

constexpr double kDegree = pi / 180;
constexpr double kRounding = 1e-12;  // [m], of coordinates below 0.3 m through projections

/// Signed area of the faces that lie in the surface f = 0 within rounding, and the smallest angle of all faces with a
/// corner there.
struct Cap {
  double area = 0;
  Eigen::Index faces = 0;
  double smallest_angle = pi;
};

template <class Function>
Cap cap_of(const TriangleMesh& mesh, const Function& f) {
  Cap cap;
  for (Eigen::Index face = 0; face < mesh.face_count(); ++face) {
    int on = 0;
    for (int c = 0; c < 3; ++c) {
      on += std::abs(f(mesh.corner(face, c))) < kRounding ? 1 : 0;
    }
    if (on == 3) {
      cap.area += mesh.areas()(face);
      ++cap.faces;
    }
    for (int c = 0; on > 0 && c < 3; ++c) {
      const Vector3 one = mesh.corner(face, (c + 1) % 3) - mesh.corner(face, c);
      const Vector3 other = mesh.corner(face, (c + 2) % 3) - mesh.corner(face, c);
      cap.smallest_angle = std::min(cap.smallest_angle, std::atan2(one.cross(other).norm(), one.dot(other)));
    }
  }
  return cap;
}

void expect_sound(const TriangleMesh& mesh) {
  EXPECT_THAT(inspect(mesh).faults, IsEmpty());
  EXPECT_THAT(self_intersections(mesh), IsEmpty());
}

class Corners {
 public:
  explicit Corners(const TriangleMesh& mesh) : mesh_(mesh) {
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      ++counts_[key(f)];
    }
  }
  std::vector<double> key(Eigen::Index f) const { return key(mesh_, f); }
  static std::vector<double> key(const TriangleMesh& mesh, Eigen::Index f) {
    std::vector<double> coordinates;
    for (int c = 0; c < 3; ++c) {
      const Vector3 x = mesh.corner(f, c);
      coordinates.insert(coordinates.end(), x.begin(), x.end());
    }
    return coordinates;
  }
  bool has(const std::vector<double>& key) const { return counts_.count(key) > 0; }

 private:
  const TriangleMesh& mesh_;
  std::map<std::vector<double>, int> counts_;
};

double uniform(std::mt19937_64& random) { return static_cast<double>(random() >> 11U) * 0x1p-53; }

void expect_truncated(const TriangleMesh& mesh, const Vector3& point, double radius, double edge) {
  const TriangleMesh part = kept_within(mesh, point, radius, EdgeSizing(edge));
  expect_sound(part);
  EXPECT_EQ(inspect(part).components, 1);
  // Bulges shallower than a quarter of an edge may stay.
  EXPECT_LE((part.vertices().colwise() - point).colwise().norm().maxCoeff(), radius + 0.25 * edge);
  const Cap cap = cap_of(part, [&](const Vector3& x) { return (x - point).norm() - radius; });
  EXPECT_GT(cap.smallest_angle, 10 * kDegree);
  // Mean size of the cap's faces; those at the rim are smaller than asked for, by the cut.
  EXPECT_GT(cap.area / static_cast<double>(cap.faces), 0.5 * std::sqrt(3) / 4 * edge * edge);
  EXPECT_LT(cap.area / static_cast<double>(cap.faces), 1.4 * std::sqrt(3) / 4 * edge * edge);
  // What is well within the ball and belongs to the piece is the mesh's own, and all of the nearest skin is there.
  const Corners own(mesh);
  const FaceTree tree(part);
  for (Eigen::Index f = 0; f < part.face_count(); ++f) {
    if (std::max({(part.corner(f, 0) - point).norm(), (part.corner(f, 1) - point).norm(),
                  (part.corner(f, 2) - point).norm()}) < 0.9 * radius) {
      EXPECT_TRUE(own.has(Corners::key(part, f))) << f;
    }
  }
  const FaceTree whole(mesh);
  EXPECT_NEAR(tree.nearest(point).distance, whole.nearest(point).distance, kRounding);
  // The caps lie in the body, but for the sagitta of its faces and the quarter of an edge that is ignored.
  for (Eigen::Index v = 0; v < part.vertex_count(); ++v) {
    const Vector3 x = part.vertices().col(v);
    EXPECT_TRUE(whole.nearest(x).distance < 0.3 * edge || whole.winding_number(x) > 0.5);
  }
}

TEST(KeptWithin, TruncatesBodies) {
  constexpr double kEdge = 2.5e-3;
  expect_truncated(capsule(0.008, 0.06, kEdge).mesh, {0, 0, 0.008}, 0.02, kEdge);
  expect_truncated(capsule(0.008, 0.06, kEdge).mesh, {0, 0.038, 0}, 0.02, kEdge);
  expect_truncated(sphere(0.03, kEdge).mesh, {0, 0, 0.03}, 0.02, kEdge);
  expect_truncated(box({0.08, 0.06, 0.04}, kEdge).mesh, {0.003, 0.001, 0.02}, 0.018, kEdge);  // flat side
  expect_truncated(box({0.08, 0.06, 0.04}, kEdge).mesh, {0.04, 0.03, 0.02}, 0.02, kEdge);     // corner
  expect_truncated(box({0.04, 0.03, 0.02}, kEdge).mesh, {0.004, 0.002, 0.01}, 0.018, kEdge);  // sides in part
}

// A capsule cut by two parts of a sphere about the middle of its skin: the volume of the cylinder within the ball
// by numbers, those of its slices at y being the overlap of two discs.
TEST(KeptWithin, HasTheVolumeOfTheIntersection) {
  constexpr double kRadius = 0.008;
  constexpr double kBall = 0.02;
  double volume = 0;
  constexpr int kSlices = 20000;
  for (int i = 0; i < kSlices; ++i) {
    const double y = kBall * (2 * (i + 0.5) / kSlices - 1);
    const double r = std::sqrt(kBall * kBall - y * y);
    const double d = kRadius;  // the centre lies on the skin
    double area = 0;
    if (r >= d + kRadius) {
      area = pi * kRadius * kRadius;
    } else {
      const double a = (d * d + r * r - kRadius * kRadius) / (2 * d);
      const double b = d - a;
      area = r * r * std::acos(std::clamp(a / r, -1.0, 1.0)) +
             kRadius * kRadius * std::acos(std::clamp(b / kRadius, -1.0, 1.0)) -
             d * std::sqrt(std::max(r * r - a * a, 0.0));
    }
    volume += area * 2 * kBall / kSlices;
  }
  const TriangleMesh part =
      kept_within(capsule(kRadius, 0.06, 1.2e-3).mesh, {0, 0, kRadius}, kBall, EdgeSizing(1.2e-3));
  // The capsule's mesh has the capsule's volume; caps of edge h lie inside by h^2 / (8 R) on average or less, over
  // 2 pi kRadius^2: 5e-4 of the volume.
  EXPECT_NEAR(part.signed_volume() / volume, 1.0, 2e-3);
}

TEST(KeptWithin, TruncatesHands) {
  struct Case {
    const char* pose;
    std::vector<double> radii_mm;
  };
  for (const Case& c :
       {Case{"index_up", {20, 40, 60, 100}}, Case{"grasp", {20, 40, 60, 100}}, Case{"fist", {30, 60}}}) {
    const Body body = hand({.pose = c.pose, .edge = 2.5e-3});
    const Vector3 pad = position(body.mesh, find_landmark(body, "index_pad"));
    for (const double radius : c.radii_mm) {
      SCOPED_TRACE(std::string(c.pose) + " " + std::to_string(radius));
      expect_truncated(body.mesh, pad, radius * 1e-3, 2.5e-3);
    }
  }
}

// Fine about the pad and coarse from there on, as a whole hand is meshed: the ball cuts faces of any size.
TEST(KeptWithin, TruncatesGradedHands) {
  for (const double forearm : {0.0, 0.25}) {
    for (const double far : {6.5e-3, 8e-3, 12e-3}) {
      const HandOptions options{.pose = "index_up", .forearm = forearm};
      const Vector3 pad = hand_landmark(options, "index_pad");
      const EdgeSizing sizing(far, {{pad, 1.2e-3, 15e-3}});
      const TriangleMesh whole = hand(options, sizing).mesh;
      for (const double radius : {30e-3, 40e-3, 50e-3, 70e-3}) {
        SCOPED_TRACE(std::to_string(far) + " " + std::to_string(radius));
        const TriangleMesh part = kept_within(whole, pad, radius, sizing);
        expect_sound(part);
        EXPECT_EQ(inspect(part).components, 1);
        EXPECT_LT((part.vertices().colwise() - pad).colwise().norm().maxCoeff(), radius + 0.25 * far);
      }
    }
  }
}

// Faces of 0.1 m: the ball touches none of their edges, and its cut must be round all the same.
TEST(KeptWithin, FollowsTheSphereOnCoarseFaces) {
  const TriangleMesh slab = box({0.2, 0.2, 0.05}, 1).mesh;
  ASSERT_EQ(slab.face_count(), 12);
  const TriangleMesh part = kept_within(slab, {0.012, 0.007, 0.025}, 0.03, EdgeSizing(2e-3));
  expect_sound(part);
  // Half a ball; chords of up to 4 mm in a rim of 30 mm and caps of 2 mm faces lose below 1 %.
  EXPECT_NEAR(part.signed_volume() / (2.0 / 3 * pi * std::pow(0.03, 3)), 1.0, 0.01);
  EXPECT_GT(inspect(part).smallest_angle, 10 * kDegree);
}

// A plate with a hole's worth of skin inside the ball but not outside: the cap is a ring between two rims.
TEST(KeptWithin, ClosesRings) {
  const TriangleMesh outer = box({0.1, 0.1, 0.1}, 4e-3).mesh;
  const TriangleMesh bubble = shifted(sphere(0.012, 2.5e-3).mesh, {0, 0, 0.02});
  Triangles inwards = bubble.triangles();
  inwards.row(1).swap(inwards.row(2));
  const TriangleMesh body = together(outer, {bubble.vertices(), inwards});
  // About a point of the side z = 0.05, the sphere of 0.03 cuts the side in one rim and the bubble about z = 0.02 in
  // another.
  const double radius = 0.03;
  const TriangleMesh part = kept_within(body, {0, 0, 0.05}, radius, EdgeSizing(3e-3));
  EXPECT_THAT(inspect(part).faults, IsEmpty());
  EXPECT_EQ(inspect(part).components, 1);
  // Half a ball of 0.03 without the lens that it shares with the bubble, whose centre is 0.03 away.
  const double r = 0.012;
  const double d = 0.03;
  const double lens = pi * std::pow(radius + r - d, 2) *
                      (d * d + 2 * d * r - 3 * r * r + 2 * d * radius + 6 * r * radius - 3 * radius * radius) /
                      (12 * d);
  EXPECT_NEAR(part.signed_volume() / (2.0 / 3 * pi * std::pow(radius, 3) - lens), 1.0, 0.015);
}

TEST(KeptWithin, LeavesOutOtherPieces) {
  const TriangleMesh one = capsule(0.008, 0.06, 2.5e-3).mesh;
  const TriangleMesh body = together(one, shifted(one, {0.02, 0, 0}));
  const TriangleMesh part = kept_within(body, {0, 0, 0.008}, 0.025, EdgeSizing(2.5e-3));
  expect_sound(part);
  EXPECT_EQ(inspect(part).components, 1);
  EXPECT_LT(part.vertices().row(0).maxCoeff(), 0.01);
  EXPECT_EQ(kept_within(one, {0, 0, 0}, 0.05, EdgeSizing(2.5e-3)).face_count(), one.face_count());
}

TEST(KeptWithin, SurvivesAnyBall) {
  std::mt19937_64 random(5);
  const Body body = hand({.pose = "index_up", .edge = 4e-3});
  const EdgeSizing sizing(6e-3, {{position(body.mesh, find_landmark(body, "index_pad")), 4e-3, 0.01}});
  for (int trial = 0; trial < 40; ++trial) {
    const auto face = static_cast<Eigen::Index>(uniform(random) * static_cast<double>(body.mesh.face_count()));
    const double radius = 0.01 + 0.12 * uniform(random);
    SCOPED_TRACE(trial);
    const TriangleMesh part = kept_within(body.mesh, body.mesh.centroids().col(face), radius, sizing);
    expect_sound(part);
  }
}

TEST(KeptWithin, RefusesBallsWithoutSkin) {
  const TriangleMesh mesh = sphere(0.03, 3e-3).mesh;
  const EdgeSizing sizing(3e-3);
  for (const double radius : {0.0, -1.0, std::nan(""), HUGE_VAL}) {
    EXPECT_THAT(
        [&] {
          kept_within(mesh, {0, 0, 0.03}, radius, sizing);
        },
        ThrowsMessage<InputError>(HasSubstr("keep_within_mm")));
  }
  EXPECT_THAT(
      [&] {
        kept_within(mesh, {0, 0, 0.05}, 0.03, sizing);
      },
      ThrowsMessage<InputError>(HasSubstr("the nearest skin")));
}

}  // namespace touchfield::cut_test
