#include "sim/assess/scan_fit.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <Eigen/Dense>

#include "sim/assess/scan_comparison.h"
#include "sim/core/require.h"
#include "solvers/phase/madsen_damping.h"

namespace touchfield {

namespace {

constexpr std::size_t kMostFitted = 1000;   // points
constexpr std::size_t kMostSearched = 300;  // of the search for a start
constexpr int kSearchSteps = 4;             // of half a wavelength, to each side
constexpr int kMostSteps = 15;
constexpr double kDerivativeStep = 1e-3;   // of the step of a value
constexpr double kSmallStep = 3e-3;        // of the step of a value: ends the fit
constexpr double kLeastDetermined = 1e-4;  // least singular value over the largest, of scaled columns
constexpr double kFirstRadius = 2e-3;      // at 0 the reading has no slope [m]

/// Some of the points of a scan, and the setting as the only unknown.
class ScanResidual {
 public:
  ScanResidual(const Run& run, const Wave& wave, const MeasuredPoints& measured,
               const std::vector<Eigen::Index>& picked)
      : run_(run),
        wave_(wave),
        complex_(measured.complex),
        middle_(measured.points.rowwise().mean()),
        points_(measured.points(Eigen::all, picked)),
        measured_(measured.pressure(picked)) {}

  /// (factor computed - measured) / |measured|, real and imaginary parts.
  Eigen::VectorXd operator()(const ScanSetting& setting) const {
    Eigen::VectorXcd computed = scan_reading(run_, wave_, placed_points(points_, middle_, setting), setting);
    if (!computed.allFinite()) {  // a point lies on a transducer
      return Eigen::VectorXd::Constant(2 * computed.size(), std::numeric_limits<double>::infinity());
    }
    if (!complex_) {
      computed = computed.cwiseAbs().cast<Complex>().eval();
    }
    const ScanFit fit = fit_scan(computed, measured_, complex_);
    const Complex factor = std::polar(fit.scale, complex_ ? fit.turn : 0.0);
    const Eigen::VectorXcd rest = (factor * computed - measured_) / measured_.norm();
    Eigen::VectorXd residual(2 * rest.size());
    residual << rest.real(), rest.imag();
    return residual;
  }

 private:
  const Run& run_;
  const Wave& wave_;
  bool complex_;
  Vector3 middle_;
  Points points_;
  Eigen::VectorXcd measured_;
};

/// Evenly, of those that count.
std::vector<Eigen::Index> picked_points(const ScanComparison& comparison, std::size_t most) {
  std::vector<Eigen::Index> counting;
  for (std::size_t i = 0; i < comparison.points.size(); ++i) {
    if (comparison.points[i].left_out.empty()) {
      counting.push_back(static_cast<Eigen::Index>(i));
    }
  }
  const std::size_t count = std::min(most, counting.size());
  std::vector<Eigen::Index> picked(count);
  for (std::size_t i = 0; i < count; ++i) {
    picked[i] = counting[i * counting.size() / count];
  }
  return picked;
}

ScanSetting best_start(const ScanResidual& residual, const Wave& wave, const ScanSetting& start) {
  ScanSetting best = start;
  double least = residual(start).squaredNorm();
  for (int i = -kSearchSteps; i <= kSearchSteps; ++i) {
    for (int j = -kSearchSteps; j <= kSearchSteps; ++j) {
      ScanSetting tried = start;
      tried(kPlaceX) += 0.5 * i * wave.wavelength();
      tried(kPlaceY) += 0.5 * j * wave.wavelength();
      const double cost = residual(tried).squaredNorm();
      if (cost < least) {
        least = cost;
        best = tried;
      }
    }
  }
  return best;
}

/// Columns are those of the free values, each by its own step.
Eigen::MatrixXd slopes(const ScanResidual& residual, const ScanSetting& at, const Eigen::VectorXd& value,
                       const std::vector<int>& free) {
  Eigen::MatrixXd jacobian(value.size(), static_cast<Eigen::Index>(free.size()));
  for (std::size_t i = 0; i < free.size(); ++i) {
    ScanSetting moved = at;
    moved(free[i]) += kDerivativeStep * kScanValueInfo[free[i]].step;
    jacobian.col(static_cast<Eigen::Index>(i)) = (residual(moved) - value) / kDerivativeStep;
  }
  return jacobian;
}

void require_determined(const Eigen::MatrixXd& jacobian, const std::vector<int>& free) {
  const Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> values(normal);
  if (values.eigenvalues()(0) > kLeastDetermined * kLeastDetermined * values.eigenvalues()(normal.rows() - 1)) {
    return;
  }
  Eigen::Index weakest = 0;
  values.eigenvectors().col(0).cwiseAbs().maxCoeff(&weakest);
  const ScanValueInfo& value = kScanValueInfo[free[static_cast<std::size_t>(weakest)]];
  throw InputError(
      fmt::format("--fit {}: the measured points do not determine {}, alone or with the others; "
                  "fit fewer values, or measure points that extend in all directions",
                  value.group, value.name));
}

}  // namespace

ScanSetting fit_scan_setting(const Run& run, const Wave& wave, const std::string& method,
                             const MeasuredPoints& measured, const ScanSetting& start,
                             const std::vector<std::string>& groups) {
  std::vector<int> free;
  for (int i = 0; i < kScanValues; ++i) {
    if (std::ranges::find(groups, kScanValueInfo[i].group) != groups.end()) {
      free.push_back(i);
    }
  }
  const Run one = run_of_method(run, method);
  const ScanComparison comparison = compare_scan(one, wave, method, measured, start);
  ScanSetting at = start;
  const auto frees = [&](int value) { return std::ranges::find(free, value) != free.end(); };
  if (frees(kReceiver) && at(kReceiver) == 0) {
    at(kReceiver) = kFirstRadius;
  }
  if (frees(kPlaceX)) {
    at = best_start(ScanResidual(one, wave, measured, picked_points(comparison, kMostSearched)), wave, at);
  }
  const std::vector<Eigen::Index> picked = picked_points(comparison, kMostFitted);
  require(picked.size() > free.size(), "--fit: {} values of {} measured points that count, must be fewer than points",
          free.size(), picked.size());
  const ScanResidual residual(one, wave, measured, picked);
  Eigen::VectorXd value = residual(at);
  MadsenDamping damping(1e-3);
  for (int step = 0; step < kMostSteps && !free.empty(); ++step) {
    const Eigen::MatrixXd jacobian = slopes(residual, at, value, free);
    require_determined(jacobian, free);
    const Eigen::MatrixXd normal = jacobian.transpose() * jacobian;
    const Eigen::VectorXd gradient = jacobian.transpose() * value;
    Eigen::VectorXd change;
    for (bool accepted = false; !accepted;) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() *= 1 + damping.value();
      change = -damped.ldlt().solve(gradient);
      ScanSetting tried = at;
      for (std::size_t i = 0; i < free.size(); ++i) {
        const ScanValueInfo& info = kScanValueInfo[free[i]];
        tried(free[i]) = std::clamp(tried(free[i]) + change(static_cast<Eigen::Index>(i)) * info.step,
                                    info.low * info.unit, info.high * info.unit);
      }
      const Eigen::VectorXd next = residual(tried);
      const double fall = value.squaredNorm() - next.squaredNorm();
      accepted = fall > 0;
      if (accepted) {
        damping.accept(fall / (value.squaredNorm() - (value + jacobian * change).squaredNorm()));
        at = tried;
        value = next;
      } else if (change.norm() < kSmallStep || damping.exhausted()) {
        return at;
      } else {
        damping.reject();
      }
    }
    if (change.norm() < kSmallStep) {
      break;
    }
  }
  return at;
}

}  // namespace touchfield
