#include "solvers/phase/dual_proof.h"

#include "solvers/linear/factorisations.h"

namespace touchfield {

bool is_definite(Eigen::MatrixXcd s, const Eigen::VectorXd& diagonal) {
  s.diagonal() += diagonal;
  return cholesky_factorise(static_cast<int>(s.rows()), s.data());
}

}  // namespace touchfield
