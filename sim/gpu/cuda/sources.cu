#include <algorithm>
#include <stdexcept>

#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/sources.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;

/// Points of blockIdx.y for channel blockIdx.x.
template <bool kSlope, typename Out>
__global__ void __launch_bounds__(kThreads)
    fill_incident(ChannelWave wave, const Channel* channels, const Vector* points, const Vector* directions, int count,
                  Out* out) {
  const int j = static_cast<int>(blockIdx.y * blockDim.x + threadIdx.x);
  if (j < count) {
    const Vector direction = kSlope ? directions[j] : Vector{0.0, 0.0, 0.0};
    const double2 value = channel_value<kSlope>(wave, channels[blockIdx.x], points[j], direction);
    out[std::size_t{1} * blockIdx.x * count + j] = {static_cast<decltype(out->x)>(value.x),
                                                    static_cast<decltype(out->x)>(value.y)};
  }
}

ChannelWave channel_wave(double k, double alpha, const GpuSources& given) {
  ChannelWave wave;
  wave.k = k;
  wave.alpha = alpha;
  wave.plane_wave = given.plane_wave;
  if (given.spline != nullptr) {
    if (given.intervals > ChannelWave::kMostIntervals) {
      throw std::invalid_argument("a directivity with too many intervals");
    }
    wave.pattern = Pattern::kSpline;
    wave.intervals = given.intervals;
    wave.step = given.interval;
    std::copy_n(given.spline, 4 * given.intervals, wave.spline);
  } else if (given.piston_ka > 0) {
    wave.pattern = Pattern::kPiston;
    wave.ka = given.piston_ka;
  }
  return wave;
}

}  // namespace

Sources::Sources(Context& context, double k, double alpha, const GpuSources& given)
    : context_(context), wave_(channel_wave(k, alpha, given)) {
  const auto vector = [](const double* values, int n) {
    return values != nullptr ? Vector{values[3 * n], values[3 * n + 1], values[3 * n + 2]} : Vector{};
  };
  std::vector<Channel> channels(given.count);
  for (int n = 0; n < given.count; ++n) {
    const std::complex<double> factor = given.response != nullptr ? given.response[n] : 1.0;
    channels[n] = {
        vector(given.positions, n), vector(given.axes, n), given.amplitudes[n], {factor.real(), factor.imag()}};
  }
  channel_.upload(channels);
}

template <typename Out>
void Sources::incident(const double* points, const double* directions, int count, Out* out) const {
  launch(context_, "incident field", directions != nullptr ? fill_incident<true, Out> : fill_incident<false, Out>,
         dim3(size(), blocks_for(count, kThreads)), kThreads, wave_, channel_.data(),
         reinterpret_cast<const Vector*>(points), reinterpret_cast<const Vector*>(directions), count, out);
}
template void Sources::incident(const double*, const double*, int, cuComplex*) const;
template void Sources::incident(const double*, const double*, int, cuDoubleComplex*) const;

}  // namespace touchfield::cuda
