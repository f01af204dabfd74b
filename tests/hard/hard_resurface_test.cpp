// Skins made of soups: hands and plain bodies with random damage of every kind, several at once.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <numbers>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/resurface.h"
#include "sim/mesh/remesh/surface_remesh.h"
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

class Damager {
 public:
  Damager(const TriangleMesh& body, unsigned seed)
      : random_(seed), soup_{file_of(body), body.signed_volume(), body.signed_volume(), {}} {}

  double uniform(double low, double high) { return std::uniform_real_distribution<double>(low, high)(random_); }
  std::size_t any_face() {
    return static_cast<std::size_t>(uniform(0, 0.999999) * static_cast<double>(faces().size()));
  }

  void holes() {
    for (int i = 0; i < 4; ++i) {
      const Vector3 centre = corner(any_face(), 0);
      const double radius = uniform(2e-3, 8e-3);
      std::erase_if(faces(), [&](const auto& face) { return (point(face[0]) - centre).norm() < radius; });
      soup_.least_volume -= 4.0 * std::pow(radius, 3);
      soup_.most_volume += 4.0 * std::pow(radius, 3);
    }
  }

  void flaps() {
    for (int i = 0; i < 20; ++i) {
      const auto face = faces()[any_face()];
      const auto tip = static_cast<std::int64_t>(soup_.surface.points.size());
      soup_.surface.points.push_back(point(face[2]) + uniform(2e-3, 20e-3) * direction());
      faces().push_back({face[0], face[1], tip});
    }
    // A flap that comes off the skin winds round nothing, but bends w = 1/2 about itself.
    soup_.least_volume *= 0.97;
    soup_.most_volume *= 1.03;
  }

  void duplicates() {
    for (int i = 0; i < 200; ++i) {
      auto face = faces()[any_face()];
      if (i % 2 == 0) {
        std::swap(face[0], face[1]);
      }
      faces().push_back(face);
    }
  }

  void flips() {
    const double share = uniform(0.05, 0.4);
    for (auto& face : faces()) {
      if (uniform(0, 1) < share) {
        std::swap(face[0], face[1]);
      }
    }
  }

  void inside_out() { soup_.surface = turned(soup_.surface); }

  void shuffle() { std::shuffle(faces().begin(), faces().end(), random_); }

  void separate_corners() { soup_.surface = soup_of(soup_.surface); }

  void flat_faces() {
    for (int i = 0; i < 10; ++i) {
      const auto face = faces()[any_face()];
      faces().push_back({face[0], face[1], face[0]});
      const auto middle = static_cast<std::int64_t>(soup_.surface.points.size());
      soup_.surface.points.emplace_back(0.5 * (point(face[0]) + point(face[1])));
      faces().push_back({face[0], middle, face[1]});
    }
  }

  /// A ball somewhere about the skin: within, across or off it.
  void ball(bool reversed) {
    const double radius = uniform(3e-3, 12e-3);
    const Vector3 at = corner(any_face(), 0) + uniform(0, 15e-3) * direction();
    const FileSurface ball = file_of(transformed(icosphere(radius, 5), Eigen::Matrix3d::Identity(), at));
    soup_.surface = together(soup_.surface, reversed ? turned(ball) : ball);
    soup_.most_volume += 4.0 / 3.0 * std::numbers::pi * std::pow(radius, 3);
  }

  /// The same body again, moved a little: two hands in each other.
  void twin() {
    FileSurface moved = soup_.surface;
    const Vector3 by = uniform(1e-3, 30e-3) * direction();
    for (Vector3& x : moved.points) {
      x += by;
    }
    soup_.surface = together(soup_.surface, moved);
    soup_.most_volume *= 2.0;
  }

  Soup result() const { return soup_; }

 private:
  std::vector<std::array<std::int64_t, 3>>& faces() { return soup_.surface.triangles; }
  const Vector3& point(std::int64_t v) const { return soup_.surface.points[static_cast<std::size_t>(v)]; }
  Vector3 corner(std::size_t face, std::size_t c) { return point(faces()[face][c]); }
  Vector3 direction() {
    std::normal_distribution<double> normal;
    return Vector3(normal(random_), normal(random_), normal(random_)).normalized();
  }

  std::mt19937 random_;
  Soup soup_;
};

const TriangleMesh& body_of(unsigned seed) {
  static const std::vector<TriangleMesh> bodies = {
      hand({.pose = "flat", .edge = 4e-3}).mesh, hand({.pose = "index_up", .edge = 4e-3}).mesh,
      hand({.pose = "fist", .edge = 4e-3}).mesh, sphere(25e-3, 3e-3).mesh,
      capsule(10e-3, 60e-3, 3e-3).mesh,          box({40e-3, 60e-3, 20e-3}, 5e-3).mesh};
  return bodies[seed % bodies.size()];
}

Soup random_soup(unsigned seed) {
  Damager damager(body_of(seed), seed);
  std::string damage;
  const auto chance = [&](double share, const char* what) {
    const bool drawn = damager.uniform(0, 1) < share;
    damage += drawn ? std::string(" ") + what : "";
    return drawn;
  };
  if (chance(0.2, "twin")) damager.twin();
  if (chance(0.4, "ball")) damager.ball(false);
  if (chance(0.3, "ball-inside-out")) damager.ball(true);
  if (chance(0.5, "holes")) damager.holes();
  if (chance(0.3, "flaps")) damager.flaps();
  if (chance(0.3, "duplicates")) damager.duplicates();
  if (chance(0.3, "flat-faces")) damager.flat_faces();
  if (chance(0.4, "flips")) damager.flips();
  if (chance(0.2, "inside-out")) damager.inside_out();
  if (chance(0.3, "shuffled")) damager.shuffle();
  if (chance(0.3, "separate-corners")) damager.separate_corners();
  Soup soup = damager.result();
  soup.damage = damage;
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
