#include "sim/field/metrics.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "sim/core/units.h"
#include "sim/field/target_parts.h"

namespace touchfield {

namespace {

constexpr double kBin = 0.25 * kMillimetre;
constexpr double kHalfStrip = 2.0 * kMillimetre;

/// A pressure and area gathered along an axis of a box.
class WidthProfile {
 public:
  WidthProfile(double from, double to) : from_(from), area_(bins(from, to), 0.0), sum_(bins(from, to), 0.0) {}

  void add(double position, double area, double value) {
    const auto bin = static_cast<std::size_t>(
        std::clamp<double>(std::floor((position - from_) / kBin), 0.0, static_cast<double>(area_.size() - 1)));
    area_[bin] += area;
    sum_[bin] += area * value;
  }

  int size() const { return static_cast<int>(area_.size()); }
  double centre(int bin) const { return from_ + (bin + 0.5) * kBin; }
  /// Mean of a bin; NaN where no skin fell into it.
  double mean(int bin) const {
    const auto at = static_cast<std::size_t>(bin);
    return area_[at] > 0 ? sum_[at] / area_[at] : kNotComputed;
  }

 private:
  static std::size_t bins(double from, double to) {
    return static_cast<std::size_t>(std::max(1.0, std::ceil((to - from) / kBin)));
  }

  double from_;
  std::vector<double> area_;
  std::vector<double> sum_;
};

/// Where the profile falls to `level` going from `peak` in steps of `step`; NaN if it never does.
double crossing(const WidthProfile& profile, int peak, int step, double level) {
  for (int bin = peak + step; bin >= 0 && bin < profile.size(); bin += step) {
    const double here = profile.mean(bin);
    if (std::isnan(here)) {
      return kNotComputed;
    }
    if (here < level) {
      const double before = profile.mean(bin - step);
      const double share = (before - level) / (before - here);
      return profile.centre(bin - step) + share * step * kBin;
    }
  }
  return kNotComputed;
}

/// The largest pressure on a face of which no part is in the target; NaN if there is none.
double largest_outside(const Target& target, const Eigen::VectorXd& values) {
  Eigen::VectorXd outside = values;
  outside(target.faces).setConstant(kNotComputed);
  return outside.maxCoeff<Eigen::PropagateNumbers>();
}

/// A limit in some bands, numbered by 10 log10 of their middle in Hz: 43 is 20 kHz, 46 is 40 kHz, 50 is 100 kHz.
struct LimitRow {
  ExposureLimit limit;
  int first;
  int last;
};

constexpr const char* kCommittee = "INIRC-IRPA 1984";
constexpr const char* kCanada = "Health Canada 1991";
constexpr const char* kHygienists = "ACGIH 2004";
constexpr const char* kCeiling = "workers, never above";
constexpr const char* kTrade = "industry and commerce";

constexpr LimitRow kLimits[] = {
    {{kCommittee, "public", 70}, 43, 43},   {{kCommittee, "public", 100}, 44, 50},
    {{kCommittee, "workers", 75}, 43, 43},  {{kCommittee, "workers", 110}, 44, 50},
    {{kCanada, kTrade, 75}, 43, 43},        {{kCanada, kTrade, 110}, 44, 47},
    {{kHygienists, kCeiling, 105}, 43, 43}, {{kHygienists, kCeiling, 110}, 44, 44},
    {{kHygienists, kCeiling, 115}, 45, 50},
};

}  // namespace

const std::vector<MetricField>& metric_fields() {
  static const std::vector<MetricField> fields = {
      {"relative_error", "1", &Metrics::relative_error, true},
      {"relative_error_raw", "1", &Metrics::relative_error_raw, true},
      {"scale", "1", &Metrics::scale},
      {"correlation", "1", &Metrics::correlation},
      {"leakage", "1", &Metrics::leakage, true},
      {"mean_inside_pa", "Pa", &Metrics::mean_inside_pa},
      {"reached_share", "1", &Metrics::reached_share, true},
      {"cv_inside", "1", &Metrics::cv_inside, true},
      {"width_mm", "mm", &Metrics::width_mm},
      {"width_wanted_mm", "mm", &Metrics::width_wanted_mm},
      {"length_wanted_mm", "mm", &Metrics::length_wanted_mm},
      {"peak_pa", "Pa", &Metrics::peak_pa},
      {"relative_error_radiation", "1", &Metrics::relative_error_radiation, true},
      {"width_radiation_mm", "mm", &Metrics::width_radiation_mm},
      {"length_radiation_mm", "mm", &Metrics::length_radiation_mm},
      {"force_target_n", "N", &Metrics::force_target_n},
      {"force_elsewhere_n", "N", &Metrics::force_elsewhere_n},
      {"abs_force_elsewhere_n", "N", &Metrics::abs_force_elsewhere_n},
      {"loudest_elsewhere", "1", &Metrics::loudest_elsewhere},
      {"cost", "Pa2", &Metrics::cost},
      {"cost_skin", "Pa2 m2", &Metrics::cost_skin},
      {"cost_bound", "Pa2 m2", &Metrics::cost_bound},
      {"optimality_gap", "1", &Metrics::optimality_gap, true},
      {"error_bound", "1", &Metrics::error_bound, true},
      {"cost_radiation", "1", &Metrics::cost_radiation},
      {"cost_radiation_bound", "1", &Metrics::cost_radiation_bound},
      {"optimality_gap_radiation", "1", &Metrics::optimality_gap_radiation, true},
      {"power_share", "1", &Metrics::power_share, true},
      {"iterations", "1", &Metrics::iterations},
      {"seconds_solve", "s", &Metrics::seconds_solve},
      {"seconds_total", "s", &Metrics::seconds_total},
      {"evaluation_difference", "1", &Metrics::evaluation_difference, true},
      {"evaluation_difference_target", "1", &Metrics::evaluation_difference_target, true},
  };
  return fields;
}

Eigen::VectorXd radiation_pressure(const SurfaceGradient& gradient, const Wave& wave,
                                   const Eigen::VectorXcd& pressure) {
  // rho |v_t|^2 / 4 with |v_t| = |grad p| / (omega rho)
  const double kinetic = 1.0 / (4.0 * wave.medium().density * wave.omega() * wave.omega());
  return radiation_per_square(wave.medium()) * pressure.cwiseAbs2() -
         kinetic * gradient.of(pressure).colwise().squaredNorm().transpose();
}

double radiation_per_square(const Medium& medium) {
  return 1.0 / (4.0 * medium.density * medium.sound_speed * medium.sound_speed);
}

double wanted_width(const TriangleMesh& mesh, const TargetBox& box, const Target& target, int axis) {
  double low = std::numeric_limits<double>::infinity();
  double high = -low;
  const auto reach = [&](const Vector3& corner) {
    const double x = box.rotation.col(axis).dot(corner - box.centre);
    low = std::min(low, x);
    high = std::max(high, x);
  };
  if (box.shape == TargetShape::kMask) {
    for (std::size_t i = 0; i < target.faces.size(); ++i) {
      for (int c = 0; c < 3 && target.box[i] == 0; ++c) {
        reach(mesh.corner(target.faces[i], c));
      }
    }
  } else {
    for (const FacePart& part : face_parts(mesh, {box})) {
      std::ranges::for_each(part.corners, reach);
    }
  }
  return high > low ? high - low : kNotComputed;
}

double half_maximum_width(const TriangleMesh& mesh, const TargetBox& box, const Target& target,
                          const Eigen::VectorXd& values, int axis) {
  Vector3 facing = Vector3::Zero();
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    if (target.box[i] == 0) {
      facing += areas(static_cast<Eigen::Index>(i)) * mesh.normals().col(target.faces[i]);
    }
  }
  const auto own = box.rotation.col(axis);
  const auto other = box.rotation.col(1 - axis);
  const Eigen::VectorXd along = own.transpose() * (mesh.vertices().colwise() - box.centre);
  // The first bin edge is a multiple of the bin's width from the box's middle.
  WidthProfile profile(std::floor(along.minCoeff() / kBin) * kBin, along.maxCoeff());
  for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
    const double across = other.dot(mesh.centroids().col(f) - box.centre);
    const double reach =
        (mesh.corner(f, 0) - mesh.centroids().col(f)).norm() + (mesh.corner(f, 1) - mesh.corner(f, 2)).norm();
    if (facing.dot(mesh.normals().col(f)) <= 0 || std::abs(across) > kHalfStrip + reach) {
      continue;
    }
    // A face is wider than a bin: it is shared out in pieces of about half a bin.
    const Vector3 ab = mesh.corner(f, 1) - mesh.corner(f, 0);
    const Vector3 ac = mesh.corner(f, 2) - mesh.corner(f, 0);
    const double longest = std::max({ab.norm(), ac.norm(), (ac - ab).norm()});
    const int pieces = std::clamp(static_cast<int>(std::ceil(2.0 * longest / kBin)), 1, 400);
    const double piece_area = mesh.areas()(f) / (static_cast<double>(pieces) * pieces);
    const auto add_piece = [&](double u, double v) {
      const Vector3 x = mesh.corner(f, 0) + u / pieces * ab + v / pieces * ac - box.centre;
      if (std::abs(other.dot(x)) <= kHalfStrip) {
        profile.add(own.dot(x), piece_area, values(f));
      }
    };
    for (int i = 0; i < pieces; ++i) {
      for (int j = 0; i + j < pieces; ++j) {
        add_piece(i + 1.0 / 3.0, j + 1.0 / 3.0);
        if (i + j + 1 < pieces) {
          add_piece(i + 2.0 / 3.0, j + 2.0 / 3.0);
        }
      }
    }
  }
  int peak = -1;
  for (int bin = 0; bin < profile.size(); ++bin) {
    if (std::abs(profile.centre(bin)) <= 0.5 * box.size[axis] && !std::isnan(profile.mean(bin)) &&
        (peak < 0 || profile.mean(bin) > profile.mean(peak))) {
      peak = bin;
    }
  }
  if (peak < 0 || !(profile.mean(peak) > 0)) {
    return kNotComputed;
  }
  const double level = 0.5 * profile.mean(peak);
  return crossing(profile, peak, 1, level) - crossing(profile, peak, -1, level);
}

double wanted_mean(const TriangleMesh& mesh, const Target& target) {
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  return areas.dot(target.amplitudes) / areas.sum();
}

Metrics pattern_metrics(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, const Target& target,
                        const Eigen::VectorXcd& pressure) {
  const Eigen::VectorXd reached = pressure.cwiseAbs();
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  const Eigen::VectorXd inside = reached(target.faces);
  const double energy = mesh.areas().dot(reached.cwiseAbs2());
  const double energy_inside = areas.dot(inside.cwiseAbs2());
  const double wanted_energy = areas.dot(target.amplitudes.cwiseAbs2());
  const double product = areas.dot(inside.cwiseProduct(target.amplitudes));

  Metrics metrics;
  metrics.peak_pa = reached.maxCoeff();
  metrics.scale = product / energy;
  metrics.correlation = product / std::sqrt(energy * wanted_energy);
  const auto error_at = [&](double scale) {
    const double on_target = areas.dot((scale * inside - target.amplitudes).cwiseAbs2());
    return std::sqrt((on_target + scale * scale * (energy - energy_inside)) / wanted_energy);
  };
  metrics.relative_error = error_at(metrics.scale);
  metrics.relative_error_raw = error_at(1.0);
  metrics.leakage = 1.0 - energy_inside / energy;
  metrics.mean_inside_pa = areas.dot(inside) / areas.sum();
  metrics.reached_share = metrics.mean_inside_pa / wanted_mean(mesh, target);
  const double variance = energy_inside / areas.sum() - metrics.mean_inside_pa * metrics.mean_inside_pa;
  metrics.cv_inside = std::sqrt(std::max(variance, 0.0)) / metrics.mean_inside_pa;
  metrics.width_mm = half_maximum_width(mesh, boxes.front(), target, pressure.cwiseAbs2()) / kMillimetre;
  metrics.width_wanted_mm = wanted_width(mesh, boxes.front(), target) / kMillimetre;
  metrics.length_wanted_mm = wanted_width(mesh, boxes.front(), target, 1) / kMillimetre;
  return metrics;
}

Metrics metrics_of(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes, const Target& target,
                   const Eigen::VectorXcd& pressure, const Eigen::VectorXd& radiation) {
  Metrics metrics = pattern_metrics(mesh, boxes, target, pressure);
  const Eigen::VectorXd areas = target.areas(mesh.areas());
  const Eigen::VectorXd inside = radiation(target.faces);
  const Eigen::VectorXd wanted = target.amplitudes.cwiseAbs2();  // P' over its factor
  const double squares = mesh.areas().dot(radiation.cwiseAbs2());
  const double scale = std::max(areas.dot(inside.cwiseProduct(wanted)), 0.0) / squares;
  const double on_target = areas.dot((scale * inside - wanted).cwiseAbs2());
  const double off_target = scale * scale * std::max(squares - areas.dot(inside.cwiseAbs2()), 0.0);
  metrics.relative_error_radiation = std::sqrt((on_target + off_target) / areas.dot(wanted.cwiseAbs2()));
  metrics.width_radiation_mm = half_maximum_width(mesh, boxes.front(), target, radiation) / kMillimetre;
  metrics.length_radiation_mm = half_maximum_width(mesh, boxes.front(), target, radiation, 1) / kMillimetre;
  metrics.force_target_n = areas.dot(inside);
  metrics.force_elsewhere_n = mesh.areas().dot(radiation) - metrics.force_target_n;
  metrics.abs_force_elsewhere_n = mesh.areas().dot(radiation.cwiseAbs()) - areas.dot(inside.cwiseAbs());
  if (metrics.force_target_n > 0) {
    metrics.loudest_elsewhere = largest_outside(target, radiation) * areas.sum() / metrics.force_target_n;
  }
  return metrics;
}

Metrics metrics_of(const TriangleMesh& mesh, const Wave& wave, const std::vector<TargetBox>& boxes,
                   const Target& target, const Eigen::VectorXcd& pressure) {
  return metrics_of(mesh, boxes, target, pressure, radiation_pressure(SurfaceGradient(mesh, wave.k()), wave, pressure));
}

Metrics metrics_of(const TriangleMesh& mesh, const Eigen::VectorXcd& pressure, const Eigen::VectorXd& radiation) {
  Metrics metrics;
  metrics.peak_pa = pressure.cwiseAbs().maxCoeff();
  metrics.force_elsewhere_n = mesh.areas().dot(radiation);
  metrics.abs_force_elsewhere_n = mesh.areas().dot(radiation.cwiseAbs());
  return metrics;
}

double sound_level(double amplitude) {
  constexpr double kReference = 20e-6;  // [Pa], rms
  return 20.0 * std::log10(amplitude / (std::numbers::sqrt2 * kReference));
}

std::vector<ExposureLimit> exposure_limits(double frequency) {
  const double band = std::round(10.0 * std::log10(frequency));
  std::vector<ExposureLimit> limits;
  for (const LimitRow& row : kLimits) {
    if (band >= row.first && band <= row.last) {
      limits.push_back(row.limit);
    }
  }
  return limits;
}

}  // namespace touchfield
