#include "sim/mesh/remesh/mesh_quality.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "sim/core/require.h"
#include "sim/mesh/face_shape.h"
#include "sim/mesh/topology.h"

namespace touchfield {

namespace {

/// Side of the equilateral triangle of an area.
double side_of(double area) { return std::sqrt(area * 4.0 / std::sqrt(3.0)); }

template <class Counts>
std::optional<Resolution> resolution_of(const TriangleMesh& mesh, double wavelength, const Counts& counts) {
  require(wavelength > 0 && std::isfinite(wavelength), "mesh quality: wavelength = {} m must be > 0 and finite",
          wavelength);
  std::vector<double> faces;  // areas
  double area = 0;
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    if (counts(f)) {
      faces.push_back(mesh.areas()(f));
      area += mesh.areas()(f);
    }
  }
  if (faces.empty()) {
    return std::nullopt;
  }
  std::sort(faces.begin(), faces.end(), std::greater<>());
  std::size_t fifth = 0;
  for (double larger = faces[0]; larger < 0.05 * area; larger += faces[fifth]) {
    ++fifth;
  }
  return Resolution{static_cast<Eigen::Index>(faces.size()),
                    wavelength / side_of(area / static_cast<double>(faces.size())), wavelength / side_of(faces.front()),
                    wavelength / side_of(faces[fifth])};
}

/// A flat triangle of the surface.
struct Part {
  Vector3 a;
  Vector3 b;
  Vector3 c;

  double longest() const { return std::max({(b - a).norm(), (c - b).norm(), (a - c).norm()}); }

  /// The two halves on either side of the middle of the longest edge: no slivers come of it.
  std::pair<Part, Part> halves() const {
    const double ab = (b - a).squaredNorm();
    const double bc = (c - b).squaredNorm();
    const double ca = (a - c).squaredNorm();
    if (ab >= bc && ab >= ca) {
      const Vector3 middle = 0.5 * (a + b);
      return {{a, middle, c}, {middle, b, c}};
    }
    return bc >= ca ? Part{b, c, a}.halves() : Part{c, a, b}.halves();
  }
};

}  // namespace

EdgeSizing::EdgeSizing(double far, std::vector<SizingZone> zones, double growth)
    : far_(far), zones_(std::move(zones)), growth_(growth) {
  const auto require_length = [](const char* field, double value, bool zero) {
    require((zero ? value >= 0 : value > 0) && std::isfinite(value), "{} = {} m must be {} 0 and finite", field, value,
            zero ? ">=" : ">");
  };
  require_length("edge_mm.far", far_, false);
  for (const SizingZone& zone : zones_) {
    require_length("edge_mm.near_target", zone.edge, false);
    require_length("edge_mm.within_mm", zone.within, true);
    require(zone.centre.allFinite(), "edge_mm: the centre of a zone must be finite");
  }
  require(growth_ >= 0.02 && growth_ <= 0.6, "edge_mm.growth = {} must be 0.02 to 0.6", growth_);
}

double EdgeSizing::at(const Vector3& x) const {
  double edge = far_;
  for (const SizingZone& zone : zones_) {
    edge = std::min(edge, zone.edge + growth_ * std::max(0.0, (x - zone.centre).norm() - zone.within));
  }
  return edge;
}

Eigen::VectorXd EdgeSizing::at(const Points& points) const {
  Eigen::VectorXd edges(points.cols());
  for (Eigen::Index i = 0; i < points.cols(); ++i) {
    edges(i) = at(Vector3(points.col(i)));
  }
  return edges;
}

double EdgeSizing::finest() const {
  double edge = far_;
  for (const SizingZone& zone : zones_) {
    edge = std::min(edge, zone.edge);
  }
  return edge;
}

Eigen::VectorXd smallest_angles(const TriangleMesh& mesh) {
  Eigen::VectorXd angles(mesh.face_count());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    angles(f) = smallest_angle(mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2));
  }
  return angles;
}

EdgeFit edge_fit(const TriangleMesh& mesh, const EdgeSizing& sizing) {
  const EdgeTable table = edge_table(mesh.triangles());
  EdgeFit fit{0, 0, 0, std::numeric_limits<double>::infinity(), 0};
  for (Eigen::Index e = 0; e < table.ends.cols(); ++e) {
    const Vector3 a = mesh.vertices().col(table.ends(0, e));
    const Vector3 b = mesh.vertices().col(table.ends(1, e));
    const double ratio = (b - a).norm() / sizing.at(Vector3(0.5 * (a + b)));
    fit.share += ratio >= EdgeFit::kShortest && ratio <= EdgeFit::kLongest ? 1.0 : 0.0;
    fit.mean_log += std::log(ratio);
    fit.rms_log += std::pow(std::log(ratio), 2);
    fit.shortest = std::min(fit.shortest, ratio);
    fit.longest = std::max(fit.longest, ratio);
  }
  const auto count = static_cast<double>(table.ends.cols());
  fit.share /= count;
  fit.mean_log /= count;
  fit.rms_log = std::sqrt(fit.rms_log / count);
  return fit;
}

MeshQuality mesh_quality(const TriangleMesh& mesh, double wavelength, const std::optional<EdgeSizing>& sizing) {
  const Resolution resolution = *resolution_of(mesh, wavelength, [](Eigen::Index) { return true; });
  Eigen::VectorXd angles = smallest_angles(mesh);
  std::sort(angles.begin(), angles.end());
  MeshQuality quality{angles(0), angles((angles.size() - 1) / 100), resolution, std::nullopt};
  if (sizing) {
    quality.edges = edge_fit(mesh, *sizing);
  }
  return quality;
}

std::optional<Resolution> resolution_within(const TriangleMesh& mesh, double wavelength, const Vector3& centre,
                                            double radius) {
  return resolution_of(mesh, wavelength,
                       [&](Eigen::Index f) { return (mesh.centroids().col(f) - centre).norm() <= radius; });
}

std::optional<Resolution> resolution_where(const TriangleMesh& mesh, double wavelength,
                                           const std::vector<unsigned char>& marked) {
  return resolution_of(mesh, wavelength, [&](Eigen::Index f) { return marked[static_cast<std::size_t>(f)] != 0; });
}

double wanted_faces(const TriangleMesh& mesh, const EdgeSizing& sizing, double most) {
  constexpr double kPatch = 0.5;  // of h: as h grows by 0.6 of the distance at most, the one at the centroid will do
  constexpr double kFarthest = 1e9;
  const EdgeSizing uncapped(kFarthest, sizing.zones(), sizing.growth());
  // No edge is longer than `far`. A surface that has too many of them at once is not taken apart: patches of one that
  // is far larger than its edges would never get small, for want of digits.
  if (mesh.total_area() >= most * (std::sqrt(3.0) / 4.0 * sizing.far() * sizing.far())) {
    return most;
  }
  double faces = 0;
  std::vector<Part> waiting;
  for (Eigen::Index f = 0; f < mesh.face_count() && faces < most; ++f) {
    waiting.push_back({mesh.corner(f, 0), mesh.corner(f, 1), mesh.corner(f, 2)});
    while (!waiting.empty() && faces < most) {
      const Part patch = waiting.back();
      waiting.pop_back();
      const Vector3 centroid = (patch.a + patch.b + patch.c) / 3.0;
      const double edge = sizing.at(centroid);
      const bool far_from_zones = uncapped.at(centroid) - sizing.growth() * patch.longest() >= sizing.far();
      if (far_from_zones || patch.longest() <= kPatch * edge) {
        faces += 0.5 * (patch.b - patch.a).cross(patch.c - patch.a).norm() / (std::sqrt(3.0) / 4.0 * edge * edge);
      } else {
        const auto [one, other] = patch.halves();
        waiting.push_back(one);
        waiting.push_back(other);
      }
    }
    waiting.clear();
  }
  return std::min(faces, most);
}

}  // namespace touchfield
