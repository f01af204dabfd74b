#include "sim/motion/scorer.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace touchfield {

Scorer::Scorer(const MovingModel& moving) : moving_(moving) {
  const Scene& scene = moving.first().fixed->scene;
  spec_ = scene.solve.solver;
  spec_.solver = SolverChoice::kAuto;
  spec_.precision = PrecisionChoice::kAuto;
  if (moving.is_rigid()) {
    kept_.expect(static_cast<int>(std::ceil(scene.motion->seconds * scene.motion->score_hz)));
  }
}

Scorer::Scored Scorer::at(double seconds, const Eigen::MatrixXcd& drives) {
  const MotionState state = moving_.state(seconds);
  const Model model = moving_.at(state);
  Scored scored;
  scored.metrics.resize(static_cast<std::size_t>(drives.cols()));
  if (!model.boxes.empty()) {
    scored.patch = moving_.patch(model);
  }
  scored.mesh = moving_.evaluation_mesh(model, state);
  if (!scored.mesh) {
    return scored;
  }
  const TriangleMesh& mesh = *scored.mesh;
  const Evaluation& evaluation = model.fixed->evaluation;
  records_.clear();
  const auto scattering = make_scattering("evaluation", mesh, evaluation.scheme, spec_, drives.cols(), model,
                                          evaluation.channels.response, &kept_, records_, silent_);
  scored.pressure = scattering->pressure(drives, "evaluation");
  require_finite(fmt::format("evaluation at {:.3f} s", seconds), scored.pressure);
  for (const SolveRecord& record : records_) {
    worst_residual_ = std::max(worst_residual_, record.residual);
  }
  if (!gradient_ || !moving_.is_rigid()) {
    gradient_.emplace(mesh, model.fixed->wave.k());
  }
  if (presses(model, mesh)) {
    scored.target = build_target(model, mesh);
  }
  for (Eigen::Index m = 0; m < drives.cols(); ++m) {
    const Eigen::VectorXcd pressure = scored.pressure.col(m);
    const Eigen::VectorXd radiation = radiation_pressure(*gradient_, model.fixed->wave, pressure);
    scored.metrics[static_cast<std::size_t>(m)] =
        scored.target ? metrics_of(mesh, model.boxes, *scored.target, pressure, radiation)
                      : metrics_of(mesh, pressure, radiation);
  }
  return scored;
}

}  // namespace touchfield
