#pragma once

#include <memory>
#include <mutex>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/bem/boundary_operator.h"
#include "sim/bem/scheme.h"
#include "sim/bem/two_level.h"
#include "sim/mesh/triangle_mesh.h"

namespace touchfield {

/// The incident field where a scheme asks for it, S columns. Parts a scheme does not need are empty.
struct IncidentField {
  Eigen::MatrixXcd pressure;  // M x S, at the centroids [Pa]
  Eigen::MatrixXcd slope;     // M x S, along the normals [Pa/m]
  Eigen::MatrixXcd interior;  // Z x S, at CHIEF's points [Pa]
};

/// The field of drives q, from the one of every channel at unit drive.
IncidentField driven(const IncidentField& unit, const Eigen::MatrixXcd& drive);

/// Scattering by a sound-hard body, B p = b, in one scheme. With e the incident pressure, e' its slope and e_z its
/// value at Z points inside the body:
///
///   paper                    B = 1/2 - D with one point per face,                                  b = e
///   paper_corrected          the same with the diagonal of gauss_diagonal(),                     b = e
///   chief                    B_c + C^H C, B_c of paper_corrected,
///                            C_zj = -A_j dg/dn_j (z, x_j),                                       b = e + C^H e_z
///                            (each row of C and its e_z times a factor that makes the row as long as 1)
///   burton_miller            B = 1/2 - D - eta W, integrals by FaceRule, eta = coupling i / k,   b = e + eta e'
///   burton_miller_polished   the same, then twice p += e - B_c p with B_c of paper_corrected
///
/// Integrals are made when B is first asked for.
///
/// source   Schenck, J. Acoust. Soc. Am. 44 (1968) 41; Burton & Miller, Proc. R. Soc. A 323 (1971) 201
class ScatteringSystem {
 public:
  /// mesh     closed, normals outwards
  ScatteringSystem(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SystemOptions& options = {});

  const TriangleMesh& mesh() const { return mesh_; }
  const Wave& wave() const { return wave_; }
  Scheme scheme() const { return scheme_; }
  const SystemOptions& options() const { return options_; }
  Eigen::Index faces() const { return mesh_.face_count(); }    // M, as many as unknowns
  const Points& interior_points() const { return interior_; }  // 3 x Z, of chief
  /// C of chief in single precision, Z x M.
  Eigen::MatrixXcf interior_rows_single() const { return chief_rows_.cast<std::complex<float>>(); }
  std::size_t near_pairs() const { return operators().near ? operators().near->pairs() : 0; }

  /// Makes the integrals now rather than when B is first asked for.
  void prepare() const { operators(); }

  /// The incident field of every channel at unit drive, S = N.
  IncidentField incident(const TransducerArray& array) const;
  /// The incident field of a driven array, drive N x S, without the field of every channel.
  ///
  /// single   whether the sums over channels are in single precision
  IncidentField incident(const TransducerArray& array, const Eigen::MatrixXcd& drive, bool single = false) const;

  /// b, M x S.
  Eigen::MatrixXcd right_hand_side(const IncidentField& incident) const;
  /// The given rows of b, 0 to M - 1, of every channel at unit drive: K x N. None of B's integrals are made.
  Eigen::MatrixXcd right_hand_side_rows(const TransducerArray& array, const std::vector<Eigen::Index>& rows) const;
  /// b of every channel at unit drive in single precision, M x N, by incident_matrix_single; of chief its parts e and
  /// e_z, one below the other. Its first M rows hold the incident pressure e if the scheme has no slope in b; else
  /// `incident` gets that, M x N.
  Eigen::MatrixXcf right_hand_side_single(const TransducerArray& array, Eigen::MatrixXcf& incident) const;
  /// Surface pressures M x S [Pa] from the solutions of B p = b.
  Eigen::MatrixXcd pressure(const Eigen::MatrixXcd& solution, const IncidentField& incident) const;
  /// Whether pressure() reads incident.pressure; it reads nothing else of it.
  bool needs_incident_pressure() const { return traits(scheme_).polished; }

  /// W^T H, p = H q, by transposed solves: sums over the rows of H with weights W, M x S. Unit columns give rows. The
  /// first function gives the right-hand sides, M x S, of B^T x = r. The second gives the sums, S x N [Pa], from those
  /// x and the unit field.
  Eigen::MatrixXcd transposed_right_hand_side(const Eigen::MatrixXcd& weights) const;
  Eigen::MatrixXcd weighted_rows(const Eigen::MatrixXcd& weights, const Eigen::MatrixXcd& x,
                                 const IncidentField& unit) const;

  Eigen::MatrixXcd columns(const std::vector<Eigen::Index>& faces) const;

  /// B without storing it, in double: the reference for residuals.
  const LinearOperator& exact() const { return *operators().exact; }
  /// B without storing it, its sums with one point per face in single precision.
  std::unique_ptr<LinearOperator> single_operator() const;
  /// B without storing it, by a grid to options().grid_tolerance, which must be > 0.
  const LinearOperator& by_grid() const;
  /// Sums over all faces with one point per face: by that grid where there is one, else pair by pair in double.
  const FaceSums& sums() const { return *operators().sums; }
  /// A preconditioner of B; none where the scheme does not solve Burton and Miller's equation.
  /// throws   as TwoLevel
  std::unique_ptr<const TwoLevel> two_level() const;
  /// B stored.
  Eigen::MatrixXcd dense() const;
  Eigen::MatrixXcf dense_single() const;

 private:
  /// What is made of integrals over all pairs of faces.
  struct Operators {
    BoundaryParts parts;
    std::shared_ptr<const NearCorrections> near;
    std::shared_ptr<const FaceSums> sums;
    std::unique_ptr<LinearOperator> exact;
    std::unique_ptr<LinearOperator> by_grid;
    std::unique_ptr<LinearOperator> polisher;  // B of paper_corrected
  };
  const Operators& operators() const;
  Operators make_operators() const;

  double gamma() const;
  template <typename Real>
  std::unique_ptr<LinearOperator> make_operator(const BoundaryParts& parts) const;
  std::unique_ptr<LinearOperator> with_interior_points(std::unique_ptr<LinearOperator> b) const;
  template <typename Real>
  Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic> make_dense() const;

  TriangleMesh mesh_;
  Wave wave_;
  Scheme scheme_;
  SystemOptions options_;
  Points interior_;
  Eigen::VectorXd chief_scale_;  // Z: factors on the rows of C and on e_z
  Eigen::MatrixXcd chief_rows_;  // C, Z x M, scaled
  mutable std::unique_ptr<std::once_flag> once_ = std::make_unique<std::once_flag>();
  mutable Operators operators_;
};

/// Point sources inside a body: outside, their field solves the same equations, and is known exactly.
struct SourceField {
  Eigen::MatrixXcd value;  // u = exp(ikr) / (4 pi r) at the centroids, M x S [1/m]
  Eigen::MatrixXcd slope;  // du/dn there [1/m2]
};

/// sources   3 x S [m], inside, none on the skin
SourceField source_field(const TriangleMesh& mesh, const Wave& wave, const Points& sources);

/// The incident field for which a scheme's exact solution would be u, from du/dn alone:
///
///   pressure = -S du/dn,   slope = -(1/2 + D') du/dn,   interior = -int g(z, y) du/dn dS,
///
/// with S and D' integrated by the system's FaceRule. What a scheme returns instead of u is its discretisation error,
/// an indicator of its error in scattering on the same mesh.
IncidentField interior_incident(const ScatteringSystem& system, const SourceField& field);

}  // namespace touchfield
