#include "sim/bem/coarse_space.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <stdexcept>
#include <unordered_map>
#include <utility>

#include <Eigen/Cholesky>

#include "sim/bem/coarse_formulas.h"
#include "solvers/linear/sparse_product.h"

namespace touchfield {

namespace {

using Place = Eigen::Matrix<double, 6, 1>;

/// Numbers in cubes of one side, by the first three coordinates of their places.
class Cells {
 public:
  explicit Cells(double side) : side_(side) {}

  void add(const Place& place, int number) { cells_[key(at(place))].push_back(number); }

  /// visit(number) for what lies in cubes exactly `ring` cubes away from that of a place.
  template <typename Visit>
  void for_each(const Place& place, int ring, const Visit& visit) const {
    const Eigen::Vector3i middle = at(place);
    for (int x = -ring; x <= ring; ++x) {
      for (int y = -ring; y <= ring; ++y) {
        const bool face = std::max(std::abs(x), std::abs(y)) == ring;
        for (int z = -ring; z <= ring; z += face || ring == 0 ? 1 : 2 * ring) {
          const auto found = cells_.find(key(middle + Eigen::Vector3i(x, y, z)));
          if (found != cells_.end()) {
            std::ranges::for_each(found->second, visit);
          }
        }
      }
    }
  }

  double side() const { return side_; }

 private:
  Eigen::Vector3i at(const Place& place) const {
    return (place.head<3>() / side_).array().floor().matrix().cast<int>();
  }
  static std::int64_t key(const Eigen::Vector3i& cell) {
    constexpr std::int64_t kAxis = 1 << 20;
    return ((cell.x() + kAxis / 2) * kAxis + cell.y() + kAxis / 2) * kAxis + cell.z() + kAxis / 2;
  }

  double side_;
  std::unordered_map<std::int64_t, std::vector<int>> cells_;
};

std::vector<Place> places_of(const TriangleMesh& mesh, double scale) {
  std::vector<Place> places(static_cast<std::size_t>(mesh.face_count()));
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    places[static_cast<std::size_t>(f)] << mesh.centroids().col(f), scale * mesh.normals().col(f);
  }
  return places;
}

/// Faces of which none is nearer to another than `spacing` and to one of which every face is.
std::vector<Eigen::Index> spread_points(const std::vector<Place>& places, double spacing, Cells& cells) {
  std::vector<Eigen::Index> points;
  for (std::size_t f = 0; f < places.size(); ++f) {
    bool covered = false;
    for (int ring = 0; ring <= 1 && !covered; ++ring) {
      cells.for_each(places[f], ring, [&](int p) {
        const auto point = static_cast<std::size_t>(points[static_cast<std::size_t>(p)]);
        covered = covered || (places[point] - places[f]).squaredNorm() < spacing * spacing;
      });
    }
    if (!covered) {
      cells.add(places[f], static_cast<int>(points.size()));
      points.push_back(static_cast<Eigen::Index>(f));
    }
  }
  return points;
}

/// The points nearest to a place, with their squared distances, nearest first.
void find_nearest(const std::vector<Place>& points, const Cells& cells, const Place& place, int wanted,
                  std::vector<std::pair<double, int>>& found) {
  found.clear();
  // What lies further than `ring` cubes is further than ring sides away.
  for (int ring = 0;; ++ring) {
    cells.for_each(place, ring,
                   [&](int p) { found.emplace_back((points[static_cast<std::size_t>(p)] - place).squaredNorm(), p); });
    const double certain = ring * cells.side();
    if (static_cast<int>(found.size()) >= wanted) {
      std::nth_element(found.begin(), found.begin() + wanted - 1, found.end());
      if (found[static_cast<std::size_t>(wanted - 1)].first <= certain * certain) {
        break;
      }
    }
  }
  std::sort(found.begin(), found.begin() + wanted);
  found.resize(static_cast<std::size_t>(wanted));
}

CoarseSpace::Interpolation interpolate(const std::vector<Place>& faces, const std::vector<Place>& points,
                                       const Cells& cells, double shortest) {
  const int near = std::min(kCoarseNeighbours, static_cast<int>(points.size()));
  std::vector<Eigen::Triplet<float>> entries(faces.size() * static_cast<std::size_t>(near));
#pragma omp parallel
  {
    std::vector<std::pair<double, int>> found;
    Eigen::MatrixXd c(near, near);
    Eigen::VectorXd right(near);
#pragma omp for schedule(dynamic, 256)
    for (std::int64_t f = 0; f < static_cast<std::int64_t>(faces.size()); ++f) {
      find_nearest(points, cells, faces[static_cast<std::size_t>(f)], near, found);
      for (int a = 0; a < near; ++a) {
        const Place& at = points[static_cast<std::size_t>(found[static_cast<std::size_t>(a)].second)];
        for (int b = 0; b < a; ++b) {
          const Place& other = points[static_cast<std::size_t>(found[static_cast<std::size_t>(b)].second)];
          c(a, b) = c(b, a) = coarse_covariance(shortest * (at - other).norm());
        }
        c(a, a) = 1.0 + kCoarseNugget;
        right(a) = coarse_covariance(shortest * std::sqrt(found[static_cast<std::size_t>(a)].first));
      }
      const Eigen::VectorXd weights = c.llt().solve(right);
      for (int a = 0; a < near; ++a) {
        entries[static_cast<std::size_t>(f * near + a)] = {
            static_cast<int>(f), found[static_cast<std::size_t>(a)].second, static_cast<float>(weights(a))};
      }
    }
  }
  CoarseSpace::Interpolation p(static_cast<Eigen::Index>(faces.size()), static_cast<Eigen::Index>(points.size()));
  p.setFromTriplets(entries.begin(), entries.end());
  return p;
}

Eigen::MatrixXcd product(const CoarseSpace::Interpolation& a, const Eigen::MatrixXcd& x) {
  Eigen::MatrixXcd y;
  sparse_product(a, x, y);
  return y;
}

}  // namespace

CoarseSpace::CoarseSpace(const TriangleMesh& mesh, double k) : areas_(mesh.areas()) {
  const double wavelength = 2.0 * std::numbers::pi / k;
  const std::vector<Place> faces = places_of(mesh, kCoarseNormalScale * wavelength);
  Cells cells(kCoarseSpacing * wavelength);
  points_ = spread_points(faces, kCoarseSpacing * wavelength, cells);
  std::vector<Place> points;
  for (const Eigen::Index f : points_) {
    points.push_back(faces[static_cast<std::size_t>(f)]);
  }
  places_ = Eigen::MatrixXd::Map(points.front().data(), 6, static_cast<Eigen::Index>(points.size()));
  interpolation_ = interpolate(faces, points, cells, kCoarseShortest * k);
  gathering_ = interpolation_.transpose();
  const Eigen::SparseMatrix<double> p = interpolation_.cast<double>();
  const Eigen::SparseMatrix<double> weighted = areas_.asDiagonal() * p;
  mass_.compute(p.transpose() * weighted);
  if (mass_.info() != Eigen::Success) {
    throw std::domain_error("the coarse space's points depend on each other");
  }
}

Eigen::MatrixXcd CoarseSpace::interpolated(const Eigen::MatrixXcd& c) const { return product(interpolation_, c); }

Eigen::MatrixXcd CoarseSpace::gathered(const Eigen::MatrixXcd& v) const { return product(gathering_, v); }

Eigen::MatrixXcd CoarseSpace::by_mass(const Eigen::MatrixXcd& c) const {
  Eigen::MatrixXcd y(c.rows(), c.cols());
#pragma omp parallel for schedule(static)
  for (Eigen::Index s = 0; s < c.cols(); ++s) {
    Eigen::MatrixXd parts(c.rows(), 2);
    parts << c.col(s).real(), c.col(s).imag();
    parts = mass_.solve(parts).eval();
    y.col(s).real() = parts.col(0);
    y.col(s).imag() = parts.col(1);
  }
  return y;
}

Eigen::MatrixXcd CoarseSpace::projected(const Eigen::MatrixXcd& v) const {
  return by_mass(gathered(areas_.asDiagonal() * v));
}

Eigen::MatrixXcd CoarseSpace::projected_transpose(const Eigen::MatrixXcd& c) const {
  return areas_.asDiagonal() * interpolated(by_mass(c));
}

}  // namespace touchfield
