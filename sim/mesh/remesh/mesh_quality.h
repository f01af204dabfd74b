#pragma once

#include <optional>
#include <vector>

#include "sim/core/types.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// Edge length asked for within some distance of a point.
struct SizingZone {
  Vector3 centre;  // [m]
  double edge;     // [m], > 0
  double within;   // [m], >= 0
};

/// Wanted edge length h(x) as a function of place:
///
///   h(x) = min(far, min over zones z of edge_z + growth max(0, |x - c_z| - within_z))
///
/// The gradient of h is at most `growth`, so that the edges of neighbouring faces differ by a factor of about
/// 1 + growth.
class EdgeSizing {
 public:
  static constexpr double kGrowth = 0.2;

  /// far      edge length away from every zone [m], > 0
  /// growth   0.02 to 0.6
  /// throws   InputError on a value out of range or not finite
  explicit EdgeSizing(double far, std::vector<SizingZone> zones = {}, double growth = kGrowth);

  double at(const Vector3& x) const;
  Eigen::VectorXd at(const Points& points) const;

  double far() const { return far_; }
  double finest() const;  // least edge length anywhere
  const std::vector<SizingZone>& zones() const { return zones_; }
  double growth() const { return growth_; }

 private:
  double far_;
  std::vector<SizingZone> zones_;
  double growth_;
};

/// Edges per wavelength. The local edge of a face is the side of the equilateral triangle of its area, as in MeshRisks.
struct Resolution {
  Eigen::Index faces;  // counted, >= 1
  double mean;         // wavelength over the side of the equilateral triangle of their mean area
  double least;        // wavelength over the longest local edge
  double least_5;      // 5th percentile over their area: a twentieth of it has longer local edges
};

/// The edges of a mesh against what was asked: ratios r = length / h(middle of the edge), each edge once.
struct EdgeFit {
  static constexpr double kShortest = 0.6;
  static constexpr double kLongest = 1.6;

  double share;     // of the edges with kShortest <= r <= kLongest
  double mean_log;  // mean of ln r: 0 if the edges are as long as asked, +0.1 if they are 10 % too long
  double rms_log;   // root mean square of ln r about 0
  double shortest;  // least r
  double longest;   // largest r
};

/// How good a mesh is for boundary elements where nothing is wrong with it; see MeshRisks for what may be, and where.
struct MeshQuality {
  double smallest_angle;         // [rad]
  double smallest_angle_1;       // [rad], 1st percentile over the faces of their smallest angles
  Resolution resolution;         // over the whole mesh
  std::optional<EdgeFit> edges;  // if a sizing was given
};

/// mesh         closed or open
/// wavelength   [m], > 0
/// sizing       what was asked of its edges
/// throws       InputError if the wavelength is not positive
MeshQuality mesh_quality(const TriangleMesh& mesh, double wavelength,
                         const std::optional<EdgeSizing>& sizing = std::nullopt);

/// Over the faces whose centroids are within `radius` [m] of a point; none if there are no such faces.
///
/// throws   InputError if the wavelength is not positive
std::optional<Resolution> resolution_within(const TriangleMesh& mesh, double wavelength, const Vector3& centre,
                                            double radius);

/// Over the faces of a mesh that are marked, M; none if there are none.
///
/// throws   InputError if the wavelength is not positive
std::optional<Resolution> resolution_where(const TriangleMesh& mesh, double wavelength,
                                           const std::vector<unsigned char>& marked);

EdgeFit edge_fit(const TriangleMesh& mesh, const EdgeSizing& sizing);

/// Smallest angle of each face [rad].
Eigen::VectorXd smallest_angles(const TriangleMesh& mesh);

/// How many faces a mesh of this surface has if its edges are as asked: the integral of 4 / (sqrt(3) h^2) over it.
///
/// most       stops there
/// accuracy   2 %
double wanted_faces(const TriangleMesh& mesh, const EdgeSizing& sizing, double most);

}  // namespace touchfield
