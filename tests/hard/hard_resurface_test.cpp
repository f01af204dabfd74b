// Skins made of soups: hands and plain bodies with random damage of every kind, several at once.

#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/resurface.h"
#include "tests/hard/hard_support.h"
#include "tests/support/surface_support.h"
#include "tests/support/testing.h"

namespace touchfield::hard_resurface_test {

class HardResurface : public HardCase {};

constexpr double kEdge = 3e-3;

/// A file's surface and what its skin should hold.
struct Soup {
  FileSurface surface;
  double least_volume;  // [m3]
  double most_volume;
  std::string damage;  // what was done to it
};

const TriangleMesh& body_of(unsigned seed) {
  static const std::vector<TriangleMesh> bodies = {
      hand({.pose = "flat", .edge = 4e-3}).mesh, hand({.pose = "index_up", .edge = 4e-3}).mesh,
      hand({.pose = "fist", .edge = 4e-3}).mesh, sphere(25e-3, 3e-3).mesh,
      capsule(10e-3, 60e-3, 3e-3).mesh,          box({40e-3, 60e-3, 20e-3}, 5e-3).mesh};
  return bodies[seed % bodies.size()];
}

/// Two hands in each other, balls within, across or off the skin, holes, flaps, faces twice and faces turned over.
Soup random_soup(unsigned seed) {
  std::mt19937 random(seed);
  const auto uniform = [&](double low, double high) { return std::uniform_real_distribution(low, high)(random); };
  const auto direction = [&] {
    std::normal_distribution<double> normal;
    return Vector3(normal(random), normal(random), normal(random)).normalized();
  };
  const TriangleMesh& body = body_of(seed);
  Soup soup{file_of(body), body.signed_volume(), body.signed_volume(), {}};
  std::vector<Vector3>& points = soup.surface.points;
  std::vector<std::array<std::int64_t, 3>>& faces = soup.surface.triangles;
  const auto drawn = [&](double share, const char* what) {
    const bool chosen = uniform(0, 1) < share;
    soup.damage += chosen ? std::string(" ") + what : "";
    return chosen;
  };
  const auto any_face = [&] { return faces[random() % faces.size()]; };
  const auto point = [&](std::int64_t v) { return points[static_cast<std::size_t>(v)]; };
  if (drawn(0.2, "twin")) {
    FileSurface moved = soup.surface;
    const Vector3 by = uniform(1e-3, 30e-3) * direction();
    for (Vector3& x : moved.points) {
      x += by;
    }
    soup.surface = together(soup.surface, moved);
    soup.most_volume *= 2.0;
  }
  for (const bool reversed : {false, true}) {
    if (drawn(0.35, reversed ? "ball-inside-out" : "ball")) {
      const double radius = uniform(3e-3, 12e-3);
      const Vector3 at = point(any_face()[0]) + uniform(0, 15e-3) * direction();
      const FileSurface ball = file_of(transformed(icosphere(radius, 5), Eigen::Matrix3d::Identity(), at));
      soup.surface = together(soup.surface, reversed ? turned(ball) : ball);
      soup.most_volume += 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
    }
  }
  for (int i = drawn(0.5, "holes") ? 0 : 4; i < 4; ++i) {
    const Vector3 centre = point(any_face()[0]);
    const double radius = uniform(2e-3, 8e-3);
    std::erase_if(faces, [&](const auto& face) { return (point(face[0]) - centre).norm() < radius; });
    soup.least_volume -= 4.0 * std::pow(radius, 3);
    soup.most_volume += 4.0 * std::pow(radius, 3);
  }
  if (drawn(0.3, "flaps")) {
    for (int i = 0; i < 20; ++i) {
      const auto face = any_face();
      faces.push_back({face[0], face[1], static_cast<std::int64_t>(points.size())});
      points.push_back(point(face[2]) + uniform(2e-3, 20e-3) * direction());
    }
    // A flap that comes off the skin winds round nothing, but bends w = 1/2 about itself.
    soup.least_volume *= 0.97;
    soup.most_volume *= 1.03;
  }
  for (int i = drawn(0.3, "duplicates") ? 0 : 200; i < 200; ++i) {
    const auto face = any_face();
    faces.push_back({face[i % 2 == 0 ? 1U : 0U], face[i % 2 == 0 ? 0U : 1U], face[2]});
  }
  const double share = drawn(0.4, "flips") ? uniform(0.05, 0.4) : 0.0;
  for (auto& face : faces) {
    if (uniform(0, 1) < share) {
      std::swap(face[0], face[1]);
    }
  }
  if (drawn(0.3, "separate-corners")) {
    soup.surface = soup_of(turned(soup.surface));
  }
  return soup;
}

TEST_P(HardResurface, RandomSoups) {
  const unsigned count = sized(12U, 200U);
  unsigned refused = 0;
  for (unsigned seed = 0; seed < count; ++seed) {
    const Soup soup = random_soup(seed);
    SCOPED_TRACE(fmt::format("seed {}:{}", seed, soup.damage));
    try {
      const Resurfaced skin = resurfaced(soup.surface, 1.0, kEdge, "soup.stl", "--resurface");
      EXPECT_THAT(inspect_skin(skin.mesh.vertices(), skin.mesh.triangles()).faults, IsEmpty());
      EXPECT_GT(skin.mesh.signed_volume(), 0.97 * soup.least_volume);
      EXPECT_LT(skin.mesh.signed_volume(), 1.03 * soup.most_volume);
    } catch (const InputError& error) {
      ++refused;
      EXPECT_THAT(error.what(), StartsWith("soup.stl: "));
      std::printf("seed %u,%s: %s\n", seed, soup.damage.c_str(), error.what());
    }
  }
  std::printf("%u of %u soups were refused\n", refused, count);
  EXPECT_LE(refused, (count + 19) / 20);
}

INSTANTIATE_TEST_SUITE_P(Small, HardResurface, testing::Values(Size::kSmall), testing::PrintToStringParamName());
INSTANTIATE_TEST_SUITE_P(Full, HardResurface, testing::Values(Size::kFull), testing::PrintToStringParamName());

}  // namespace touchfield::hard_resurface_test
