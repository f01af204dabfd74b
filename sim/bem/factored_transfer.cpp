#include "sim/bem/factored_transfer.h"

#include "sim/bem/polishing.h"
#include "solvers/linear/blas_product.h"

namespace touchfield {

using Eigen::MatrixXcf;
using Eigen::VectorXcf;

FactoredTransfer::FactoredTransfer(const ScatteringSystem& system)
    : faces_(system.faces()), lu_(system.dense_single()) {
  if (traits(system.scheme()).polished) {
    polisher_ = -BoundaryOperator<float>(system.mesh(), system.wave().wavenumber(),
                                         polishing_parts(gauss_diagonal(system.mesh()).cast<Complex>()))
                     .dense();
    polisher_.diagonal().array() += 1.0F;
  }
}

void FactoredTransfer::face(const ScatteringSystem& system, const TransducerArray& array) {
  b_ = system.right_hand_side_single(array, incident_);
}

VectorXcf FactoredTransfer::pressure(const VectorXcf& q) const {
  VectorXcf b(b_.rows());
  multiply(Op::kPlain, b_, q, 0.0F, b);
  VectorXcf p = lu_.solve(b).topRows(faces_);
  if (polisher_.size() > 0) {
    VectorXcf incident(faces_);
    multiply(Op::kPlain, incident_, q, 0.0F, incident);
    for (int step = 0; step < kPolishingSteps; ++step) {
      VectorXcf polished = incident;
      multiply(Op::kPlain, polisher_, p, 1.0F, polished);
      p.swap(polished);
    }
  }
  return p;
}

VectorXcf FactoredTransfer::sent_back(const VectorXcf& v) const {
  VectorXcf back = VectorXcf::Zero(b_.cols());
  VectorXcf x = VectorXcf::Zero(b_.rows());
  x.head(faces_) = v;
  if (polisher_.size() > 0) {
    VectorXcf sum = VectorXcf::Zero(faces_);
    for (int step = 0; step < kPolishingSteps; ++step) {
      sum += x;
      VectorXcf before = x;
      multiply(Op::kAdjoint, polisher_, before, 0.0F, x);
    }
    multiply(Op::kAdjoint, incident_, sum, 0.0F, back);
  }
  x = lu_.solve_transpose(x.conjugate()).conjugate();  // B^-H
  multiply(Op::kAdjoint, b_, x, 1.0F, back);
  return back;
}

}  // namespace touchfield
