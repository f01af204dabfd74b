#pragma once

#include <optional>
#include <vector>

#include <Eigen/Core>

#include "sim/core/progress.h"
#include "sim/field/metrics.h"
#include "sim/field/surface_gradient.h"
#include "sim/field/target.h"
#include "sim/motion/moving_model.h"
#include "sim/run/run_data.h"
#include "sim/run/skin_scattering.h"

namespace touchfield {

/// Scores on the true skin, all methods of an instant at once.
class Scorer {
 public:
  /// moving   has to outlive the scorer
  explicit Scorer(const MovingModel& moving);

  struct Scored {
    Vector3 patch = Vector3::Zero();  // of the target, as it is
    std::vector<Metrics> metrics;     // per method
    std::optional<TriangleMesh> mesh;
    std::optional<Target> target;
    Eigen::MatrixXcd pressure;  // M x methods [Pa]
  };

  /// drives   N x methods, as they sound
  Scored at(double seconds, const Eigen::MatrixXcd& drives);

  /// The largest relative residual that an instant's equations were left with.
  double worst_residual() const { return worst_residual_; }

 private:
  const MovingModel& moving_;
  SolverSpec spec_;
  KeptModels kept_;
  std::vector<SolveRecord> records_;
  Progress silent_;
  std::optional<SurfaceGradient> gradient_;
  double worst_residual_ = 0;
};

}  // namespace touchfield
