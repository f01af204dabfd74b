#include "sim/run/skin_scattering.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <utility>

#include <fmt/format.h>

#include "sim/gpu/gpu_library.h"
#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

SystemOptions system_options(const SolverSpec& spec, SolverKind kind) {
  SystemOptions options;
  options.coupling = spec.coupling;
  options.rule.split_ratio = spec.split_ratio;
  options.grid_tolerance = kind == SolverKind::kFft ? grid_tolerance(spec) : 0.0;
  return options;
}

/// kind   how it is solved; none: on a card
ScatteringSystem make_system(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec,
                             std::optional<SolverKind> kind) {
  const SystemOptions options = system_options(spec, kind.value_or(sums_on_card(spec, mesh.face_count())));
  return {std::move(mesh), wave, scheme, options};
}

constexpr double kDoubleEpsilon = std::numeric_limits<double>::epsilon();
constexpr double kBroken = 100.0;        // tolerances
constexpr double kNoSolution = 0.5;      // a residual that no tolerance excuses
constexpr double kLeastAccurate = 1e-3;  // three digits
constexpr double kUnrefined = 1e-5;      // the finest tolerance of single precision that is not refined

std::string broken_remedy(Scheme scheme) {
  return traits(scheme).burton_miller
             ? "raise solve.max_steps or set solve.solver: lu; `touchfield check` names faults of the mesh"
             : "use the scheme " + to_string(kDefaultScheme) + ": its equations can be solved on any closed body";
}

double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

bool same_wave(const Wave& a, const Wave& b) {
  return a.frequency() == b.frequency() && a.medium().sound_speed == b.medium().sound_speed &&
         a.medium().density == b.medium().density && a.medium().absorption == b.medium().absorption;
}

}  // namespace

SkinModel::SkinModel(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec,
                     Eigen::Index right_hand_sides)
    : spec_(spec),
      right_hand_sides_(right_hand_sides),
      cost_(body_cost(grid_body(mesh), wave, spec)),
      device_(choose_device(spec, scheme, mesh.face_count(), right_hand_sides)),
      decision_(choose_solver(spec, scheme, mesh.face_count(), available_memory(), right_hand_sides, cost_)),
      system_(make_system(std::move(mesh), wave, scheme, spec,
                          device_.card ? std::nullopt : std::optional(decision_.options.kind))) {
  if (device_.card) {
    decision_.options.precision = Precision::kSingle;
    decision_.options.refine = false;
  } else {
    system_.prepare();
  }
}

BodyOnCard* SkinModel::card() {
  if (device_.card && !card_) {
    card_ = std::make_unique<BodyOnCard>(shared_gpu(*device_.card), system_, decision_.options,
                                         spec_.solver == SolverChoice::kAuto);
  }
  return card_.get();
}

bool SkinModel::follow(const TriangleMesh& mesh) {
  if (!card_ || system_.mesh().triangles() != mesh.triangles()) {
    return false;
  }
  system_ = ScatteringSystem(mesh, system_.wave(), system_.scheme(), system_.options());
  card_->move(mesh);
  return true;
}

void SkinModel::leave_card() {
  card_.reset();
  device_ = {std::nullopt, "the graphics card has too little memory"};
  decision_ = choose_solver(spec_, system_.scheme(), system_.faces(), available_memory(), right_hand_sides_, cost_);
  system_ =
      ScatteringSystem(system_.mesh(), system_.wave(), system_.scheme(), system_options(spec_, decision_.options.kind));
}

const ScatteringSolver& SkinModel::solver() {
  if (!solver_) {
    solver_ = make_solver(system_, decision_.options);
  }
  return *solver_;
}

bool SkinModel::turn_to_double() {
  SolverOptions options = decision_.options;
  options.precision = Precision::kDouble;
  if (spec_.precision != PrecisionChoice::kAuto ||
      solver_memory(system_.faces(), options, right_hand_sides_) > available_memory()) {
    return false;
  }
  decision_.options = options;
  solver_.reset();
  reciprocal_condition_.reset();
  return true;
}

double SkinModel::reciprocal_condition() {
  if (!reciprocal_condition_ && solver_) {
    reciprocal_condition_ = solver_->reciprocal_condition();
  }
  return reciprocal_condition_.value_or(std::numeric_limits<double>::quiet_NaN());
}

SkinScattering::SkinScattering(std::shared_ptr<SkinModel> model, TransducerArray array,
                               std::vector<SolveRecord>& records, Progress& progress)
    : model_(std::move(model)), array_(std::move(array)), records_(records), progress_(progress) {}

SkinScattering::SkinScattering(TriangleMesh mesh, const Wave& wave, Scheme scheme, const SolverSpec& spec,
                               TransducerArray array, std::vector<SolveRecord>& records, Progress& progress,
                               Eigen::Index right_hand_sides)
    : SkinScattering(std::make_shared<SkinModel>(std::move(mesh), wave, scheme, spec, right_hand_sides),
                     std::move(array), records, progress) {}

SkinScattering::SkinScattering(const SkinScattering& other, ChannelResponse response)
    : SkinScattering(other.model_, other.array_, other.records_, other.progress_) {
  array_.response = std::move(response);
}

const IncidentField& SkinScattering::unit_field() {
  if (!unit_) {
    unit_ = system().incident(array_);
  }
  return *unit_;
}

IncidentField SkinScattering::driven_field(const Eigen::MatrixXcd& drives, bool single) {
  return unit_ ? driven(*unit_, drives) : system().incident(array_, drives, single);
}

ScatteringSolver::Report SkinScattering::reporter() {
  const double target = std::log(decision().options.tolerance);
  return [this, target](int /*step*/, double worst) {
    if (worst > 0) {
      progress_.advance(std::min(0.99, std::max(0.0, std::log(worst) / target)));
    }
  };
}

void SkinScattering::record(const std::string& stage, Eigen::Index right_hand_sides, const SolveReport& report,
                            double seconds) {
  BodyOnCard* const card = model_->card();
  SolveRecord record;
  record.stage = stage;
  record.scheme = to_string(system().scheme());
  record.solver = card != nullptr ? to_string(card->kind()) : solver_name(decision().options.kind, report.two_level);
  record.precision = precision_name(decision().options);
  record.device = card != nullptr ? fmt::format("cuda:{}", card->gpu().info().index) : "cpu";
  record.unknowns = system().faces();
  record.right_hand_sides = static_cast<int>(right_hand_sides);
  record.steps = report.steps;
  record.refinements = report.refinements;
  record.residual = report.residual;
  record.converged = report.converged;
  record.seconds = seconds;
  if (!report.set_aside.empty()) {
    progress_.detail("  solver: without the two-level preconditioner: " + report.set_aside);
  }
  records_.push_back(std::move(record));
  if (!allow_broken_) {
    // Unrefined single precision reaches no tolerance below its own rounding.
    const SolverOptions& options = decision().options;
    const bool unrefined = options.precision == Precision::kSingle && !options.refine;
    require_solved(records_.back(), unrefined ? std::max(options.tolerance, kUnrefined) : options.tolerance);
  }
}

const ScatteringSolver& SkinScattering::prepare_solver() {
  const ScatteringSolver& solver = model_->solver();
  const SolverOptions& options = decision().options;
  const bool single = options.precision == Precision::kSingle;
  const double rounding = 0.5 * (single ? std::numeric_limits<float>::epsilon() : kDoubleEpsilon);
  const double condition = 1.0 / reciprocal_condition();
  // Refinement makes up for all digits but the last.
  if (!allow_broken_ && condition * rounding > (single && options.refine ? 1.0 : kLeastAccurate)) {
    if (single && model_->turn_to_double()) {
      progress_.detail(
          fmt::format("  solver: again in double precision: the condition number is about {:.1e}", condition));
      return prepare_solver();
    }
    throw NumericalError(fmt::format(
        "scheme {} on {} faces: its matrix has a condition number of about {:.1e}, which leaves too few of the {} "
        "digits of {} precision: {}{}",
        to_string(system().scheme()), system().faces(), condition, single ? 7 : 16, precision_name(options),
        single ? "set solve.precision: double, or " : "", broken_remedy(system().scheme())));
  }
  return solver;
}

/// Goes on without the card, for want of memory there.
void SkinScattering::leave_card(const std::string& stage, const GpuMemoryFailure& failure) const {
  progress_.warn(fmt::format("{}: {}; the processor continues", stage, failure.what()));
  model_->leave_card();
}

/// The body on the card, brought there if it is not yet; null on the processor.
BodyOnCard* SkinScattering::card(const std::string& stage) const {
  try {
    return model_->card();
  } catch (const GpuMemoryFailure& failure) {
    leave_card(stage, failure);
    return nullptr;
  }
}

/// Has the card do it and records that. False on the processor, and from where on the card has too little memory.
template <typename Work>
bool SkinScattering::on_card(const std::string& stage, Eigen::Index right_hand_sides, const Work& work) {
  const auto start = std::chrono::steady_clock::now();
  BodyOnCard* const body = card(stage);
  if (body == nullptr) {
    return false;
  }
  try {
    const SolveReport report = work(*body);
    record(stage, right_hand_sides, report, seconds_since(start));
    return true;
  } catch (const GpuMemoryFailure& failure) {
    leave_card(stage, failure);
    return false;
  }
}

void SkinScattering::prepare() {
  if (gpu() == nullptr) {
    prepare_solver();
  }
}

Gpu* SkinScattering::gpu() const {
  const BodyOnCard* const body = card("body");
  return body != nullptr ? &body->gpu() : nullptr;
}

std::optional<IncidentProblem> SkinScattering::incident_on_card(const std::vector<Eigen::Index>& faces,
                                                                const Eigen::VectorXd& amplitudes,
                                                                const Eigen::VectorXd& weights,
                                                                const Eigen::MatrixXcd& beyond, bool scattered) {
  BodyOnCard* const body = card("body");
  return body != nullptr ? std::optional(body->incident_problem(array_, faces, amplitudes, weights, beyond, scattered))
                         : std::nullopt;
}

Eigen::MatrixXcd SkinScattering::pressure(const Eigen::MatrixXcd& drives, const std::string& stage, bool single) {
  Eigen::MatrixXcd p;
  if (on_card(stage, drives.cols(), [&](BodyOnCard& card) {
        Solved solved = card.pressure(array_, drives, reporter());
        p = std::move(solved.x);
        return solved.report;
      })) {
    return p;
  }
  const IncidentField field = driven_field(drives, single);
  return solved(system().right_hand_side(field), field, stage);
}

std::optional<BodyOnCard::Spanned> SkinScattering::spanned_on_card(
    const std::shared_ptr<const Eigen::MatrixXcd>& drives, double tolerance, const BodyOnCard::Wanted& wanted,
    const std::string& stage) {
  std::optional<BodyOnCard::Spanned> spanned;
  const auto work = [&](BodyOnCard& card) {
    spanned =
        drives ? card.spanned(array_, drives, wanted, reporter()) : card.spanned(array_, tolerance, wanted, reporter());
    return spanned->report;
  };
  if (on_card(stage, 0, work)) {  // how many is known when they are solved
    records_.back().right_hand_sides = static_cast<int>(spanned->drives);
  }
  return spanned;
}

Eigen::MatrixXcd SkinScattering::spanned_pressure(const LowRank& drives, const std::string& stage) {
  IncidentField field;
  if (system().needs_incident_pressure()) {
    field.pressure = matrix_product(unit_field().pressure, drives.basis);
  }
  return solved(drives.coefficients.adjoint(), field, stage);
}

Eigen::MatrixXcd SkinScattering::solved(const Eigen::MatrixXcd& b, const IncidentField& field,
                                        const std::string& stage) {
  const auto start = std::chrono::steady_clock::now();
  const Solved solved = prepare_solver().solve(b, reporter());
  Eigen::MatrixXcd p = system().pressure(solved.x, field);
  record(stage, b.cols(), solved.report, seconds_since(start));
  return p;
}

Eigen::MatrixXcd SkinScattering::transfer_rows(const std::vector<Eigen::Index>& faces, const std::string& stage) {
  Eigen::MatrixXcd rows;
  if (on_card(stage, static_cast<Eigen::Index>(faces.size()), [&](BodyOnCard& card) {
        Solved solved = card.transfer_rows(array_, faces, reporter());
        rows = std::move(solved.x);
        return solved.report;
      })) {
    return rows;
  }
  const auto count = static_cast<Eigen::Index>(faces.size());
  Eigen::MatrixXcd unit = Eigen::MatrixXcd::Zero(system().faces(), count);
  for (Eigen::Index j = 0; j < count; ++j) {
    unit(faces[static_cast<std::size_t>(j)], j) = 1.0;
  }
  return weighted_rows(unit, stage);
}

Eigen::MatrixXcd SkinScattering::weighted_rows(const Eigen::MatrixXcd& weights, const std::string& stage) {
  const Eigen::MatrixXcd b = system().transposed_right_hand_side(weights);
  const auto start = std::chrono::steady_clock::now();
  const Solved solved = prepare_solver().solve_transpose(b, reporter());
  record(stage, b.cols(), solved.report, seconds_since(start));
  return system().weighted_rows(weights, solved.x, unit_field());
}

std::string describe_decision(const SkinScattering& scattering) {
  const ScatteringSystem& system = scattering.system();
  const SolverOptions& options = scattering.decision().options;
  if (Gpu* const gpu = scattering.gpu()) {
    return fmt::format("  solver: on {}, single, {} unknowns ({})", gpu->info().name, system.faces(),
                       scattering.device().reason);
  }
  std::string text = fmt::format("  solver: {}, {}, {} unknowns", solver_name(options.kind, options.two_level),
                                 precision_name(options), system.faces());
  if (system.near_pairs() > 0) {
    text += fmt::format(", {} near pairs", system.near_pairs());
  }
  if (traits(system.scheme()).interior_points) {
    text += fmt::format(", {} interior points", system.interior_points().cols());
  }
  return text + fmt::format(" ({})", scattering.decision().reason);
}

void require_solved(const SolveRecord& solve, double tolerance) {
  const double most = std::min(kBroken * tolerance, kNoSolution);
  if (solve.residual <= most) {
    return;
  }
  const auto named = [&](Scheme scheme) { return to_string(scheme) == solve.scheme; };
  throw NumericalError(fmt::format(
      "{}: scheme {} by {} on {} faces left a residual of {:.1e} after {} steps; at most {:.1e} is accepted, for a "
      "tolerance of {:.1e}: {}",
      solve.stage, solve.scheme, solve.solver, solve.unknowns, solve.residual, solve.steps, most, tolerance,
      broken_remedy(*std::ranges::find_if(all_schemes(), named))));
}

void require_finite(const std::string& what, const Eigen::MatrixXcd& pressure) {
  if (!pressure.allFinite()) {
    throw NumericalError(fmt::format("{}: the scattered pressure is not finite", what));
  }
}

std::shared_ptr<SkinModel> KeptModels::get(const std::string& role, const TriangleMesh& mesh, const Wave& wave,
                                           Scheme scheme, const SolverSpec& spec, Eigen::Index right_hand_sides) {
  const auto found = entries_.find(role);
  if (found != entries_.end()) {
    const ScatteringSystem& system = found->second.model->system();
    if (system.scheme() == scheme && found->second.spec == spec && same_wave(system.wave(), wave)) {
      if (same_mesh(system.mesh(), mesh)) {
        return found->second.model;
      }
      if (found->second.model.use_count() == 1 && found->second.model->follow(mesh)) {
        return found->second.model;
      }
    }
    entries_.erase(found);  // before the next one takes its memory
  }
  const TriangleMesh* exact = bodies_ != nullptr ? bodies_->like(mesh) : nullptr;
  auto model =
      std::make_shared<SkinModel>(exact != nullptr ? *exact : mesh, wave, scheme, spec, scenes_ * right_hand_sides);
  entries_.emplace(role, Entry{spec, model});
  return model;
}

std::unique_ptr<SkinScattering> make_scattering(const std::string& role, const TriangleMesh& mesh, Scheme scheme,
                                                const SolverSpec& spec, Eigen::Index right_hand_sides,
                                                const Model& model, const ChannelResponse& response, KeptModels* kept,
                                                std::vector<SolveRecord>& records, Progress& progress) {
  TransducerArray array = model.fixed->array;
  array.response = response;
  if (kept == nullptr || model.fixed->array.kind != TransducerArray::Kind::kTransducers) {
    return std::make_unique<SkinScattering>(mesh, model.fixed->wave, scheme, spec, std::move(array), records, progress,
                                            right_hand_sides);
  }
  const TriangleMesh own(model.own_frame(mesh.vertices()), mesh.triangles());
  return std::make_unique<SkinScattering>(kept->get(role, own, model.fixed->wave, scheme, spec, right_hand_sides),
                                          moved(array, model.own_frame), records, progress);
}

}  // namespace touchfield
