#pragma once

#include "sim/acoustics/transducer_array.h"
#include "sim/field/target.h"
#include "sim/mesh/query/skin_patches.h"
#include "sim/mesh/triangle_mesh.h"
#include "solvers/phase/incident_problem.h"
#include "solvers/phase/skin_problem.h"

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

/// The skin outside the target, which is to stay silent. A rigid wall in the way of sound has twice its incident
/// pressure at most. Skin that is not solved thus counts by 2 |p_inc|^2, between that of skin in the shade and that of
/// lit skin.
struct OutsideSkin {
  Eigen::VectorXd faces{};  // M: 1 on faces of the solving mesh that are skin, else 0; empty: all are
  SkinPatches beyond{};     // skin that is not solved, by its incident pressure
  TransducerArray array{};  // in the frame of `beyond`

  /// w_Z A of the faces outside, w_Z (1 - s) A of the target's, 0 of those that are no skin, M.
  Eigen::VectorXd face_weights(const Eigen::VectorXd& areas, const Target& target, double outside_weight) const;

  /// 2 w_Z A of the patches, J.
  Eigen::VectorXd beyond_weights(double outside_weight) const;

  /// p_inc of every channel at unit drive on the patches, J x N [Pa].
  Eigen::MatrixXcf beyond_pressure_single(const Wave& wave) const;

  /// sqrt(2 w_Z A_j) p_inc(x_j), J x N [Pa m]: rows of R of a SkinProblem.
  Eigen::MatrixXcd beyond_rows(const Wave& wave, double outside_weight) const;

  /// w of the rows of B and G in the paper's misfit: row_weights, 0 of faces that are no skin.
  Eigen::VectorXd misfit_weights(FaceWeights faces, const Eigen::VectorXd& areas, Eigen::Index rows) const;

  /// The contribution of skin beyond to G^H diag(w) G, N x N. As `faces` says, w_j is A_j over the mean area of the
  /// solved faces, or the number of faces that a patch stands for. Empty if there is no such skin.
  Eigen::MatrixXcd beyond_gram(FaceWeights faces, const Wave& wave, double mean_area) const;
};

/// A skin problem whose faces outside are reduced to a few rows, and what that left out.
struct SkinReduction {
  SkinProblem problem;
  double left_out = 0.0;  // sqrt of the share of the trace of R^H R, over all channels, that the dropped rows had
};

/// With H = P V^H, the pressures P of S drives V that span all that the channels can do (or V = 1 and P = H):
///
///   H_T = P_T V^H,   R = sqrt(w_Z) diag(s) U^H V^H,   P^H diag(o) P = U diag(s^2) U^H,
///
/// so that |R q|^2 = w_Z sum_j o_j |p_j|^2 with o_j the area of a face that is outside the target: orthogonal rows, the
/// strongest first. Eigenvalues s^2 below tolerance^2 of the largest are dropped.
///
/// pressures      P, M x S [Pa]
/// drives         V, N x S, orthonormal columns
/// areas          A, M [m2]
/// outside        w_Z A of the skin outside, M (OutsideSkin::face_weights); empty: R has no rows
/// tolerance      0 to 0.1
/// throws         std::invalid_argument on sizes that do not fit
SkinReduction reduced_skin_problem(const Eigen::MatrixXcd& pressures, const Eigen::MatrixXcd& drives,
                                   const Eigen::VectorXd& areas, const Target& target, const Eigen::VectorXd& outside,
                                   double tolerance);

/// Adds rows S to R, reduced with them: R^H R + S^H S = U diag(s^2) U^H, R = diag(s) U^H, of either matrix' smaller
/// Gram matrix.
///
/// rows        S, J x N [Pa m]
/// tolerance   as above
void add_outside_rows(const Eigen::MatrixXcd& rows, double tolerance, SkinReduction& reduction);

/// About how many drives span what all channels do to a body, to the accuracy of make_transfer:
///
///   r = 25 sqrt(D) + 0.65 D,  at most N,   D = sum_n sum_j a A_j cos(theta_n) cos(theta_j) / (R^2 lambda^2)
///
/// D is the etendue of array and skin over lambda^2. It counts the degrees of freedom of the waves between them. a is
/// the square of the distance between neighbouring channels. The estimate is fitted to the numerical rank. It is within
/// 5 % on a fingertip, a hand 150 and 300 mm above 1,496 channels, a grasp, and a capsule over 256. `compressed` takes
/// up to two blocks more.
///
/// centroids, normals, areas   of the skin's faces: 3 x M [m], 3 x M, M [m2]
/// returns  1 for a plane wave
/// source   D: D. A. B. Miller, Adv. Opt. Photon. 11 (2019) 679
double expected_drives(const Points& centroids, const Points& normals, const Eigen::VectorXd& areas,
                       const TransducerArray& array, double wavelength);
inline double expected_drives(const TriangleMesh& mesh, const TransducerArray& array, double wavelength) {
  return expected_drives(mesh.centroids(), mesh.normals(), mesh.areas(), array, wavelength);
}

}  // namespace touchfield
