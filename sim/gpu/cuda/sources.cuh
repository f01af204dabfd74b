#pragma once

#include "sim/gpu/cuda/context.cuh"
#include "sim/gpu/cuda/vector.cuh"

namespace touchfield::cuda {

/// The field of one channel at unit drive, by the formulas of sim/acoustics/incident_field.h.

enum class Pattern { kOmni, kPiston, kSpline };

/// What all channels share.
struct ChannelWave {
  static constexpr int kMostIntervals = 16;

  double k = 0.0, alpha = 0.0;  // k + i alpha [1/m]
  bool plane_wave = false;      // else transducers
  Pattern pattern = Pattern::kOmni;
  double ka = 0.0;                         // of kPiston: k times its radius
  int intervals = 0;                       // of kSpline
  double step = 0.0;                       // [rad], width of an interval; mirrored past intervals * step = pi/2
  double spline[4 * kMostIntervals] = {};  // four coefficients of powers of t an interval
};

struct Channel {
  Vector place, axis;
  double amplitude;
  double2 response;
};

/// Directivity at an angle of 0..pi, and its slope [1/rad].
__host__ __device__ inline double2 directivity(const ChannelWave& wave, double theta) {
  if (wave.pattern == Pattern::kPiston) {
    const double x = wave.ka * std::sin(theta);
    const double x_slope = wave.ka * std::cos(theta);
    if (x < 1e-4) {
      return {1.0 - x * x / 8.0, -0.25 * x * x_slope};
    }
    return {2.0 * ::j1(x) / x, -2.0 * ::jn(2, x) / x * x_slope};
  }
  if (wave.pattern == Pattern::kSpline) {
    const bool mirrored = theta > 0.5 * kPi;
    const double angle = mirrored ? kPi - theta : theta;
    const int interval = static_cast<int>(angle / wave.step);
    const int i = interval < wave.intervals ? interval : wave.intervals - 1;
    const double t = angle - i * wave.step;
    const double* c = wave.spline + 4 * i;
    const double slope = c[1] + t * (2.0 * c[2] + t * 3.0 * c[3]);
    return {c[0] + t * (c[1] + t * (c[2] + t * c[3])), mirrored ? -slope : slope};
  }
  return {1.0, 0.0};
}

/// Pressure at x [Pa], or its derivative along a unit vector [Pa/m].
template <bool kSlope>
__host__ __device__ inline double2 channel_value(const ChannelWave& wave, const Channel& channel, const Vector& x,
                                                 const Vector& direction) {
  double travelled;
  double strength;
  double re = 1.0;  // what the wave is multiplied by
  double im = 0.0;
  if (wave.plane_wave) {
    travelled = dot(channel.axis, x);
    strength = channel.amplitude;
    if constexpr (kSlope) {
      const double along = dot(channel.axis, direction);
      re = -wave.alpha * along;
      im = wave.k * along;
    }
  } else {
    const Vector offset = x - channel.place;
    const double r = norm(offset);
    travelled = r;
    strength = channel.amplitude / r;
    double across = 0.0;  // r sin(theta)
    double ahead = r;     // r cos(theta)
    double2 d{1.0, 0.0};
    if (wave.pattern != Pattern::kOmni) {
      across = norm(cross(channel.axis, offset));
      ahead = dot(channel.axis, offset);
      d = directivity(wave, std::atan2(across, ahead));
    }
    re = d.x;
    if constexpr (kSlope) {
      const double radial = dot(offset, direction) / r;
      // grad theta; on the axis its mean over all sides is 0
      const double turned = across > 1e-12 * r ? (ahead / r * radial - dot(channel.axis, direction)) / across : 0.0;
      re = d.y * turned - (wave.alpha + 1.0 / r) * radial * d.x;
      im = wave.k * radial * d.x;
    }
  }
  const double size = strength * std::exp(-wave.alpha * travelled);
  double sine;
  double cosine;
  ::sincos(wave.k * travelled, &sine, &cosine);
  const double value_re = size * (re * cosine - im * sine);
  const double value_im = size * (re * sine + im * cosine);
  const double2 c = channel.response;
  return {c.x * value_re - c.y * value_im, c.x * value_im + c.y * value_re};
}

/// The channels of a TransducerArray on the card.
class Sources {
 public:
  /// In a medium with wavenumber k + i alpha [1/m]; of a plane wave positions are not read and may be null.
  ///
  /// throws   std::invalid_argument on a directivity with too many intervals
  Sources(Context& context, double k, double alpha, const GpuSources& given);

  int size() const { return static_cast<int>(channel_.size()); }  // N

  /// The incident matrix G, as incident_matrix has it, or with directions (3 x J unit vectors; else null) dG along
  /// them; computed in double.
  ///
  /// points   3 x J [m], on the card, none on a transducer
  /// out      J x N cuComplex or cuDoubleComplex on the card
  template <typename Out>
  void incident(const double* points, const double* directions, int count, Out* out) const;

 private:
  Context& context_;
  ChannelWave wave_;
  Array<Channel> channel_{context_};
};

}  // namespace touchfield::cuda
