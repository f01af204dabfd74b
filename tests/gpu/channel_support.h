#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include "sim/acoustics/incident_field.h"
#include "sim/gpu/cuda/sources.cuh"

namespace touchfield {

/// Arrays of every kind, and how the card is told of them.
struct GpuChannelCase {
  std::string name;
  TransducerArray array;
  Wave wave;
};

inline std::vector<GpuChannelCase> gpu_channel_cases() {
  const Wave plain(air(293.15), 40e3);
  Medium damped_air = air(293.15);
  damped_air.absorption = 3.0;
  const Wave damped(damped_air, 40e3);
  const ArrayLayout layout = grid_layout(5, 4, kAutd3Pitch);
  const auto with = [&](const Directivity& directivity) {
    return make_array(layout, directivity, 1.0, kAutd3SourceStrength);
  };
  TransducerArray uneven = with(Directivity::t4010a1());
  uneven.response = random_response(uneven.size(), {.phase = 0.5, .gain = 0.1, .dead = 0.1}, 4);
  const TransducerArray flat = plane_wave(Vector3(0.6, 0.0, 0.8), 2.0);
  return {{"omni", with(Directivity::omni()), plain},
          {"spline", with(Directivity::t4010a1()), plain},
          {"spline damped", with(Directivity::t4010a1()), damped},
          {"piston", with(Directivity::piston(plain.k(), 4.5e-3)), plain},
          {"response", uneven, damped},
          {"plane", flat, plain},
          {"plane damped", flat, damped}};
}

inline cuda::ChannelWave gpu_channel_wave(const TransducerArray& array, const Wave& wave) {
  cuda::ChannelWave there;
  there.k = wave.wavenumber().real();
  there.alpha = wave.wavenumber().imag();
  there.plane_wave = array.kind == TransducerArray::Kind::kPlaneWave;
  if (array.directivity.kind() == Directivity::Kind::kPiston) {
    there.pattern = cuda::Pattern::kPiston;
    there.ka = array.directivity.ka();
  } else if (const double* spline = array.directivity.spline()) {
    there.pattern = cuda::Pattern::kSpline;
    there.intervals = Directivity::kIntervals;
    there.step = Directivity::kInterval;
    std::copy_n(spline, 4 * there.intervals, there.spline);
  }
  return there;
}

inline std::vector<cuda::Channel> gpu_channels(const TransducerArray& array) {
  std::vector<cuda::Channel> channels;
  const bool plain = array.response.as_designed();
  const Eigen::VectorXcd factor = plain ? Eigen::VectorXcd::Ones(array.size()) : factors(array.response);
  for (Eigen::Index n = 0; n < array.size(); ++n) {
    const Vector3 x = array.positions.col(n);
    const Vector3 a = array.axes.col(n);
    channels.push_back(
        {{x.x(), x.y(), x.z()}, {a.x(), a.y(), a.z()}, array.amplitudes(n), {factor(n).real(), factor(n).imag()}});
  }
  return channels;
}

}  // namespace touchfield
