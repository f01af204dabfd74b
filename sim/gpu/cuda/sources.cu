#include "sim/gpu/cuda/sources.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;
constexpr int kChannels = 8;  // a block

template <bool kSlope, typename Out>
__global__ void __launch_bounds__(kThreads)
    fill_incident(ChannelWave wave, const Channel* channels, int channel_count, const Vector* points,
                  const Vector* directions, int count, Out* out) {
  __shared__ Channel shared[kChannels];
  const int begin = static_cast<int>(blockIdx.y) * kChannels;
  const int taken = min(kChannels, channel_count - begin);
  if (static_cast<int>(threadIdx.x) < taken) {
    shared[threadIdx.x] = channels[begin + static_cast<int>(threadIdx.x)];
  }
  __syncthreads();
  const int j = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (j >= count) {
    return;
  }
  const Vector x = points[j];
  Vector direction{0.0, 0.0, 0.0};
  if constexpr (kSlope) {
    direction = directions[j];
  }
  for (int n = 0; n < taken; ++n) {
    const double2 value = channel_value<kSlope>(wave, shared[n], x, direction);
    out[static_cast<std::size_t>(begin + n) * static_cast<std::size_t>(count) + static_cast<std::size_t>(j)] = {
        static_cast<decltype(out->x)>(value.x), static_cast<decltype(out->x)>(value.y)};
  }
}

template <typename Out>
void fill(Context& context, const ChannelWave& wave, const Array<Channel>& channels, const double* points,
          const double* directions, int count, Out* out) {
  if (count == 0 || channels.size() == 0) {
    return;
  }
  const dim3 blocks(blocks_for(static_cast<std::size_t>(count), kThreads), blocks_for(channels.size(), kChannels));
  const auto kernel = directions != nullptr ? fill_incident<true, Out> : fill_incident<false, Out>;
  kernel<<<blocks, kThreads, 0, context.stream()>>>(wave, channels.data(), static_cast<int>(channels.size()),
                                                    reinterpret_cast<const Vector*>(points),
                                                    reinterpret_cast<const Vector*>(directions), count, out);
  context.launched("incident field");
}

}  // namespace

Sources::Sources(Context& context, const ChannelWave& wave, int count, const double* positions, const double* axes,
                 const double* amplitudes, const std::complex<double>* response)
    : context_(context), wave_(wave), count_(count), channel_(context) {
  std::vector<Channel> channels(static_cast<std::size_t>(count));
  for (int n = 0; n < count; ++n) {
    Channel& channel = channels[static_cast<std::size_t>(n)];
    const int at = 3 * n;
    if (positions != nullptr) {
      channel.place = {positions[at], positions[at + 1], positions[at + 2]};
    }
    channel.axis = {axes[at], axes[at + 1], axes[at + 2]};
    channel.amplitude = amplitudes[n];
    channel.response = {1.0, 0.0};
    if (response != nullptr) {
      channel.response = {response[n].real(), response[n].imag()};
    }
  }
  channel_.upload(channels);
}

void Sources::incident(const double* points, const double* directions, int count, cuComplex* out) const {
  fill(context_, wave_, channel_, points, directions, count, out);
}

void Sources::incident(const double* points, const double* directions, int count, cuDoubleComplex* out) const {
  fill(context_, wave_, channel_, points, directions, count, out);
}

}  // namespace touchfield::cuda
