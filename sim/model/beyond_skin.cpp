#include "sim/model/beyond_skin.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "sim/core/units.h"
#include "sim/field/skin_problems.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

using Index = Eigen::Index;

constexpr double kPiece = 0.25;  // longest edge of what patches are chosen from [wavelengths]
constexpr double kApart = 0.9;   // of patches [wavelengths]

/// The faces of a body that are solved as its skin; none if it lies beyond as a whole.
Triangles solved_skin(const PlacedBodies& bodies, int body) {
  return faces_where(bodies.body.mesh.triangles(), [&](Index f) {
    const auto face = static_cast<std::size_t>(f);
    return bodies.skin[face] != 0 && bodies.owner[face] == body;
  });
}

/// The pieces that no skin of the solving mesh covers.
SkinPatches uncovered(const SkinPatches& pieces, const PlacedBodies& bodies, int body) {
  constexpr double kOnSkin = 0.1 * kMillimetre;
  const Triangles skin = solved_skin(bodies, body);
  if (skin.cols() == 0) {
    return pieces;
  }
  const FaceTree tree(TriangleMesh(bodies.body.mesh.vertices(), skin));
  const Points centres = pieces.centres();
  std::vector<unsigned char> covered(static_cast<std::size_t>(pieces.size()));
#pragma omp parallel for schedule(dynamic, 256)
  for (Index j = 0; j < pieces.size(); ++j) {
    covered[static_cast<std::size_t>(j)] = tree.nearest(centres.col(j), kOnSkin).face >= 0 ? 1 : 0;
  }
  return picked(pieces, [&](Index j) { return covered[static_cast<std::size_t>(j)] == 0; });
}

/// A body that may stand in the way of sound.
class Obstacle {
 public:
  explicit Obstacle(const TriangleMesh& mesh)
      : tree_(mesh), low_(mesh.vertices().rowwise().minCoeff()), high_(mesh.vertices().rowwise().maxCoeff()) {}

  /// Whether the way between two points goes through it, where that takes more than 3 mm.
  bool hides(const Vector3& from, const Vector3& to) const {
    constexpr double kStep = 3.0 * kMillimetre;
    const auto steps = static_cast<int>(std::ceil((to - from).norm() / kStep));
    for (int i = 1; i < steps; ++i) {
      const Vector3 x = from + static_cast<double>(i) / steps * (to - from);
      if ((x.array() > low_.array()).all() && (x.array() < high_.array()).all() && tree_.winding_number(x) > 0.5) {
        return true;
      }
    }
    return false;
  }

 private:
  FaceTree tree_;
  Vector3 low_;
  Vector3 high_;
};

/// Share by area of the patches that bodies other than their own hide from more than half of the array.
double shadowed_share(const Scene& scene, const PlacedBodies& bodies, const TransducerArray& array,
                      const SkinPatches& patches) {
  constexpr Index kWays = 15;  // of channels, from one patch
  if (scene.bodies.size() == 1 || array.kind != TransducerArray::Kind::kTransducers) {
    return 0.0;
  }
  std::map<int, Obstacle> obstacles;
  for (std::size_t i = 0; i < scene.bodies.size(); ++i) {
    const auto body = static_cast<int>(i);
    const auto whole = std::ranges::find(bodies.whole, body, &PlacedBodies::Whole::owner);
    obstacles.emplace(body, whole != bodies.whole.end()
                                ? Obstacle(whole->mesh)
                                : Obstacle({bodies.body.mesh.vertices(), solved_skin(bodies, body)}));
  }
  const Points centres = patches.centres();
  double hidden_area = 0.0;
  for (Index j = 0; j < patches.size(); ++j) {
    Index hidden = 0;
    for (Index way = 0; way < kWays; ++way) {
      const Vector3 from = array.positions.col((2 * way + 1) * array.size() / (2 * kWays));
      hidden += std::ranges::any_of(obstacles, [&](const auto& obstacle) {
        return obstacle.first != patches.owner[static_cast<std::size_t>(j)] &&
               obstacle.second.hides(from, centres.col(j));
      });
    }
    hidden_area += 2 * hidden > kWays ? patches.areas(j) : 0.0;
  }
  return hidden_area / patches.areas.sum();
}

}  // namespace

BeyondSkin beyond_skin(const Scene& scene, const PlacedBodies& bodies, const TransducerArray& array, double wavelength,
                       double per_drive, std::optional<Index> count) {
  SkinPatches pieces;
  for (const auto& [body, mesh] : bodies.whole) {
    append(uncovered(pieces_of(mesh, kPiece * wavelength, body), bodies, body), pieces);
  }
  if (pieces.empty()) {
    return {};
  }
  const double drives = expected_drives(pieces.centres(), pieces.normals(), pieces.areas, array, wavelength);
  BeyondSkin beyond{count ? spread(pieces, std::numeric_limits<double>::infinity(), *count)
                          : spread(pieces, kApart * wavelength, static_cast<Index>(std::ceil(per_drive * drives)))};
  beyond.shadowed = shadowed_share(scene, bodies, array, beyond.patches);
  return beyond;
}

}  // namespace touchfield
