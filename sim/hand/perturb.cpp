#include "sim/hand/perturb.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>
#include <vector>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/random.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/mesh/query/self_intersections.h"
#include "sim/mesh/remesh/surface_remesh.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kWaves = 1024;

using Index = Eigen::Index;

constexpr double kLeastKept = 0.8;  // of the noise's rms
// Displacements at which the skin must be sound too: gaps keep a sixth of their width.
constexpr double kSoundMargin = 1.2;

void require_noise_within(const char* field, double value, double least, double most) {
  require(value >= least && value <= most, "sensing: {} = {:.6g} mm must be {:.6g} to {:.6g} mm", field,
          value / kMillimetre, least / kMillimetre, most / kMillimetre);
}

/// Whether a face is turned over or drawn thin on moved vertices.
bool is_spoilt(const TriangleMesh& mesh, const Points& vertices, Index f) {
  constexpr double kTurned = 0.1;    // cosine between the old and the new normal: 84 degrees, a slope of 10
  constexpr double kThinner = 0.25;  // area over the square of the longest edge, new over old
  constexpr double kNoArea = 3e-12;  // of twice that: a mesh takes no face much below
  const auto shape = [](const Vector3& a, const Vector3& b, const Vector3& c) -> Vector3 {
    return (b - a).cross(c - a) / std::max({(b - a).squaredNorm(), (c - b).squaredNorm(), (a - c).squaredNorm()});
  };
  const auto moved = [&](int c) { return vertices.col(mesh.triangles()(c, f)); };
  const Vector3 before = shape(mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2));
  const Vector3 after = shape(moved(0), moved(1), moved(2));
  return !(after.dot(before) > kTurned * after.norm() * before.norm() &&
           after.norm() > std::max(kThinner * before.norm(), kNoArea));
}

/// Faces of a skin on moved vertices that are spoilt; if there are none, those that cut others.
std::vector<Index> faults(const TriangleMesh& mesh, const Points& vertices) {
  std::set<Index> faces;
  for (Index f = 0; f < mesh.face_count(); ++f) {
    if (is_spoilt(mesh, vertices, f)) {
      faces.insert(f);
    }
  }
  if (faces.empty()) {
    constexpr std::size_t kAll = 1000000;
    for (const auto& [f, g] : self_intersections(TriangleMesh(vertices, mesh.triangles()), kAll)) {
      faces.insert({f, g});
    }
  }
  return {faces.begin(), faces.end()};
}

/// Scales the displacements down round faces, to 3/4 there and less and less towards `reach`.
void damp(const TriangleMesh& mesh, const std::vector<Index>& faces, double reach, Eigen::VectorXd& shares) {
  constexpr double kTaken = 0.25;
  constexpr double kFar = 4.0;  // reaches: exp(-8) of a quarter is left
  const TriangleMesh round(mesh.vertices(), mesh.triangles()(Eigen::all, faces));
  const FaceTree tree(round);
#pragma omp parallel for schedule(dynamic, 256)
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    const SkinPoint near = tree.nearest(mesh.vertices().col(v), kFar * reach);
    if (near.face >= 0) {
      const double ratio = near.distance / reach;
      shares(v) *= 1.0 - kTaken * std::exp(-0.5 * ratio * ratio);
    }
  }
}

/// One body under one seed's noise, at any rms.
class NoisySkin {
 public:
  struct Damped {
    Points vertices;         // moved by what is left of the displacement, and the offset
    Eigen::VectorXd shares;  // of the displacement that are left at the vertices
    double kept;             // rms that is left over that without damping
    bool sound;
  };

  NoisySkin(const TriangleMesh& mesh, const SensingNoise& noise)
      : mesh_(mesh),
        noise_(noise),
        means_(mesh),
        unit_(RandomField(1.0, noise.correlation, noise.seed).at(mesh.vertices())) {}

  /// The displacement at this rms, damped until the skin is sound or too little is left.
  Damped damped(double rms) const {
    constexpr double kGentle = 10.0;   // rms: the slope that damping adds to a displacement is a tenth of it over rms
    constexpr double kResolved = 2.0;  // edges
    constexpr int kRounds = 60;
    const double reach = std::max(std::min(noise_.correlation, kGentle * rms), kResolved * mesh_.mean_edge());
    Damped result{Points(), Eigen::VectorXd::Ones(mesh_.vertex_count()), 1.0, false};
    for (int round = 0; round < kRounds && result.kept >= kLeastKept; ++round) {
      std::vector<Index> found = faults(mesh_, moved(kSoundMargin * rms * result.shares));
      if (found.empty()) {
        result.vertices = moved(rms * result.shares);
        found = faults(mesh_, result.vertices);
      }
      if (found.empty()) {
        result.sound = true;
        break;
      }
      damp(mesh_, found, reach, result.shares);
      result.kept = over_skin(unit_.cwiseProduct(result.shares)) / over_skin(unit_);
    }
    return result;
  }

  Perturbed finished(Damped skin, double rms) const {
    constexpr double kDamped = 0.95;
    const double damped = (skin.shares.array() < kDamped).select(means_.areas, 0.0).sum() / means_.areas.sum();
    const double drawn = rms * over_skin(unit_);
    return {TriangleMesh(std::move(skin.vertices), mesh_.triangles()), skin.kept * drawn, drawn, damped};
  }

  /// The largest rms found below one that does not do; 0 if there is none.
  double rms_that_does(double too_much) const {
    constexpr int kHalvings = 5;
    constexpr double kStep = 0.01 * kMillimetre;
    double does = 0;
    for (int i = 0; i < kHalvings; ++i) {
      const double rms = std::floor(0.5 * (does + too_much) / kStep) * kStep;
      (damped(rms).sound ? does : too_much) = rms;
    }
    return does;
  }

  Vector3 worst_place(const Damped& skin) const {
    Index v = 0;
    skin.shares.minCoeff(&v);
    return mesh_.vertices().col(v);
  }

 private:
  /// The vertices moved by the field times `scales`, and the offset.
  Points moved(const Eigen::VectorXd& scales) const {
    return (mesh_.vertices() + means_.normals * unit_.cwiseProduct(scales).asDiagonal()).colwise() + noise_.offset;
  }

  double over_skin(const Eigen::VectorXd& values) const {
    return std::sqrt(values.cwiseAbs2().dot(means_.areas) / means_.areas.sum());
  }

  const TriangleMesh& mesh_;
  const SensingNoise& noise_;
  VertexMeans means_;
  Eigen::VectorXd unit_;  // displacement at an rms of 1
};

}  // namespace

RandomField::RandomField(double rms, double correlation, std::uint64_t seed)
    : wavevectors_(3, kWaves), phases_(kWaves), amplitudes_(kWaves) {
  NormalPairs normal(seed);
  const double scale = rms / std::sqrt(static_cast<double>(kWaves));
  for (Eigen::Index m = 0; m < kWaves; ++m) {
    const NormalPairs::Polar across = normal.next();
    const NormalPairs::Polar along = normal.next();
    const NormalPairs::Polar wave = normal.next();
    wavevectors_.col(m) = Vector3(across.first(), across.second(), along.first()) / correlation;
    amplitudes_(m) = scale * wave.radius;
    phases_(m) = wave.angle;
  }
}

Eigen::VectorXd RandomField::at(const Points& points) const {
  Eigen::VectorXd values(points.cols());
#pragma omp parallel for schedule(static) if (points.cols() > 512)
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    const Vector3 x = points.col(i);
    double sum = 0;
    for (Eigen::Index m = 0; m < kWaves; ++m) {
      sum += amplitudes_(m) * std::cos(wavevectors_.col(m).dot(x) + phases_(m));
    }
    values(i) = sum;
  }
  return values;
}

Perturbed perturbed(const TriangleMesh& mesh, const SensingNoise& noise) {
  require_noise_within("noise rms", noise.rms, 0, 3e-3);
  require_noise_within("correlation", noise.correlation, 1e-3, 0.1);
  require(noise.offset.allFinite(), "sensing: offset = {} must be finite", place_text(noise.offset));
  if (noise.rms == 0) {
    return {TriangleMesh(mesh.vertices().colwise() + noise.offset, mesh.triangles()), 0, 0, 0};
  }
  if (const auto cuts = self_intersections(mesh, 1); !cuts.empty()) {
    throw InputError(
        fmt::format("sensing: faces {} and {} of the body intersect near {}; noise needs a skin without intersections",
                    cuts[0].first, cuts[0].second, place_text(mesh.centroids().col(cuts[0].first))));
  }
  const NoisySkin skin(mesh, noise);
  NoisySkin::Damped damped = skin.damped(noise.rms);
  if (damped.sound) {
    return skin.finished(std::move(damped), noise.rms);
  }
  const double smaller = skin.rms_that_does(noise.rms);
  throw InputError(fmt::format(
      "sensing: noise of {:.6g} mm rms over {:.6g} mm with seed {} makes the skin fold or intersect itself. The worst "
      "place is near {}; more than {:.0f} % of the skin would need damping; {}",
      noise.rms / kMillimetre, noise.correlation / kMillimetre, noise.seed, place_text(skin.worst_place(damped)),
      100 * (1 - kLeastKept),
      smaller > 0 ? fmt::format("{:.2f} mm rms would do", smaller / kMillimetre) : "no smaller rms was found to do"));
}

SkinPatches perturbed(SkinPatches patches, const SensingNoise& noise) {
  const Eigen::VectorXd heights = noise.rms * RandomField(1.0, noise.correlation, noise.seed).at(patches.centres());
  const Points shifts = (patches.normals() * heights.asDiagonal()).colwise() + noise.offset;
  for (Index j = 0; j < patches.size(); ++j) {
    patches.corners.middleCols<3>(3 * j).colwise() += shifts.col(j);
  }
  return patches;
}

}  // namespace touchfield
