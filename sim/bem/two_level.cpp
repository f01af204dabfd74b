#include "sim/bem/two_level.h"

#include <algorithm>
#include <vector>

#include "sim/bem/layer_sum.h"

namespace touchfield {

namespace {

constexpr Eigen::Index kRows = 16;    // of E at once

/// E = B[points, :] P.
Eigen::MatrixXcf coarse_matrix(const TriangleMesh& mesh, const Complex& wavenumber, const BoundaryParts& parts,
                               const CoarseSpace& coarse) {
  const LayerSum<float> sum(mesh, wavenumber, parts.gamma);
  const auto& points = coarse.points();
  const CoarseSpace::Interpolation& p = coarse.interpolation();
  Eigen::MatrixXcf e(coarse.size(), coarse.size());
  const Eigen::Index blocks = (coarse.size() + kRows - 1) / kRows;
#pragma omp parallel
  {
    using Row = Eigen::Array<float, 1, 2 * kRows>;  // real parts of the rows, then imaginary ones
    std::vector<Row> sums(static_cast<std::size_t>(coarse.size()));
    std::vector<Row> values(static_cast<std::size_t>(mesh.face_count()));
    Eigen::VectorXcf row(mesh.face_count());
#pragma omp for schedule(dynamic)
    for (Eigen::Index block = 0; block < blocks; ++block) {
      const Eigen::Index first = block * kRows;
      const Eigen::Index rows = std::min(kRows, coarse.size() - first);
      std::ranges::fill(values, Row::Zero());
      std::ranges::fill(sums, Row::Zero());
      for (Eigen::Index q = 0; q < rows; ++q) {
        const Eigen::Index i = points[static_cast<std::size_t>(first + q)];
        sum.row(parts.layer, i, row);
        row *= -1.0F;
        parts.near->add_row(-1.0, i, row);
        row(i) += static_cast<std::complex<float>>(parts.diagonal(i));
        for (Eigen::Index j = 0; j < row.size(); ++j) {
          values[static_cast<std::size_t>(j)](q) = row(j).real();
          values[static_cast<std::size_t>(j)](kRows + q) = row(j).imag();
        }
      }
      for (Eigen::Index j = 0; j < row.size(); ++j) {
        for (CoarseSpace::Interpolation::InnerIterator it(p, j); it; ++it) {
          sums[static_cast<std::size_t>(it.col())] += it.value() * values[static_cast<std::size_t>(j)];
        }
      }
      for (Eigen::Index c = 0; c < coarse.size(); ++c) {
        for (Eigen::Index q = 0; q < rows; ++q) {
          const Row& of = sums[static_cast<std::size_t>(c)];
          e(first + q, c) = {of(q), of(kRows + q)};
        }
      }
    }
  }
  return e;
}

}  // namespace

TwoLevel::TwoLevel(const TriangleMesh& mesh, const Complex& wavenumber, double coupling, const BoundaryParts& parts)
    : coarse_(mesh, wavenumber.real()),
      filter_(mesh, wavenumber, coupling),
      inverse_(std::make_unique<DenseLuSingle>(coarse_matrix(mesh, wavenumber, parts, coarse_))) {}

Eigen::MatrixXcd TwoLevel::apply(const Eigen::MatrixXcd& x) const {
  const Eigen::MatrixXcd r = coarse_.projected(x);
  const Eigen::MatrixXcd solved = inverse_->solve(r.cast<std::complex<float>>().eval()).cast<Complex>();
  return coarse_.interpolated(solved) + filter_.apply(x - coarse_.interpolated(r));
}

Eigen::MatrixXcd TwoLevel::apply_transpose(const Eigen::MatrixXcd& x) const {
  const Eigen::MatrixXcd w = filter_.apply_transpose(x);
  const Eigen::MatrixXcd g = coarse_.gathered(x);
  const Eigen::MatrixXcd solved = inverse_->solve_transpose(g.cast<std::complex<float>>().eval()).cast<Complex>();
  return w + coarse_.projected_transpose(solved - coarse_.gathered(w));
}

}  // namespace touchfield
