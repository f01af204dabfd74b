#include "sim/acoustics/transducer_array.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <numbers>
#include <stdexcept>

#include "sim/core/random.h"
#include "sim/core/require.h"

namespace touchfield {

namespace {

constexpr int kNodes = 10;
// At 0, 10, ... 90 degrees. Source: the AUTD3 library's directivity of the T4010A1.
constexpr std::array<double, kNodes> kT4010a1 = {1.0,         1.0,         1.0,         0.891250938, 0.707945784,
                                                 0.501187234, 0.354813389, 0.251188643, 0.199526231, 0.177827941};

/// Second derivatives at equally spaced nodes of the natural cubic spline, by the Thomas algorithm.
std::array<double, kNodes> natural_spline_curvatures(const std::array<double, kNodes>& y, double step) {
  std::array<double, kNodes> m{};
  std::array<double, kNodes> c{};
  std::array<double, kNodes> d{};
  for (int i = 1; i < kNodes - 1; ++i) {
    const double pivot = 4.0 - c[i - 1];
    c[i] = 1.0 / pivot;
    d[i] = (6.0 * (y[i + 1] - 2.0 * y[i] + y[i - 1]) / (step * step) - d[i - 1]) / pivot;
  }
  for (int i = kNodes - 2; i >= 1; --i) {
    m[i] = d[i] - c[i] * m[i + 1];
  }
  return m;
}

/// POSIX's j1 and jn: ten times as fast as std::cyl_bessel_j.
double piston_value(double x) { return x < 1e-4 ? 1.0 - x * x / 8.0 : 2.0 * ::j1(x) / x; }

// An AUTD3 board. Source: the AUTD3 library's geometry.
constexpr int kAutd3CountX = 18;
constexpr int kAutd3CountY = 14;
constexpr double kAutd3BoardX = 192.0e-3;  // [m]
constexpr double kAutd3BoardY = 151.4e-3;  // [m]

void require_pitch(double pitch) {
  require(pitch > 0 && std::isfinite(pitch), "array: pitch = {} m must be > 0", pitch);
}

void require_counts(int count_x, int count_y) {
  require(count_x >= 1 && count_y >= 1, "array: counts = {} x {} must be >= 1", count_x, count_y);
}

ArrayLayout flat_layout(const Points& positions) {
  const Eigen::Index n = positions.cols();
  return {positions, Vector3::UnitZ().replicate(1, n), Eigen::VectorXi::Zero(n),
          Eigen::VectorXi::LinSpaced(n, 0, static_cast<int>(n) - 1)};
}

}  // namespace

Eigen::VectorXcd factors(const ChannelResponse& response) {
  Eigen::VectorXcd values(response.gain.size());
  for (Eigen::Index n = 0; n < values.size(); ++n) {
    values(n) = std::polar(response.gain(n), response.phase(n));
  }
  return values;
}

ChannelResponse product(const ChannelResponse& first, const ChannelResponse& second) {
  if (first.as_designed() || second.as_designed()) {
    return first.as_designed() ? second : first;
  }
  return {first.gain.cwiseProduct(second.gain), first.phase + second.phase};
}

ChannelResponse random_response(Eigen::Index channels, const ChannelTolerances& tolerances, unsigned seed) {
  ChannelResponse response{Eigen::VectorXd(channels), Eigen::VectorXd(channels)};
  NormalPairs random(seed);
  for (Eigen::Index n = 0; n < channels; ++n) {
    const NormalPairs::Polar normal = random.next();
    const bool dead = random.uniform() <= tolerances.dead;
    response.gain(n) = dead ? 0.0 : std::max(0.0, 1.0 + tolerances.gain * normal.first());
    response.phase(n) = tolerances.phase * normal.second();
  }
  return response;
}

Directivity::Directivity(Kind kind, double ka) : kind_(kind), ka_(ka) {
  if (kind_ != Kind::kT4010a1) {
    return;
  }
  const auto m = natural_spline_curvatures(kT4010a1, kInterval);
  for (int i = 0; i < kIntervals; ++i) {
    const double slope = (kT4010a1[i + 1] - kT4010a1[i]) / kInterval - kInterval * (2.0 * m[i] + m[i + 1]) / 6.0;
    spline_[i] = {kT4010a1[i], slope, 0.5 * m[i], (m[i + 1] - m[i]) / (6.0 * kInterval)};
  }
}

Directivity Directivity::omni() { return Directivity(Kind::kOmni); }

Directivity Directivity::piston(double k, double radius) {
  require(k > 0 && radius > 0, "piston: k = {} and radius = {} m must be > 0", k, radius);
  return Directivity(Kind::kPiston, k * radius);
}

Directivity Directivity::t4010a1() { return Directivity(Kind::kT4010a1); }

double Directivity::value(double cos_theta) const {
  if (kind_ == Kind::kOmni) {
    return 1.0;
  }
  const double cosine = std::clamp(cos_theta, -1.0, 1.0);
  // Without the slope and the angle a piston takes a third of the time.
  return kind_ == Kind::kPiston ? piston_value(ka_ * std::sqrt(1.0 - cosine * cosine)) : at(std::acos(cosine)).value;
}

DirectivityValue Directivity::at(double theta) const {
  switch (kind_) {
    case Kind::kOmni:
      return {1.0, 0.0};
    case Kind::kPiston: {
      const double x = ka_ * std::sin(theta);
      if (x < 1e-4) {  // the series' next terms are below 1e-17 and 1e-13
        return {piston_value(x), -0.25 * x * ka_ * std::cos(theta)};
      }
      return {piston_value(x), -2.0 * ::jn(2, x) / x * ka_ * std::cos(theta)};
    }
    case Kind::kT4010a1: {
      const bool mirrored = theta > 0.5 * std::numbers::pi;
      const double angle = mirrored ? std::numbers::pi - theta : theta;
      const int i = std::clamp(static_cast<int>(angle / kInterval), 0, kIntervals - 1);
      const double t = angle - i * kInterval;
      const auto& c = spline_[static_cast<std::size_t>(i)];
      const double slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]);
      return {c[0] + t * (c[1] + t * (c[2] + t * c[3])), mirrored ? -slope : slope};
    }
  }
  return {1.0, 0.0};
}

ArrayLayout grid_layout(int count_x, int count_y, double pitch) {
  require_counts(count_x, count_y);
  require_pitch(pitch);
  Points positions(3, static_cast<Eigen::Index>(count_x) * count_y);
  Eigen::Index n = 0;
  for (int y = 0; y < count_y; ++y) {
    for (int x = 0; x < count_x; ++x) {
      positions.col(n++) = pitch * Vector3(x - 0.5 * (count_x - 1), y - 0.5 * (count_y - 1), 0.0);
    }
  }
  return flat_layout(positions);
}

ArrayLayout autd3_unit(double pitch) {
  require_pitch(pitch);
  Points positions(3, kAutd3CountX * kAutd3CountY);
  Eigen::Index n = 0;
  for (int y = 0; y < kAutd3CountY; ++y) {
    for (int x = 0; x < kAutd3CountX; ++x) {
      if (y != 1 || (x != 1 && x != 2 && x != 16)) {  // the holes
        positions.col(n++) = pitch * Vector3(x, y, 0.0);
      }
    }
  }
  return flat_layout(positions.leftCols(n));
}

ArrayLayout autd3_tiles(int count_x, int count_y, double pitch) {
  require_counts(count_x, count_y);
  const ArrayLayout unit = autd3_unit(pitch);
  // The transducer grid sits in the middle of its board.
  const Vector3 grid_centre(0.5 * pitch * (kAutd3CountX - 1), 0.5 * pitch * (kAutd3CountY - 1), 0.0);
  std::vector<ArrayLayout> units;
  for (int y = 0; y < count_y; ++y) {
    for (int x = 0; x < count_x; ++x) {
      const Vector3 board_centre(kAutd3BoardX * (x - 0.5 * (count_x - 1)), kAutd3BoardY * (y - 0.5 * (count_y - 1)),
                                 0.0);
      units.push_back(transformed(unit, Eigen::Matrix3d::Identity(), board_centre - grid_centre));
    }
  }
  return joined(units);
}

ArrayLayout sonicsurface_layout() { return grid_layout(16, 16, 10.5e-3); }

ArrayLayout transformed(const ArrayLayout& layout, const Eigen::Matrix3d& rotation, const Vector3& translation) {
  return {(rotation * layout.positions).colwise() + translation, rotation * layout.axes, layout.device, layout.channel};
}

ArrayLayout joined(const std::vector<ArrayLayout>& layouts) {
  Eigen::Index total = 0;
  for (const ArrayLayout& layout : layouts) {
    total += layout.positions.cols();
  }
  ArrayLayout all{Points(3, total), Points(3, total), Eigen::VectorXi(total), Eigen::VectorXi(total)};
  Eigen::Index at = 0;
  int next_device = 0;
  for (const ArrayLayout& layout : layouts) {
    const Eigen::Index n = layout.positions.cols();
    all.positions.middleCols(at, n) = layout.positions;
    all.axes.middleCols(at, n) = layout.axes;
    all.device.segment(at, n) = layout.device.array() + next_device;
    all.channel.segment(at, n) = layout.channel;
    next_device += n > 0 ? layout.device.maxCoeff() + 1 : 0;
    at += n;
  }
  return all;
}

TransducerArray make_array(const ArrayLayout& layout, const Directivity& directivity, double level,
                           double source_strength) {
  require(layout.positions.cols() != 0, "array: it has no transducer");
  require(level > 0 && level <= 1, "array.level = {} must be > 0 and <= 1", level);
  require(source_strength > 0 && std::isfinite(source_strength), "array.source_pa_m = {} must be > 0", source_strength);
  for (Eigen::Index n = 0; n < layout.axes.cols(); ++n) {
    const double length = layout.axes.col(n).norm();
    require(std::abs(length - 1.0) < 1e-9, "array: the axis of transducer {} has length {}, it must be 1", n, length);
  }
  return {TransducerArray::Kind::kTransducers,
          layout.positions,
          layout.axes,
          Eigen::VectorXd::Constant(layout.positions.cols(), level * source_strength),
          directivity,
          layout.device,
          layout.channel};
}

TransducerArray moved(const TransducerArray& array, const RigidMotion& motion) {
  if (array.kind != TransducerArray::Kind::kTransducers) {
    throw std::logic_error("a plane wave cannot be moved");
  }
  TransducerArray result = array;
  result.positions = motion(array.positions);
  result.axes = motion.rotation * array.axes;
  return result;
}

TransducerArray plane_wave(const Vector3& direction, double amplitude) {
  require(std::abs(direction.norm() - 1.0) < 1e-9, "plane_wave: its direction has length {}, it must be 1",
          direction.norm());
  require(amplitude > 0 && std::isfinite(amplitude), "plane_wave.amplitude_pa = {} must be > 0", amplitude);
  return {TransducerArray::Kind::kPlaneWave,
          Points::Zero(3, 1),
          direction,
          Eigen::VectorXd::Constant(1, amplitude),
          Directivity::omni(),
          Eigen::VectorXi::Zero(1),
          Eigen::VectorXi::Zero(1)};
}

}  // namespace touchfield
