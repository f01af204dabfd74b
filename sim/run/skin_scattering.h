#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/acoustics/transducer_array.h"
#include "sim/core/progress.h"
#include "sim/gpu/on_card.h"
#include "sim/model/meshed_body.h"
#include "sim/model/model.h"
#include "sim/run/run_data.h"
#include "sim/run/solver_choice.h"
#include "solvers/linear/low_rank.h"

namespace touchfield {

/// A body in one scheme with its solver, on the processor or on a graphics card: what does not depend on the array. The
/// solver is made when the first solution is asked for.
class SkinModel {
 public:
  /// right_hand_sides   of the largest block that will be asked for: what the solver is chosen by
  SkinModel(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec,
            Eigen::Index right_hand_sides = 1);
  SkinModel(const SkinModel&) = delete;  // the solver refers to the system
  SkinModel& operator=(const SkinModel&) = delete;

  const ScatteringSystem& system() const { return system_; }
  const SolverDecision& decision() const { return decision_; }
  const DeviceDecision& device() const { return device_; }
  /// The body on the card; null on the processor.
  BodyOnCard* card();
  /// The same triangles with their vertices elsewhere, where the card has the body: what it keeps then serves on.
  /// False, and nothing done, otherwise.
  bool follow(const TriangleMesh& mesh);
  /// Continues on the processor, for want of memory on the card.
  void leave_card();
  const ScatteringSolver& solver();
  /// Solves in double precision from now on; false, and nothing done, if the scene says which, or for want of memory.
  bool turn_to_double();
  /// Reciprocal condition number of B, estimated once; NaN if no factorisation has been made.
  double reciprocal_condition();

 private:
  SolverSpec spec_;
  Eigen::Index right_hand_sides_;
  BodyCost cost_;
  DeviceDecision device_;
  SolverDecision decision_;
  ScatteringSystem system_;
  std::unique_ptr<BodyOnCard> card_;
  std::unique_ptr<ScatteringSolver> solver_;
  std::optional<double> reciprocal_condition_;
};

/// A model with an array: what turns drives into pressures on the skin. The field of every channel is made when a
/// method needs it. Solves are recorded. Each throws NumericalError
/// if prepare_solver() or require_solved() does.
class SkinScattering {
 public:
  /// array     in the frame of the model's mesh
  /// records   gets one line per solve; records and progress outlive this
  SkinScattering(std::shared_ptr<SkinModel> model, TransducerArray array, std::vector<SolveRecord>& records,
                 Progress& progress);
  /// A model of its own.
  SkinScattering(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec, TransducerArray array,
                 std::vector<SolveRecord>& records, Progress& progress, Eigen::Index right_hand_sides = 1);
  /// The model and the array of another, whose channels respond otherwise.
  SkinScattering(const SkinScattering& other, ChannelResponse response);

  const ScatteringSystem& system() const { return model_->system(); }
  const SolverDecision& decision() const { return model_->decision(); }
  const DeviceDecision& device() const { return model_->device(); }
  const TransducerArray& array() const { return array_; }
  /// Null on the processor, from now on too if the card has no room for the body.
  Gpu* gpu() const;

  /// Makes the solver now rather than when the first solution is asked for.
  void prepare();

  /// The field of every channel at unit drive; kept once made.
  const IncidentField& unit_field();

  /// Pressures M x S [Pa] of drives N x S.
  ///
  /// stage    what the record calls it
  /// single   whether the incident field is summed over channels in single precision
  Eigen::MatrixXcd pressure(const Eigen::MatrixXcd& drives, const std::string& stage, bool single = false);

  /// Pressures M x r [Pa] of the drives that span what all channels do: `drives` is b^H of unit_field() compressed, so
  /// that their right-hand sides are known already.
  Eigen::MatrixXcd spanned_pressure(const LowRank& drives, const std::string& stage);

  /// What drives that span all channels make of the faces and of the rest, by the card; nothing on the processor.
  ///
  /// drives      of spanning_drives, or none: found here, to `tolerance` of b
  std::optional<BodyOnCard::Spanned> spanned_on_card(const std::shared_ptr<const Eigen::MatrixXcd>& drives,
                                                     double tolerance, const BodyOnCard::Wanted& wanted,
                                                     const std::string& stage);

  /// The paper's problem, see BodyOnCard::incident_problem; nothing on the processor.
  ///
  /// beyond   added to G^H diag(w) G, N x N, or empty
  /// throws   GpuMemoryFailure where the card has no room for its matrix
  std::optional<IncidentProblem> incident_on_card(const std::vector<Eigen::Index>& faces,
                                                  const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& weights,
                                                  const Eigen::MatrixXcd& beyond, bool scattered);

  /// Rows of H of the given faces, K x N [Pa]: the pressure of every channel there.
  Eigen::MatrixXcd transfer_rows(const std::vector<Eigen::Index>& faces, const std::string& stage);

  /// W^T H, S x N [Pa], of weights W of the faces, M x S, on the processor. H^H v is the conjugate of that of conj(v).
  Eigen::MatrixXcd weighted_rows(const Eigen::MatrixXcd& weights, const std::string& stage);

  double reciprocal_condition() const { return model_->reciprocal_condition(); }

  /// From now on a solution is returned however poor it is: for a study and for comparisons of schemes.
  void allow_broken() { allow_broken_ = true; }

  /// Factorises B where the solver does so, as the first solution would.
  ///
  /// throws   NumericalError if its condition leaves fewer than three digits, unless allow_broken()
  const ScatteringSolver& prepare_solver();

 private:
  void record(const std::string& stage, Eigen::Index right_hand_sides, const SolveReport& report, double seconds);
  BodyOnCard* card(const std::string& stage) const;
  void leave_card(const std::string& stage, const GpuMemoryFailure& failure) const;
  template <typename Work>
  bool on_card(const std::string& stage, Eigen::Index right_hand_sides, const Work& work);
  Eigen::MatrixXcd solved(const Eigen::MatrixXcd& b, const IncidentField& field, const std::string& stage);
  IncidentField driven_field(const Eigen::MatrixXcd& drives, bool single);
  ScatteringSolver::Report reporter();

  std::shared_ptr<SkinModel> model_;
  TransducerArray array_;
  std::vector<SolveRecord>& records_;
  Progress& progress_;
  bool allow_broken_ = false;
  std::optional<IncidentField> unit_;
};

/// One line: scheme, solver, precision, unknowns, near pairs, and why this solver.
std::string describe_decision(const SkinScattering& scattering);

/// throws   NumericalError that names the scheme to use, if the residual is not finite, above 100 tolerances or above
///          1/2
void require_solved(const SolveRecord& solve, double tolerance);

/// throws   NumericalError that names `what`
void require_finite(const std::string& what, const Eigen::MatrixXcd& pressure);

/// Scattering models that scenes computed one after another share, each with the factorisation it has made. A model is
/// the same if scheme, medium, frequency and solver are and the meshes have the same triangles and nowhere differ by
/// more than 1 nm. On a graphics card a model that nobody holds follows a mesh of the same triangles. Of each role the
/// last model is kept, so that no more is held than one scene needs.
class KeptModels {
 public:
  /// bodies   of the same scenes: a model is made of their meshes, so that it is the same to the last bit whichever
  ///          scene is first; may be null; outlive this
  explicit KeptModels(const KeptBodies* bodies = nullptr) : bodies_(bodies) {}

  /// How many scenes are expected to share a model that is made from here on: a factorisation pays earlier.
  void expect(int scenes) { scenes_ = scenes; }
  bool shared() const { return scenes_ > 1; }

  /// The model of a role, of a mesh in a frame that does not move with the scene; made if the last one is another.
  ///
  /// role               what the model is for in a scene, e.g. "evaluation"
  /// right_hand_sides   of the largest block that a scene will ask for
  std::shared_ptr<SkinModel> get(const std::string& role, const TriangleMesh& mesh, const Wave& wave, Scheme scheme,
                                 const SolverSpec& spec, Eigen::Index right_hand_sides);

 private:
  struct Entry {
    SolverSpec spec;
    std::shared_ptr<SkinModel> model;
  };

  const KeptBodies* bodies_;
  int scenes_ = 1;
  std::map<std::string, Entry> entries_;
};

/// A body of a scene in a scheme with the scene's array. Where models are kept it is set up in the first body's own
/// frame, in which a scene that only moves has the same mesh.
///
/// response   of the array's channels
/// kept       may be null
/// records    as SkinScattering's
std::unique_ptr<SkinScattering> make_scattering(const std::string& role, const TriangleMesh& mesh, Scheme scheme,
                                                const SolverSpec& spec, Eigen::Index right_hand_sides,
                                                const Model& model, const ChannelResponse& response, KeptModels* kept,
                                                std::vector<SolveRecord>& records, Progress& progress);

struct SolveOptions {
  std::string command_line;      // kept as provenance
  int threads = 1;               // likewise; the caller has set them
  KeptBodies* bodies = nullptr;  // meshes and models of scenes before this one
  KeptModels* models = nullptr;
};

}  // namespace touchfield
