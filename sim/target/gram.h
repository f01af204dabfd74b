#pragma once

#include "sim/target/target.h"
#include "solvers/phase/incident_problem.h"

namespace touchfield {

/// The paper's problem with scattering: C = [B_T diag(p'), -G].
///
/// columns      B_T, M x K: the columns of B of the target's faces
/// g            G, M x N
/// gram_g       G^H G, N x N, computed once for all problems that share G
/// amplitudes   p', K [Pa]
IncidentProblem scattered_problem(const Eigen::MatrixXcd& columns, const Eigen::MatrixXcd& g,
                                  const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes);

/// The paper's comparison without scattering: B is the identity.
///
/// faces   the target's, K
IncidentProblem unscattered_problem(const std::vector<Eigen::Index>& faces, const Eigen::MatrixXcd& g,
                                    const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes);

}  // namespace touchfield
