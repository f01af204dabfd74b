#include "sim/motion/frame_solver.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "sim/model/stages.h"
#include "sim/run/solver_choice.h"
#include "sim/run/transfer.h"
#include "solvers/linear/blas_product.h"
#include "solvers/linear/factorisations.h"
#include "solvers/linear/low_rank.h"

namespace touchfield {

namespace {

constexpr double kDriveTolerance = 5e-3;  // a tenth of what a mesh is off that a frame has time for
constexpr double kFrameResidual = kDriveTolerance / 5;
constexpr int kDescents = 2;      // steps of a descent for each iteration that the scene says
constexpr double kSampled = 0.8;  // of it, by the rows that are checked: the others may have more
constexpr int kFewestPlaces = 9;
constexpr int kFirstPlaces = 9;  // of a motion, where the target is looked for
constexpr int kMostPlaces = 33;
constexpr double kLargestStep = 1.2;       // wavelengths, between places that drives are found at
constexpr Eigen::Index kRowsAChannel = 3;  // from which drives are found

/// How fast a frame has to be does not bear double precision, nor does the mesh need it.
SolverSpec frame_solver_spec(const SolverSpec& scene, Scheme scheme) {
  SolverSpec spec = scene;
  spec.tolerance = frame_tolerance(scene, scheme);
  if (spec.precision == PrecisionChoice::kAuto) {
    spec.precision = PrecisionChoice::kSingle;
  }
  return spec;
}

/// Whether frames after the first one follow the phases through the factors of the equations (FactoredTransfer).
bool follows(const Model& model, const MethodSpec& method) {
  const SolverSpec spec = frame_solver_spec(model.fixed->scene.solve.solver, method.scheme);
  const Eigen::Index faces = model.body.mesh.face_count();
  const SolverOptions options =
      choose_solver(spec, method.scheme, faces, available_memory(), model.fixed->array.size()).options;
  // A small body is solved as fast with a transfer matrix, to the last bit each time.
  constexpr Eigen::Index kFewestFollowed = 1000;
  return (faces >= kFewestFollowed || !model.beyond.empty()) &&
         (method.kind->name == "surface" || method.kind->radiation) && !method.free_amplitudes &&
         model.fixed->scene.solve.outside_weight > 0 &&
         model.fixed->scene.motion->start == MotionSpec::Start::kPrevious && options.kind == SolverKind::kLu &&
         options.precision == Precision::kSingle &&
         !choose_device(spec, method.scheme, faces, model.fixed->array.size()).card;
}

bool works_on_body(const MethodSpec& method) {
  return method.kind->model == MethodModel::kSkin || method.kind->model == MethodModel::kCentre;
}

/// Rows of b of every channel at one place, some of all its rows, evenly over them: as long as 1 together.
///
/// shift   0 to 1: two shifts share few rows
Eigen::MatrixXcd sampled_rows(const Model& model, Scheme scheme, const TriangleMesh& place, Eigen::Index count,
                              double shift) {
  SystemOptions options;
  options.coupling = model.fixed->scene.solve.solver.coupling;
  const ScatteringSystem system(place, model.fixed->wave, scheme, options);
  std::vector<Eigen::Index> rows(static_cast<std::size_t>(std::min(count, system.faces())));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    const double share = (static_cast<double>(i) + shift) / static_cast<double>(rows.size());
    rows[i] = static_cast<Eigen::Index>(share * static_cast<double>(system.faces()));
  }
  const Eigen::MatrixXcd b = system.right_hand_side_rows(model.fixed->array, rows);
  return b / b.norm();
}

/// b of every channel by a sample at several places, one below the other.
class SampledMotion {
 public:
  /// every    how many places further each next one is, from the first of `places`
  /// rows     about so many in all
  /// phase    0 to 1: of the samples, see sampled_rows
  SampledMotion(const Model& model, Scheme scheme, const std::vector<TriangleMesh>& places, std::size_t every,
                Eigen::Index rows, double phase) {
    constexpr double kGolden = 0.6180339887498949;  // the next place has other rows
    const auto count = static_cast<Eigen::Index>((places.size() - 1) / every + 1);
    for (std::size_t i = 0; i < places.size(); i += every) {
      const double shift = phase + kGolden * static_cast<double>(i);
      const Eigen::MatrixXcd own = sampled_rows(model, scheme, places[i], rows / count + 1, shift - std::floor(shift));
      rows_.conservativeResize(begin_.back() + own.rows(), own.cols());
      rows_.bottomRows(own.rows()) = own;
      begin_.push_back(rows_.rows());
    }
  }

  const Eigen::MatrixXcd& rows() const { return rows_; }

  /// How many of the first drives do, so that no place has more than `tolerance` of b left out, by norm; -1 if all do
  /// not.
  Eigen::Index sufficient(const Eigen::MatrixXcd& drives, double tolerance) const {
    const Eigen::MatrixXd energy = matrix_product(rows_, drives).cwiseAbs2();
    Eigen::VectorXd most = Eigen::VectorXd::Zero(drives.cols());  // left out with so many more than one
    for (std::size_t i = 0; i + 1 < begin_.size(); ++i) {
      Eigen::RowVectorXd own = energy.middleRows(begin_[i], begin_[i + 1] - begin_[i]).colwise().sum();
      double left = 1.0;
      for (Eigen::Index k = 0; k < own.size(); ++k) {
        left -= own(k);
        most(k) = std::max(most(k), left);
      }
    }
    const auto enough =
        std::find_if(most.begin(), most.end(), [&](double left) { return left <= tolerance * tolerance; });
    return enough != most.end() ? enough - most.begin() + 1 : -1;
  }

 private:
  Eigen::MatrixXcd rows_;
  std::vector<Eigen::Index> begin_{0};  // of each place's rows, and their end
};

double farthest_step(const std::vector<TriangleMesh>& places) {
  double most = 0.0;
  for (std::size_t i = 1; i < places.size(); ++i) {
    most = std::max(most, (places[i].vertices() - places[i - 1].vertices()).colwise().norm().maxCoeff());
  }
  return most;
}

/// Orthonormal drives that span these rows to the tolerance, those first that carry most of them.
Eigen::MatrixXcd principal_drives(const Eigen::MatrixXcd& rows, double tolerance) {
  const LowRank span = compressed(rows.adjoint(), tolerance);
  const HermitianEigen eigen = hermitian_eigen(hermitian_product(span.coefficients.adjoint()));
  return matrix_product(span.basis, eigen.vectors.rowwise().reverse());
}

}  // namespace

double frame_tolerance(const SolverSpec& scene, Scheme scheme) {
  return traits(scheme).burton_miller ? std::max(scene.tolerance, kFrameResidual) : scene.tolerance;
}

Eigen::MatrixXcd drives_of_motion(const MotionSensor& sensor, Scheme scheme, Progress* progress) {
  const Model& model = sensor.solved().first();
  const Eigen::Index rows = kRowsAChannel * model.fixed->array.size();
  int count = kFewestPlaces;
  while (count < kMostPlaces && farthest_step(sensor.places(count)) > kLargestStep * model.fixed->wave.wavelength()) {
    count = 2 * count - 1;
  }
  for (;; count = 2 * count - 1) {
    const std::vector<TriangleMesh> places = sensor.places(2 * count - 1);
    const SampledMotion known(model, scheme, places, 2, rows, 0.0);
    const Eigen::MatrixXcd drives = principal_drives(known.rows(), 0.5 * kDriveTolerance);
    // By other rows, of those places and of the ones between.
    const SampledMotion checked(model, scheme, places, 1, rows, 0.5);
    const Eigen::Index sufficient = checked.sufficient(drives, kSampled * kDriveTolerance);
    if (sufficient > 0 || count >= kMostPlaces) {
      return sufficient > 0 ? Eigen::MatrixXcd(drives.leftCols(sufficient)) : drives;
    }
    if (progress != nullptr) {
      progress->advance(static_cast<double>(count) / kMostPlaces);
    }
  }
}

Eigen::MatrixXcd drives_for(const MotionSensor& sensor, const MethodSpec& method, Progress* progress) {
  const Model& model = sensor.solved().first();
  const bool whole_skin = method.kind->model == MethodModel::kSkin && method.kind->counts_outside &&
                          model.fixed->scene.solve.outside_weight > 0;
  return whole_skin && !follows(model, method) ? drives_of_motion(sensor, method.scheme, progress) : Eigen::MatrixXcd();
}

Eigen::VectorXd steered(const Eigen::VectorXd& phases, const TransducerArray& array, const Wave& wave,
                        const Vector3& before, const Vector3& now) {
  if (array.kind != TransducerArray::Kind::kTransducers) {
    return phases;
  }
  const Eigen::VectorXd old_way = (array.positions.colwise() - before).colwise().norm();
  const Eigen::VectorXd new_way = (array.positions.colwise() - now).colwise().norm();
  return phases - wave.k() * (new_way - old_way);
}

FrameSolver::FrameSolver(const MovingModel& moving, const MethodSpec& method, Eigen::MatrixXcd drives)
    : moving_(moving),
      first_(method),
      later_(method),
      solver_(frame_solver_spec(moving.first().fixed->scene.solve.solver, method.scheme)),
      drives_(drives.size() > 0 ? std::make_shared<const Eigen::MatrixXcd>(std::move(drives)) : nullptr),
      follows_(follows(moving.first(), method)) {
  later_.iterations =
      moving.first().fixed->scene.motion->iterations * (method.kind->radiation || follows_ ? kDescents : 1);
  later_.start = StartSpec{};
  later_.start.kind = StartSpec::Kind::kZero;
  if (moving.is_rigid() && is_exact(moving.first().fixed->scene.motion->sensor)) {
    kept_.expect(static_cast<int>(
        std::ceil(moving.first().fixed->scene.motion->seconds * moving.first().fixed->scene.motion->frames_hz)));
  }
}

MotionFrame FrameSolver::begin(std::optional<Model>* solved) {
  const double seconds = moving_.first().fixed->scene.motion->seconds;
  MotionFrame frame;
  for (int place = 0; place < kFirstPlaces; ++place) {
    frame = solve(moving_.state(seconds * place / (kFirstPlaces - 1)), solved);
    if (!frame.silent) {
      break;
    }
  }
  return frame;
}

bool FrameSolver::set_up(const Model& model, const std::optional<Target>& target, MotionFrame& frame) {
  const bool still = methods_ && own_frame_->rotation == model.own_frame.rotation &&
                     own_frame_->shift == model.own_frame.shift && *vertices_ == model.body.mesh.vertices() &&
                     *beyond_ == model.beyond.corners;
  if (still) {
    if (target) {
      methods_->aim(*target);
    }
    return false;
  }
  methods_.reset();
  scattering_.reset();
  own_frame_ = model.own_frame;
  vertices_ = model.body.mesh.vertices();
  beyond_ = model.beyond.corners;
  const Eigen::Index block = drives_ ? drives_->cols() : model.fixed->array.size();
  scattering_ = timed(silent_, frame.seconds, "set_up", "", [&] {
    return make_scattering("frame", model.body.mesh, later_.scheme, solver_, block, model, model.fixed->array.response,
                           &kept_, records_, silent_);
  });
  SolveSpec spec = model.fixed->scene.solve;
  spec.methods = {later_};
  methods_ = std::make_unique<MethodSolver>(*scattering_, model.fixed->array.size(), target, std::move(spec),
                                            outside_skin(model));
  if (drives_) {
    methods_->span(drives_);
  }
  return true;
}

SkinMap FrameSolver::mapped(const std::vector<Eigen::Index>& first) const {
  const auto copies = static_cast<Eigen::Index>(first.size());
  const Eigen::Index faces = scattering_->system().faces();
  const Eigen::Index points = incident_beyond_.rows();
  return {[this, &first, copies, faces, points](const Eigen::VectorXcf& q) {
            Eigen::VectorXcf all(copies + faces + points);
            all.segment(copies, faces) = factored_->pressure(q);
            all.head(copies) = all.segment(copies, faces)(first);
            multiply(Op::kPlain, incident_beyond_, q, 0.0F, all.tail(points));
            return all;
          },
          [this, &first, copies, faces, points](const Eigen::VectorXcf& v) {
            Eigen::VectorXcf on_faces = v.segment(copies, faces);
            on_faces(first) += v.head(copies);
            Eigen::VectorXcf back = factored_->sent_back(on_faces);
            multiply(Op::kAdjoint, incident_beyond_, v.tail(points), 1.0F, back);
            return back;
          }};
}

PhaseSolution FrameSolver::descended(const Model& model, const OutsideSkin& outside, const Target& target,
                                     const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& before) {
  const Eigen::VectorXd& areas = scattering_->system().mesh().areas();
  const double outside_weight = model.fixed->scene.solve.outside_weight;
  const std::vector<Eigen::Index> none;
  MappedSkin skin{mapped(none), Eigen::VectorXd::Zero(areas.size() + outside.beyond.size()), {}};
  skin.weights.resize(skin.amplitudes.size());
  skin.weights << outside.face_weights(areas, target, outside_weight), outside.beyond_weights(outside_weight);
  const Eigen::VectorXd inside = target.areas(areas);
  skin.weights(target.faces) += inside;
  skin.amplitudes(target.faces) = inside.cwiseProduct(amplitudes).cwiseQuotient(skin.weights(target.faces));
  skin.constant = inside.dot(amplitudes.cwiseAbs2()) - skin.weights.dot(skin.amplitudes.cwiseAbs2());
  return descent_.descend(skin, before, later_.iterations, later_.free_level, {}, &pressure_.emplace());
}

PhaseSolution FrameSolver::descended_by_radiation(const Model& model, const OutsideSkin& outside, const Target& target,
                                                  const Eigen::VectorXd& amplitudes, const Eigen::VectorXd& before) {
  const TriangleMesh& mesh = scattering_->system().mesh();
  const NearSkin near = near_skin(mesh, target, model.fixed->wave);
  const auto copies = static_cast<Eigen::Index>(near.faces.size());
  Eigen::VectorXd counted = Eigen::VectorXd::Zero(copies + mesh.face_count() + outside.beyond.size());
  counted.tail(counted.size() - copies) << outside.face_weights(mesh.areas(), target, 1.0), outside.beyond_weights(1.0);
  const RadiationSkin skin =
      radiation_skin(near, mesh, target, amplitudes, outside, model.fixed->wave, later_.outside_weight, counted);
  const SkinMap map = mapped(near.faces);
  RadiationMisfit::Point end;
  PhaseSolution solution =
      descent_.descend(RadiationMisfit(map, skin, later_.free_level), before, later_.iterations, {}, 0.0, {}, &end);
  pressure_ = std::sqrt(static_cast<float>(end.level)) * end.pressure.tail(end.pressure.size() - copies);
  return solution;
}

PhaseSolution FrameSolver::followed(const Model& model, const Target& target, const Eigen::VectorXd& amplitudes,
                                    const Eigen::VectorXd& before, bool moved, MotionFrame& frame) {
  const ScatteringSystem& system = scattering_->system();
  const OutsideSkin outside = outside_skin(model);
  try {
    timed(silent_, frame.seconds, "factorise", "", [&] {
      if (!factored_ || *factored_at_ != system.mesh().vertices()) {
        factored_.reset();  // before the next one takes its memory
        factored_ = std::make_unique<FactoredTransfer>(system);
        factored_at_ = system.mesh().vertices();
        moved = true;
      }
    });
    timed(silent_, frame.seconds, "transfer", "", [&] {
      if (moved) {
        factored_->face(system, scattering_->array());
        incident_beyond_ = outside.beyond_pressure_single(model.fixed->wave);
      }
    });
    PhaseSolution solution = timed(silent_, frame.seconds, "phases", "", [&] {
      return later_.kind->radiation ? descended_by_radiation(model, outside, target, amplitudes, before)
                                    : descended(model, outside, target, amplitudes, before);
    });
    leave_out_dead(scattering_->array().response, solution);
    return solution;
  } catch (const std::domain_error& error) {
    throw NumericalError(fmt::format("method {}: {}", later_.name, error.what()));
  }
}

Eigen::VectorXcd FrameSolver::pressure() {
  if (pressure_) {
    return pressure_->head(scattering_->system().faces()).cast<Complex>();
  }
  return works_on_body(later_) && methods_ ? methods_->pressure(drive(found_)) : Eigen::VectorXcd();
}

MotionFrame FrameSolver::solve(const MotionState& state, std::optional<Model>* solved) {
  const double begin = steady_now();
  Model model = moving_.at(state);
  const double posed = steady_now() - begin;
  MotionFrame frame = solve(model);
  frame.seconds.insert(frame.seconds.begin(), {"pose", posed});
  if (solved != nullptr) {
    solved->emplace(std::move(model));
  }
  return frame;
}

MotionFrame FrameSolver::solve(const Model& model) {
  MotionFrame frame;
  records_.clear();
  std::optional<Target> target;
  if (presses(model)) {
    target = build_target(model);
  }
  if (!target && later_.kind->model != MethodModel::kGiven) {
    return silent_frame();
  }
  const bool moved = set_up(model, target, frame);
  const Vector3 patch = target ? moving_.patch(model) : Vector3::Zero();
  if (target) {
    frame.target = patch;
  }
  const MotionSpec& motion = *model.fixed->scene.motion;
  std::optional<PhaseSolution> before;
  if (motion.start == MotionSpec::Start::kPrevious && found_.phases.size() > 0) {
    before = found_;
    if (motion.steer) {
      before->phases = steered(found_.phases, model.fixed->array, model.fixed->wave, patch_, patch);
    }
  }
  const MethodSpec& method = before || motion.start == MotionSpec::Start::kZero ? later_ : first_;
  const bool follow = follows_ && before;
  if (works_on_body(method) && !follow) {
    timed(silent_, frame.seconds, "factorise", "", [&] { scattering_->prepare(); });
  }
  Eigen::VectorXd amplitudes = target ? target->amplitudes : Eigen::VectorXd();
  if (target && !model.posture.target->pressure) {
    if (!scale_) {
      MethodSpec usual = later_;
      usual.iterations = kUsualIterations;
      scale_ = methods_->best_scale(usual, model.body.mesh, model.boxes, silent_);
    }
    amplitudes *= *scale_;
  }
  pressure_.reset();
  if (follow) {
    frame.solution = followed(model, *target, amplitudes, before->phases, moved, frame);
  } else {
    if (method.kind->model == MethodModel::kSkin) {
      timed(silent_, frame.seconds, "transfer", "", [&] { methods_->skin_problem(amplitudes, silent_); });
    }
    const Eigen::VectorXcd drives = before ? drive(*before) : Eigen::VectorXcd();
    frame.solution = timed(silent_, frame.seconds, "phases", "",
                           [&] { return methods_->solve(method, amplitudes, silent_, before ? &drives : nullptr); });
  }
  found_ = frame.solution;
  patch_ = patch;
  for (const SolveRecord& record : records_) {
    worst_residual_ = std::max(worst_residual_, record.residual);
  }
  return frame;
}

namespace {

// The quickest first. Of those that scripts/tables frame_study tries, none is both slower and farther off.
constexpr FrameSetting kSettings[] = {
    {3.0 * kMillimetre, 7.5 * kMillimetre, Scheme::kChief, 1},
    {3.0 * kMillimetre, 7.5 * kMillimetre, Scheme::kChief, 3},
    {2.4 * kMillimetre, 6.0 * kMillimetre, Scheme::kChief, 5},
    {1.7 * kMillimetre, 4.2 * kMillimetre, Scheme::kChief, 5},
    {1.7 * kMillimetre, 4.2 * kMillimetre, Scheme::kBurtonMillerPolished, 5},
};
constexpr double kWithin = 12 * kMillimetre;
constexpr double kMargin = 0.7;  // of the budget: frames on the wall clock find cold caches and sleeping threads
constexpr int kTrials = 9;
constexpr double kSway = 0.1e-3;  // from frame to frame [m]

/// A state in which a sensor that is not exact may see the skin: no two frames then have the same, also of a hand at
/// rest.
MotionState seen_state(const MovingModel& moving, double seconds, int frame) {
  MotionState state = moving.state(seconds);
  if (!is_exact(moving.first().fixed->scene.motion->sensor)) {
    state.skin = moving.at(state).body.mesh.vertices().colwise() + Vector3(frame * kSway, 0, 0);
  }
  return state;
}

/// The median time of some frames [s], without the first one, which also makes what the others keep.
double frame_seconds(Scene scene, Progress* progress) {
  scene.solve.allow_coarse_mesh = true;  // its time counts, not its result
  for (MethodSpec& method : scene.solve.methods) {
    method.start.kind = StartSpec::Kind::kZero;
  }
  const MovingModel moving(scene, nullptr, progress);
  const MethodSpec& method = moving.first().fixed->scene.solve.methods.front();
  FrameSolver solver(moving, method, drives_for(ExactSensor(moving), method));
  std::vector<double> took;
  for (int i = 0; i <= kTrials; ++i) {
    const double begin = steady_now();
    solver.solve(moving.at(seen_state(moving, scene.motion->seconds * i / kTrials, i)));
    took.push_back(steady_now() - begin);
  }
  const auto middle = took.begin() + 1 + kTrials / 2;
  std::nth_element(took.begin() + 1, middle, took.end());
  return *middle;
}

}  // namespace

FrameChoice choose_frame(const Scene& scene, Progress* progress) {
  FrameChoice choice;
  for (const FrameSetting& setting : kSettings) {
    const double milliseconds = 1e3 * frame_seconds(with_setting(scene, setting), progress);
    const bool fits = milliseconds <= 1e3 * kMargin * scene.motion->frame->budget;
    if (fits || choice.milliseconds == 0) {
      choice = {setting, milliseconds};
    }
    if (!fits) {
      break;
    }
  }
  return choice;
}

Scene within_budget(const Scene& scene, std::vector<std::string>& notes, Progress* progress) {
  if (!scene.motion || !scene.motion->frame) {
    return scene;
  }
  const FrameChoice choice = choose_frame(scene, progress);
  const double budget = 1e3 * scene.motion->frame->budget;
  notes.push_back(fmt::format(
      "frame: edges of {:.3g} and {:.3g} mm, {}, {} steps: {:.0f} ms per frame here, {} the requested {:.4g} ms",
      choice.setting.near_target / kMillimetre, choice.setting.far / kMillimetre, to_string(choice.setting.scheme),
      choice.setting.steps, choice.milliseconds, choice.milliseconds <= budget ? "within" : "NOT within", budget));
  return with_setting(scene, choice.setting);
}

Scene with_setting(const Scene& scene, const FrameSetting& setting) {
  Scene chosen = scene;
  for (BodySpec& body : chosen.bodies) {
    if (body.edge) {
      EdgeSpec edge;
      edge.near_target = setting.near_target;
      edge.far = setting.far;
      edge.within = kWithin;
      body.edge = edge;
    }
  }
  chosen.solve.scheme = setting.scheme;
  for (MethodSpec& method : chosen.solve.methods) {
    method.scheme = setting.scheme;
  }
  chosen.motion->iterations = setting.steps;
  chosen.motion->frame.reset();
  return chosen;
}

}  // namespace touchfield
