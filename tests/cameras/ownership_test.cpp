// What keeps a reference to an argument takes no temporary: this file compiles, or it does not.
#include <concepts>
#include <type_traits>

#include "hardware/stop_signals.h"
#include "sim/bem/scattering_solver.h"
#include "sim/cameras/fitted_sensor.h"
#include "sim/cameras/pose_fit.h"
#include "sim/mesh/io/file_text.h"
#include "sim/mesh/remesh/edit_mesh.h"
#include "sim/model/evaluation.h"
#include "sim/pictures/skin_picture.h"
#include "sim/run/methods.h"
#include "sim/run/sweep_files.h"
#include "sim/scene/input.h"
#include "solvers/phase/relaxation.h"
#include "solvers/phase/skin_jacobian.h"

namespace touchfield::ownership_test {

/// Takes what it keeps a reference to, and no temporary in its place. It is held to what it does take too, so that
/// another parameter does not make the rest true.
template <class T, class Kept, class... Rest>
constexpr bool kKeeps = std::is_constructible_v<T, Kept&, Rest...> && !std::is_constructible_v<T, Kept, Rest...>;

using Mesh = TriangleMesh;
using Splits = std::optional<int>;
static_assert(kKeeps<EvaluationComparison, Mesh, Mesh&, Splits>);
static_assert(!std::is_constructible_v<EvaluationComparison, Mesh&, Mesh, Splits>);
static_assert(kKeeps<SkinJacobian, SkinProblem>);
static_assert(kKeeps<DualFactor, LowRankRelaxation>);
static_assert(std::is_constructible_v<SkinLook, SkinView, Mesh&, std::optional<Target>>);
static_assert(!std::is_constructible_v<SkinLook, SkinView, Mesh, std::optional<Target>>);
static_assert(kKeeps<TextCursor, std::string, const char*>);
static_assert(!std::is_constructible_v<TextCursor, const char*, const char*>);
static_assert(kKeeps<EditMesh::Around, EditMesh, int>);

using schema::Input;
using schema::Reading;
static_assert(kKeeps<Input, schema::Node, std::string, Reading&>);
static_assert(!std::is_constructible_v<Input, schema::Node&, std::string, Reading>);

static_assert(kKeeps<PoseFit, HandTemplate>);
static_assert(kKeeps<ExactSensor, MovingModel>);
static_assert(kKeeps<NoisySensor, MovingModel, SensingNoise&>);
static_assert(kKeeps<SampleStore, ExactSensor, double>);

// What is small is owned instead; what is written to is named by the caller.
static_assert(kKeeps<MethodSolver, SkinScattering, Eigen::Index, Target, SolveSpec>);
using Shared = std::shared_ptr<SkinModel>;
using Records = std::vector<SolveRecord>;
static_assert(std::is_constructible_v<SkinScattering, Shared, TransducerArray, Records&, Progress&>);
static_assert(!std::is_constructible_v<SkinScattering, Shared, TransducerArray, Records, Progress&>);
static_assert(!std::is_constructible_v<SkinScattering, Shared, TransducerArray, Records&, Progress>);
static_assert(kKeeps<SignalledPace, StopSignals, bool>);
static_assert(!std::is_move_constructible_v<SkinModel>);  // its solver refers to its system

// Functions whose results refer to an argument.
template <class System>
constexpr bool kSolves = requires(System&& system) {
  make_solver(std::forward<System>(system), SolverOptions{});
};
static_assert(kSolves<ScatteringSystem&> && kSolves<const ScatteringSystem&>);
static_assert(!kSolves<ScatteringSystem> && !kSolves<const ScatteringSystem>);
template <class Summary>
constexpr bool kLists = requires(Summary&& summary) {
  sweep_rows(std::forward<Summary>(summary));
};
static_assert(kLists<SweepSummary&> && !kLists<SweepSummary>);
template <class Edited>
constexpr bool kGoesRound = requires(Edited&& mesh) {
  std::forward<Edited>(mesh).around(0);
};
static_assert(kGoesRound<EditMesh&> && !kGoesRound<EditMesh>);
template <class Moving>
constexpr bool kIsSeen = requires(Moving&& moving) {
  simulated_images(std::forward<Moving>(moving));
};
static_assert(kIsSeen<MovingModel&> && !kIsSeen<MovingModel>);
template <class Entry>
constexpr bool kHolds = requires(const Input& input, Entry&& entry) {
  input.at(std::forward<Entry>(entry));
};
static_assert(kHolds<schema::Entry&> && !kHolds<schema::Entry>);

}  // namespace touchfield::ownership_test
