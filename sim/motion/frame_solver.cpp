#include "sim/motion/frame_solver.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/solve/stages.h"
#include "sim/solve/transfer.h"
#include "solvers/linear/blas_product.h"

namespace touchfield {

namespace {

constexpr double kDriveTolerance = 5e-3;  // a tenth of what a mesh is off that a frame has time for
constexpr int kMostPlaces = 33;

/// How fast a frame has to be does not bear double precision, nor does the mesh need it.
SolverSpec frame_solver_spec(const SolverSpec& scene) {
  SolverSpec spec = scene;
  if (spec.precision == PrecisionChoice::kAuto) {
    spec.precision = PrecisionChoice::kSingle;
  }
  return spec;
}

/// The body at so many of the places where it may be seen.
std::vector<std::unique_ptr<SkinScattering>> places(const MotionSensor& sensor, Scheme scheme, int count,
                                                    std::vector<SolveRecord>& records, Progress* progress) {
  const Model& model = sensor.solved().first();
  std::vector<std::unique_ptr<SkinScattering>> all;
  Progress silent;
  for (const TriangleMesh& mesh : sensor.places(count)) {
    all.push_back(std::make_unique<SkinScattering>(mesh, model.wave, scheme, model.scene.solve.solver, model.array,
                                                   records, silent));
    if (progress != nullptr) {  // those of all rounds before are about as many
      progress->advance(static_cast<double>(count - 3 + static_cast<int>(all.size())) / (2 * kMostPlaces + 1));
    }
  }
  return all;
}

/// The largest share of b, by norm, that drives leave out at a place.
double left_out(const std::vector<std::unique_ptr<SkinScattering>>& all, const Eigen::MatrixXcd& drives) {
  double most = 0.0;
  for (const auto& place : all) {
    const Eigen::MatrixXcd b = place->system().right_hand_side(place->system().incident(place->array()));
    const double total = b.squaredNorm();
    most = std::max(most, std::max(0.0, total - matrix_product(b, drives).squaredNorm()) / total);
  }
  return std::sqrt(most);
}

}  // namespace

Eigen::MatrixXcd drives_of_motion(const MotionSensor& sensor, Scheme scheme, Progress* progress) {
  std::vector<SolveRecord> records;
  int count = 3;
  auto known = places(sensor, scheme, count, records, progress);
  for (;;) {
    Eigen::MatrixXcd drives = spanning_drives(known, 0.5 * kDriveTolerance);
    if (count >= kMostPlaces) {
      return drives;
    }
    count = 2 * count - 1;  // those between, too
    known = places(sensor, scheme, count, records, progress);
    if (left_out(known, drives) <= kDriveTolerance) {
      return drives;
    }
  }
}

Eigen::MatrixXcd drives_for(const MotionSensor& sensor, const MethodSpec& method, Progress* progress) {
  const bool whole_skin = method.kind->model == MethodModel::kSkin && method.kind->minds_quiet &&
                          sensor.solved().first().scene.solve.quiet_weight > 0;
  return whole_skin ? drives_of_motion(sensor, method.scheme, progress) : Eigen::MatrixXcd();
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
      method_(method),
      solver_(frame_solver_spec(moving.first().scene.solve.solver)),
      drives_(drives.size() > 0 ? std::make_shared<const Eigen::MatrixXcd>(std::move(drives)) : nullptr) {
  method_.iterations = moving.first().scene.motion->iterations;
  method_.start = StartSpec{};
  method_.start.kind = StartSpec::Kind::kZero;
  if (moving.is_rigid() && is_exact(moving.first().scene.motion->sensor)) {
    kept_.expect(
        static_cast<int>(std::ceil(moving.first().scene.motion->seconds * moving.first().scene.motion->frames_hz)));
  }
}

void FrameSolver::set_up(const Model& model, const std::optional<Target>& target, MotionFrame& frame) {
  const bool still = methods_ && own_frame_->rotation == model.own_frame.rotation &&
                     own_frame_->shift == model.own_frame.shift && *vertices_ == model.body.mesh.vertices() &&
                     *beyond_ == model.beyond.corners;
  if (still) {
    if (target) {
      methods_->aim(*target);
    }
    return;
  }
  methods_.reset();
  scattering_.reset();
  own_frame_ = model.own_frame;
  vertices_ = model.body.mesh.vertices();
  beyond_ = model.beyond.corners;
  const Eigen::Index block = drives_ ? drives_->cols() : model.array.size();
  scattering_ = timed(silent_, frame.seconds, "set_up", "", [&] {
    return make_scattering("frame", model.body.mesh, method_.scheme, solver_, block, model, model.array.response,
                           &kept_, records_, silent_);
  });
  SolveSpec spec = model.scene.solve;
  spec.methods = {method_};
  methods_ = std::make_unique<MethodSolver>(*scattering_, model.array.size(), target, std::move(spec), quiet_skin(model));
  if (drives_) {
    methods_->span(drives_);
  }
}

MotionFrame FrameSolver::quiet() const {
  MotionFrame frame;
  frame.quiet = true;
  frame.solution.phases = Eigen::VectorXd::Zero(moving_.first().array.size());
  frame.solution.amplitudes = frame.solution.phases;
  return frame;
}

MotionFrame FrameSolver::lost() const {
  MotionFrame frame = quiet();
  frame.lost = true;
  return frame;
}

MotionFrame FrameSolver::solve(const Model& model) {
  MotionFrame frame;
  records_.clear();
  std::optional<Target> target;
  if (presses(model)) {
    target = build_target(model);
  }
  if (!target && method_.kind->model != MethodModel::kGiven) {
    return quiet();
  }
  set_up(model, target, frame);
  const bool works_on_body = method_.kind->model == MethodModel::kSkin || method_.kind->model == MethodModel::kCentre;
  if (works_on_body) {
    timed(silent_, frame.seconds, "factorise", "", [&] { scattering_->prepare(); });
  }
  Eigen::VectorXd amplitudes = target ? target->amplitudes : Eigen::VectorXd();
  if (target && !model.scene.target->pressure) {
    if (!scale_) {
      MethodSpec usual = method_;
      usual.iterations = kUsualIterations;
      scale_ = methods_->best_scale(usual, model.body.mesh, model.boxes, silent_);
    }
    amplitudes *= *scale_;
  }
  if (method_.kind->model == MethodModel::kSkin) {
    timed(silent_, frame.seconds, "transfer", "", [&] { methods_->skin_problem(amplitudes, silent_); });
  }
  const Vector3 patch = target ? moving_.patch(model) : Vector3::Zero();
  const MotionSpec& motion = *model.scene.motion;
  std::optional<Eigen::VectorXd> before;
  if (motion.start == MotionSpec::Start::kPrevious && phases_.size() > 0) {
    before = motion.steer ? steered(phases_, model.array, model.wave, patch_, patch) : phases_;
  }
  frame.solution = timed(silent_, frame.seconds, "phases", "",
                         [&] { return methods_->solve(method_, amplitudes, silent_, before ? &*before : nullptr); });
  phases_ = frame.solution.phases;
  patch_ = patch;
  for (const SolveRecord& record : records_) {
    worst_residual_ = std::max(worst_residual_, record.residual);
  }
  return frame;
}

}  // namespace touchfield
