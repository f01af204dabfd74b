#include "sim/bem/coarse_inverse.h"

#include <algorithm>
#include <numbers>
#include <numeric>
#include <utility>

#include "sim/bem/layer_sum.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kRowsAtOnce = 16;   // of E that are made at once
constexpr Eigen::Index kWhole = 5000;      // points up to which E is factorised as a whole
constexpr Eigen::Index kOwnPoints = 2000;  // points of a block's own, at most, beyond
constexpr double kOverlap = 0.75;          // wavelengths

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

/// Rows of E, kRowsAtOnce at a time.
class CoarseRows {
 public:
  /// Real parts of the rows, then imaginary ones.
  using Row = Eigen::Array<float, 1, 2 * kRowsAtOnce>;

  CoarseRows(const TriangleMesh& mesh, const BoundaryParts& parts, const CoarseSpace& coarse)
      : parts_(parts),
        coarse_(coarse),
        row_(mesh.face_count()),
        rows_(mesh.face_count(), 2 * kRowsAtOnce),
        sums_(static_cast<std::size_t>(coarse.size())) {}

  /// Of the given points, at most kRowsAtOnce; entry c holds column c of these rows.
  const std::vector<Row>& make(const LayerSum<float>& sum, const Eigen::Index* points, Eigen::Index count) {
    rows_.setZero();
    for (Eigen::Index q = 0; q < count; ++q) {
      const Eigen::Index i = coarse_.points()[static_cast<std::size_t>(points[q])];
      sum.row(parts_.layer, i, row_);
      row_ *= -1.0F;
      parts_.near->add_row(-1.0, i, row_);
      row_(i) += static_cast<std::complex<float>>(parts_.diagonal(i));
      rows_.col(q) = row_.real();
      rows_.col(kRowsAtOnce + q) = row_.imag();
    }
    std::ranges::fill(sums_, Row::Zero());
    constexpr Eigen::Index kFaces = 16;  // turned row by row at once, in the nearest cache
    Eigen::Array<float, kFaces, 2 * kRowsAtOnce, Eigen::RowMajor> turned;
    for (Eigen::Index first = 0; first < row_.size(); first += kFaces) {
      const Eigen::Index faces = std::min(kFaces, row_.size() - first);
      turned.topRows(faces) = rows_.middleRows(first, faces);
      for (Eigen::Index j = 0; j < faces; ++j) {
        const Row values = turned.row(j);
        for (CoarseSpace::Interpolation::InnerIterator it(coarse_.interpolation(), first + j); it; ++it) {
          sums_[static_cast<std::size_t>(it.col())] += it.value() * values;
        }
      }
    }
    return sums_;
  }

 private:
  const BoundaryParts& parts_;
  const CoarseSpace& coarse_;
  Eigen::VectorXcf row_;
  Eigen::ArrayXXf rows_;
  std::vector<Row> sums_;
};

}  // namespace

CoarseInverse::CoarseInverse(const TriangleMesh& mesh, const Complex& wavenumber, const BoundaryParts& parts,
                             const CoarseSpace& coarse) {
  Numbers all(static_cast<std::size_t>(coarse.size()));
  std::iota(all.begin(), all.end(), 0);
  std::vector<Numbers> shares;
  split(coarse.places(), all, static_cast<std::size_t>(coarse.size() <= kWhole ? kWhole : kOwnPoints), shares);
  const double reach = kOverlap * 2.0 * std::numbers::pi / wavenumber.real();
  std::vector<Eigen::MatrixXcf> matrices;
  std::vector<std::vector<std::pair<std::size_t, Eigen::Index>>> places(all.size());  // of a row: blocks and rows there
  Numbers order;
  for (Numbers& share : shares) {
    Block block;
    block.own = static_cast<Eigen::Index>(share.size());
    order.insert(order.end(), share.begin(), share.end());
    add_neighbours(coarse.places(), reach, share);
    for (std::size_t row = 0; row < share.size(); ++row) {
      places[static_cast<std::size_t>(share[row])].emplace_back(blocks_.size(), static_cast<Eigen::Index>(row));
    }
    const auto size = static_cast<Eigen::Index>(share.size());
    matrices.emplace_back(size, size);
    block.points = std::move(share);
    blocks_.push_back(std::move(block));
  }
  const LayerSum<float> sum(mesh, wavenumber, parts.gamma);
#pragma omp parallel
  {
    CoarseRows rows(mesh, parts, coarse);
#pragma omp for schedule(dynamic)
    for (Eigen::Index first = 0; first < coarse.size(); first += kRowsAtOnce) {
      const Eigen::Index count = std::min(kRowsAtOnce, coarse.size() - first);
      const auto& made = rows.make(sum, order.data() + first, count);
      for (Eigen::Index q = 0; q < count; ++q) {
        for (const auto& [block, row] : places[static_cast<std::size_t>(order[static_cast<std::size_t>(first + q)])]) {
          const Numbers& columns = blocks_[block].points;
          for (std::size_t c = 0; c < columns.size(); ++c) {
            const CoarseRows::Row& of = made[static_cast<std::size_t>(columns[c])];
            matrices[block](row, static_cast<Eigen::Index>(c)) = {of(q), of(kRowsAtOnce + q)};
          }
        }
      }
    }
  }
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    blocks_[b].lu = std::make_unique<DenseLuSingle>(std::move(matrices[b]));
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
