#pragma once

#include "sim/field/target.h"
#include "solvers/phase/incident_problem.h"

namespace touchfield {

/// w, one per row of B and G: 1, or area over mean area and 1 for the rows of interior points behind those of the
/// faces.
Eigen::VectorXd row_weights(FaceWeights faces, const Eigen::VectorXd& areas, Eigen::Index rows);

/// G^H diag(w) G, N x N.
Eigen::MatrixXcd weighted_gram(const Eigen::MatrixXcd& g, const Eigen::VectorXd& weights);

/// The paper's problem with scattering: C = diag(sqrt w) [B_T diag(p'), -G].
///
/// columns      B_T, M x K: the columns of B of the target's faces
/// g            G, M x N
/// gram_g       G^H diag(w) G, N x N, computed once for all problems that share G
/// amplitudes   p', K [Pa]
/// weights      w, M
IncidentProblem scattered_problem(const Eigen::MatrixXcd& columns, const Eigen::MatrixXcd& g,
                                  const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes,
                                  const Eigen::VectorXd& weights);

/// The paper's comparison without scattering: B is the identity.
///
/// faces   the target's, K
IncidentProblem unscattered_problem(const std::vector<Eigen::Index>& faces, const Eigen::MatrixXcd& g,
                                    const Eigen::MatrixXcd& gram_g, const Eigen::VectorXd& amplitudes,
                                    const Eigen::VectorXd& weights);

}  // namespace touchfield
