#pragma once

#include <memory>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/bem/grid_spec.h"
#include "sim/bem/scattering_solver.h"
#include "sim/core/errors.h"
#include "sim/gpu/gpu.h"
#include "sim/mesh/triangle_mesh.h"
#include "solvers/phase/incident_problem.h"

namespace touchfield {

/// Carries out work of a card's.
///
/// throws   DeviceError where the card fails; GpuMemoryFailure where it has no room, which callers answer by asking for
///          less
template <typename Work>
auto on_card(const Work& work) {
  try {
    return work();
  } catch (const GpuMemoryFailure&) {
    throw;
  } catch (const GpuFailure& failure) {
    throw DeviceError(failure.what());
  }
}

/// An array and a surface in a medium as the card takes them: pointers into the arguments, which must outlive them.
///
/// response   factors(array.response)
GpuSources card_sources(const TransducerArray& array, const Eigen::VectorXcd& response);
GpuBodySpec card_surface(const TriangleMesh& mesh, const Wave& wave);

/// The grid of a body for the sums of a system of it, which has a grid_tolerance that single precision reaches.
///
/// lowest   the lowest coordinates of its centroids [m]
GpuGrid card_grid(const GridBody& body, const Vector3& lowest, const ScatteringSystem& system);

/// What a card makes of the field at points off the skin: see GpuField.
struct FarField {
  Eigen::MatrixXcd pressure;  // J x S [Pa]
  Eigen::VectorXd winding;    // J
  std::vector<int> near;      // J
};

/// The field of a driven array and of the faces that are not near.
///
/// far_distance   in square roots of a face's area
/// points         3 x J [m]
/// surface        M x S [Pa]: pressures on the faces, S > 0
/// drive          N x S
/// throws         GpuMemoryFailure where the card has no room, DeviceError where it fails
FarField far_field_on_card(Gpu& gpu, double far_distance, const TriangleMesh& mesh, const TransducerArray& array,
                           const Wave& wave, const Points& points, const Eigen::MatrixXcd& surface,
                           const Eigen::MatrixXcd& drive);

/// The least tolerance that the card reaches: residuals there are in single precision. The plain schemes may stop at
/// some 2e-5 near a resonance, which their report says.
inline constexpr double kFinestOnCard = 1e-5;

/// Faces from which on products by a grid take less there than products by pairs, for few columns.
inline constexpr Eigen::Index kGridOnCard = 15'000;

/// A ScatteringSystem on a graphics card: what its solver and its sums do on the processor, in single precision.
///
/// accuracy   pressures within 1e-4 of those in double at the finest tolerance, of the plain schemes 1e-3 off resonance
/// throws     NumericalError on a singular system and values that are not finite, GpuMemoryFailure where the card has
///            no room even without a stored matrix, DeviceError where it fails
class BodyOnCard {
 public:
  /// system   of a scheme without interior points; outlives this. Where its grid_tolerance is > 0 and single precision
  ///          reaches it, sums may go through a grid on the card too
  /// leaves_open   whether the card chooses between LU and GMRES
  BodyOnCard(std::shared_ptr<Gpu> gpu, const ScatteringSystem& system, const SolverOptions& options, bool leaves_open);
  BodyOnCard(std::shared_ptr<Gpu>, const ScatteringSystem&&, const SolverOptions&, bool) = delete;
  BodyOnCard(const BodyOnCard&) = delete;
  BodyOnCard& operator=(const BodyOnCard&) = delete;

  Gpu& gpu() const { return *gpu_; }

  /// How it was solved last.
  SolverKind kind() const { return kind_; }

  /// Pressures of drives N x S, M x S [Pa].
  Solved pressure(const TransducerArray& array, const Eigen::MatrixXcd& drives,
                  const ScatteringSolver::Report& report = {});

  /// Rows of H = P V^H that are wanted: of some faces, and the few that stand for the rest (GpuBody::reduce).
  struct Wanted {
    std::vector<Eigen::Index> faces;
    const Eigen::VectorXd* weights = nullptr;  // M; null: none for the rest
    double tolerance = 0;                      // of eigenvalues' roots, see GpuBody::reduce
  };
  /// What drives V that span the channels make of the body; see make_transfer.
  struct Spanned {
    Eigen::Index drives = 0;  // r
    double left_out = 0;      // by V, of b
    SolveReport report;
    Eigen::MatrixXcd target;      // rows of the faces asked for, K x N [Pa]
    Eigen::MatrixXcd outside;     // R
    double outside_left_out = 0;  // by R
  };
  Spanned spanned(const TransducerArray& array, double tolerance, const Wanted& wanted,
                  const ScatteringSolver::Report& report = {});
  /// The same of drives that are given. With as many as the last time its pressures are the start: for a body that
  /// moves. The same object as the last time is not sent again.
  Spanned spanned(const TransducerArray& array, const std::shared_ptr<const Eigen::MatrixXcd>& drives,
                  const Wanted& wanted, const ScatteringSolver::Report& report = {});
  /// P of the last spanned(), M x r.
  Eigen::MatrixXcd spanned_pressure() const;

  /// The paper's problem of these faces, with or without scattering (sim/field/skin_problems.h), whose matrix stays
  /// on the card.
  ///
  /// weights   of the faces, M
  /// beyond    added to G^H diag(w) G, N x N, or empty
  IncidentProblem incident_problem(const TransducerArray& array, const std::vector<Eigen::Index>& faces,
                                   const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& weights,
                                   const Eigen::MatrixXcd& beyond, bool scattered);

  /// Rows of H of the given faces, K x N [Pa].
  Solved transfer_rows(const TransducerArray& array, const std::vector<Eigen::Index>& faces,
                       const ScatteringSolver::Report& report = {});

  /// The same body deformed: the same triangles, other vertices.
  void move(const TriangleMesh& mesh);

 private:
  template <typename Work>
  auto guarded(const Work& work) const;
  void aim(const TransducerArray& array);
  SolveReport reported(const GpuSolveReport& report);
  void take(Eigen::Index channels, const Wanted& wanted, Spanned& spanned);

  std::shared_ptr<Gpu> gpu_;
  const ScatteringSystem& system_;
  struct Box {
    Vector3 lowest;
    GridBody body;
  };
  Box box_;  // round the body where it is
  GpuSolveOptions options_;

  SolverKind kind_ = SolverKind::kMatrixFree;
  int spanned_columns_ = 0;
  std::shared_ptr<const Eigen::MatrixXcd> drives_;  // given last, which the card still has
  std::unique_ptr<GpuBody> body_;
};

}  // namespace touchfield
