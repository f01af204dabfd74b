#pragma once

#include "sim/acoustics/transducer_array.h"
#include "sim/field/target.h"
#include "sim/mesh/triangle_mesh.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield {

/// A skin problem whose faces outside are reduced to a few rows, and what that left out.
struct SkinReduction {
  SkinProblem problem;
  double left_out = 0.0;  // sqrt of the share of the trace of R^H R, over all channels, that the dropped rows had
};

/// With H = P V^H, the pressures P of S drives V that span all that the channels can do (or V = 1 and P = H):
///
///   H_T = P_T V^H,   R = sqrt(w_Z) diag(s) U^H V^H,   P_Z^H diag(A) P_Z = U diag(s^2) U^H,
///
/// so that |R q|^2 = w_Z sum_Z A_j |p_j|^2: orthogonal rows, the strongest first. Eigenvalues s^2 below tolerance^2 of
/// the largest are dropped.
///
/// pressures      P, M x S [Pa]
/// drives         V, N x S, orthonormal columns
/// areas          A, M [m2]
/// outside          w_Z A of the faces outside, else 0, M (OutsideSkin::face_weights); empty: R has no rows
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
