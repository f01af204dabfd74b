#pragma once

#include <memory>
#include <vector>

#include <Eigen/Core>

#include "sim/bem/boundary_operator.h"
#include "sim/bem/coarse_space.h"
#include "solvers/linear/factorisations.h"

namespace touchfield {

/// E^-1 for E = B[points, :] P in single precision, with P and the points of CoarseSpace. E is made of rows of the fine
/// matrix B. Up to 5,000 points it is factorised as a whole. More points are split in blocks of at most 2,000, which
/// approximate E^-1 by restricted Schwarz. Each block solves for its own points and for those up to 0.75 wavelengths
/// around. It gives the values of its own.
///
/// memory   8 bytes per pair of points of a block
class CoarseInverse {
 public:
  static constexpr Eigen::Index kWholePoints = 5000;  // up to which E is factorised as a whole
  static constexpr Eigen::Index kBlockPoints = 2000;  // of a block's own, at most, beyond

  /// parts    of B, with Layer::kBurtonMiller
  /// throws   std::domain_error if a block of E is singular
  CoarseInverse(const TriangleMesh& mesh, const Complex& wavenumber, const BoundaryParts& parts,
                const CoarseSpace& coarse);

  Eigen::Index blocks() const { return static_cast<Eigen::Index>(blocks_.size()); }
  double reciprocal_condition() const;  // estimate of the worst block's

  /// E^-1 C.
  Eigen::MatrixXcd solve(const Eigen::MatrixXcd& c) const;
  /// E^-T C.
  Eigen::MatrixXcd solve_transpose(const Eigen::MatrixXcd& c) const;

 private:
  struct Block {
    std::vector<Eigen::Index> points;  // of the coarse space, the block's own first
    Eigen::Index own = 0;
    std::unique_ptr<DenseLuSingle> lu;
  };
  std::vector<Block> blocks_;
};

}  // namespace touchfield
