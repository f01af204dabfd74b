#include "sim/bem/coarse_inverse.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include "sim/bem/layer_sum.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kRowsAtOnce = 16;  // of E that are made at once
constexpr double kOverlap = 0.75;         // wavelengths

using Numbers = std::vector<Eigen::Index>;

/// Halves along the longest extent until no part has more than `most`.
void split(const Eigen::MatrixXd& places, Numbers part, std::size_t most, std::vector<Numbers>& parts) {
  if (part.size() <= most) {
    parts.push_back(std::move(part));
    return;
  }
  const Eigen::MatrixXd of = places(Eigen::all, part);
  Eigen::Index axis = 0;
  (of.rowwise().maxCoeff() - of.rowwise().minCoeff()).maxCoeff(&axis);
  const auto middle = part.begin() + static_cast<std::ptrdiff_t>(part.size() / 2);
  std::nth_element(part.begin(), middle, part.end(), [&](Eigen::Index a, Eigen::Index b) {
    return std::pair(places(axis, a), a) < std::pair(places(axis, b), b);
  });
  split(places, Numbers(part.begin(), middle), most, parts);
  split(places, Numbers(middle, part.end()), most, parts);
}

/// Those outside a part that lie within `reach` of the box around it.
void add_neighbours(const Eigen::MatrixXd& places, double reach, Numbers& part) {
  const Eigen::MatrixXd of = places(Eigen::all, part);
  const Eigen::VectorXd low = of.rowwise().minCoeff();
  const Eigen::VectorXd high = of.rowwise().maxCoeff();
  std::vector<bool> inside(static_cast<std::size_t>(places.cols()));
  for (const Eigen::Index p : part) {
    inside[static_cast<std::size_t>(p)] = true;
  }
  for (Eigen::Index p = 0; p < places.cols(); ++p) {
    const Eigen::VectorXd out = (low - places.col(p)).cwiseMax(places.col(p) - high).cwiseMax(0.0);
    if (!inside[static_cast<std::size_t>(p)] && out.squaredNorm() < reach * reach) {
      part.push_back(p);
    }
  }
}

/// E of some points: rows of B over the faces that interpolate from them, times P.
class BlockMatrix {
 public:
  BlockMatrix(const TriangleMesh& mesh, const Complex& wavenumber, const BoundaryParts& parts,
              const CoarseSpace& coarse, const Numbers& points)
      : parts_(parts), faces_at_(static_cast<std::size_t>(mesh.face_count()), -1), points_(points), coarse_(coarse) {
    std::vector<std::int32_t> point_at(static_cast<std::size_t>(coarse.size()), -1);
    for (std::size_t p = 0; p < points.size(); ++p) {
      point_at[static_cast<std::size_t>(points[p])] = static_cast<std::int32_t>(p);
    }
    Numbers faces;
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      const std::size_t before = weights_.size();
      for (CoarseSpace::Interpolation::InnerIterator it(coarse.interpolation(), f); it; ++it) {
        if (const std::int32_t at = point_at[static_cast<std::size_t>(it.col())]; at >= 0) {
          weights_.emplace_back(at, it.value());
        }
      }
      if (weights_.size() > before) {
        faces_at_[static_cast<std::size_t>(f)] = static_cast<std::int32_t>(faces.size());
        faces.push_back(f);
        ends_.push_back(weights_.size());
      }
    }
    sum_.emplace(TriangleMesh(mesh.vertices(), mesh.triangles()(Eigen::all, faces)), wavenumber, parts.gamma);
  }

  Eigen::MatrixXcf make() const {
    const auto size = static_cast<Eigen::Index>(points_.size());
    Eigen::MatrixXcf e(size, size);
#pragma omp parallel
    {
      Eigen::VectorXcf row(sum_->size());
      Eigen::ArrayXXf rows(sum_->size(), 2 * kRowsAtOnce);
      std::vector<Row> sums(points_.size());
#pragma omp for schedule(dynamic)
      for (Eigen::Index first = 0; first < size; first += kRowsAtOnce) {
        const Eigen::Index count = std::min(kRowsAtOnce, size - first);
        for (Eigen::Index q = 0; q < count; ++q) {
          fill_row(points_[static_cast<std::size_t>(first + q)], row);
          rows.col(q) = row.real();
          rows.col(kRowsAtOnce + q) = row.imag();
        }
        interpolate(rows, sums);
        for (Eigen::Index c = 0; c < size; ++c) {
          const Row& of = sums[static_cast<std::size_t>(c)];
          for (Eigen::Index q = 0; q < count; ++q) {
            e(first + q, c) = {of(q), of(kRowsAtOnce + q)};
          }
        }
      }
    }
    return e;
  }

 private:
  using Row = Eigen::Array<float, 1, 2 * kRowsAtOnce>;  // real parts of rows, then imaginary ones

  void fill_row(Eigen::Index point, Eigen::VectorXcf& row) const {
    const Eigen::Index face = coarse_.points()[static_cast<std::size_t>(point)];
    const std::int32_t at = faces_at_[static_cast<std::size_t>(face)];  // a point interpolates from itself
    sum_->row(parts_.layer, at, row);
    row *= -1.0F;
    parts_.near->add_row(-1.0, face, faces_at_, row);
    row(at) += static_cast<std::complex<float>>(parts_.diagonal(face));
  }

  /// Rows times P.
  void interpolate(const Eigen::ArrayXXf& rows, std::vector<Row>& sums) const {
    constexpr Eigen::Index kFaces = 16;  // turned row by row at once, in the nearest cache
    Eigen::Array<float, kFaces, 2 * kRowsAtOnce, Eigen::RowMajor> turned;
    std::ranges::fill(sums, Row::Zero());
    std::size_t weight = 0;
    for (Eigen::Index first = 0; first < rows.rows(); first += kFaces) {
      const Eigen::Index faces = std::min(kFaces, rows.rows() - first);
      turned.topRows(faces) = rows.middleRows(first, faces);
      for (Eigen::Index j = 0; j < faces; ++j) {
        const Row values = turned.row(j);
        for (; weight < ends_[static_cast<std::size_t>(first + j)]; ++weight) {
          sums[static_cast<std::size_t>(weights_[weight].first)] += weights_[weight].second * values;
        }
      }
    }
  }

  const BoundaryParts& parts_;
  std::vector<std::int32_t> faces_at_;  // among those that interpolate from the points; -1: not
  const Numbers& points_;
  const CoarseSpace& coarse_;
  std::vector<std::pair<std::int32_t, float>> weights_;  // face by face: point, weight
  std::vector<std::size_t> ends_;                        // of a face's weights
  std::optional<LayerSum<float>> sum_;
};

}  // namespace

CoarseInverse::CoarseInverse(const TriangleMesh& mesh, const Complex& wavenumber, const BoundaryParts& parts,
                             const CoarseSpace& coarse) {
  Numbers all(static_cast<std::size_t>(coarse.size()));
  std::iota(all.begin(), all.end(), 0);
  std::vector<Numbers> shares;
  const Eigen::Index most = coarse.size() <= kWholePoints ? kWholePoints : kBlockPoints;
  split(coarse.places(), all, static_cast<std::size_t>(most), shares);
  const double reach = kOverlap * 2.0 * std::numbers::pi / wavenumber.real();
  for (Numbers& share : shares) {
    Block block;
    block.own = static_cast<Eigen::Index>(share.size());
    add_neighbours(coarse.places(), reach, share);
    block.lu = std::make_unique<DenseLuSingle>(BlockMatrix(mesh, wavenumber, parts, coarse, share).make());
    block.points = std::move(share);
    blocks_.push_back(std::move(block));
  }
}

double CoarseInverse::reciprocal_condition() const {
  double worst = 1.0;
  for (const Block& block : blocks_) {
    worst = std::min(worst, block.lu->reciprocal_condition());
  }
  return worst;
}

Eigen::MatrixXcd CoarseInverse::solve(const Eigen::MatrixXcd& c) const {
  Eigen::MatrixXcd x(c.rows(), c.cols());
#pragma omp parallel for schedule(dynamic) if (blocks() > 1)
  for (Eigen::Index b = 0; b < blocks(); ++b) {
    const Block& block = blocks_[static_cast<std::size_t>(b)];
    const Eigen::MatrixXcf right = c(block.points, Eigen::all).cast<std::complex<float>>();
    const Eigen::MatrixXcf solved = block.lu->solve(right);
    for (Eigen::Index i = 0; i < block.own; ++i) {
      x.row(block.points[static_cast<std::size_t>(i)]) = solved.row(i).cast<Complex>();
    }
  }
  return x;
}

Eigen::MatrixXcd CoarseInverse::solve_transpose(const Eigen::MatrixXcd& c) const {
  std::vector<Eigen::MatrixXcf> solved(blocks_.size());
#pragma omp parallel for schedule(dynamic) if (blocks() > 1)
  for (Eigen::Index b = 0; b < blocks(); ++b) {
    const Block& block = blocks_[static_cast<std::size_t>(b)];
    Eigen::MatrixXcf right = c(block.points, Eigen::all).cast<std::complex<float>>();
    right.bottomRows(right.rows() - block.own).setZero();
    solved[static_cast<std::size_t>(b)] = block.lu->solve_transpose(std::move(right));
  }
  Eigen::MatrixXcd x = Eigen::MatrixXcd::Zero(c.rows(), c.cols());
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    x(blocks_[b].points, Eigen::all) += solved[b].cast<Complex>();
  }
  return x;
}

}  // namespace touchfield
