#include <algorithm>
#include <stdexcept>

#include "sim/gpu/cuda/faces.cuh"
#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/products.cuh"
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

constexpr std::size_t kFewestRows = 256;  // points at a time
constexpr std::size_t kMostRows = std::size_t{1} << 20U;
constexpr std::size_t kMostPanelBytes = std::size_t{4} << 30U;

/// A column a point: what each face makes there of its pressure, of near ones 0. The others' winding, and how many are
/// near. A warp for each point.
template <bool kDamped>
__global__ void fill_far(PairConstants<float> constants, FaceView faces, double scale, double far2,
                         const Vector* points, int count, cuDoubleComplex* panel, double* winding, int* near) {
  // In the processor's units and by its operations: a face that both sum, or neither, would be an error of its size.
  const auto scaled = [scale](const Vector& v) {
    return Vector{rounded_product(scale, v.x), rounded_product(scale, v.y), rounded_product(scale, v.z)};
  };
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int j = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  if (j >= count) {  // the whole warp
    return;
  }
  const Vector at = scaled(points[j]);
  double wound = 0.0;
  double found = 0.0;
  for (int f = lane; f < faces.count; f += kWarp) {
    const Vector difference = at - scaled(faces.centroid[f]);
    const double area = rounded_product(rounded_product(faces.area[f], scale), scale);
    const bool is_near = squared_norm(difference) < rounded_product(far2, area);
    const float weight = is_near ? 0.0F : faces.weight[f];
    const float3 n = faces.plain_normal[f];
    const PairDistance<float> d = pair_distance<float>(difference);
    float re;
    float im;
    pair_kernel<Layer::kDouble, kDamped>(constants, d, n, n, re, im);
    panel[f + std::size_t{1} * j * faces.count] = {weight * re, weight * im};
    const float nd = n.x * d.dx + n.y * d.dy + n.z * d.dz;
    wound += weight * nd * d.reciprocal * d.reciprocal * d.reciprocal;
    found += is_near ? 1.0 : 0.0;
  }
  wound = lane_sum<kWarp>(wound);
  found = lane_sum<kWarp>(found);
  if (lane == 0) {
    winding[j] = wound;
    near[j] = static_cast<int>(found);
  }
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

void Context::field(const GpuBodySpec& body, const GpuSources& given, const GpuField& field) {
  use();
  const SurfaceWave wave{body.k, body.alpha, 0.0};
  const Faces faces(*this, body.triangles, body.faces, body.vertices, body.vertex_count, wave);
  const Sources sources(*this, body.k, body.alpha, given);
  const std::size_t columns = field.columns;
  Array<cuDoubleComplex> drives(*this), surface(*this);
  drives.upload(reinterpret_cast<const cuDoubleComplex*>(field.drives), sources.size() * columns);
  surface.upload(reinterpret_cast<const cuDoubleComplex*>(field.surface), faces.size() * columns);

  const std::size_t width = std::max(sources.size(), faces.size());
  const std::size_t bytes = sizeof(Vector) + sizeof(double) + sizeof(int) + sizeof(cuDoubleComplex) * (width + columns);
  const std::size_t fit = std::min(kMostPanelBytes, (allowed_ - taken_) / 2) / bytes;
  const int most = std::min(field.count, static_cast<int>(std::clamp(fit, kFewestRows, kMostRows)));
  Array<cuDoubleComplex> panel(*this, most * width), pressure(*this, most * columns);
  Array<Vector> points(*this, most);
  Array<double> winding(*this, most);
  Array<int> near(*this, most);
  for (int first = 0, count = 0; first < field.count; first += count) {
    count = std::min(most, field.count - first);
    points.upload(reinterpret_cast<const Vector*>(field.points) + first, count);
    sources.incident(&points.data()->x, nullptr, count, panel.data());
    multiply(*this, CUBLAS_OP_N, CUBLAS_OP_N, count, field.columns, sources.size(), {1.0, 0.0}, panel.data(), count,
             drives.data(), sources.size(), {0.0, 0.0}, pressure.data(), count);
    launch(*this, "field", body.alpha != 0.0 ? fill_far<true> : fill_far<false>,
           blocks_for(std::size_t{1} * count * kWarp, kThreads), kThreads, wave.constants<float>(), faces.view(),
           wave.scale(), field.far_distance * field.far_distance, points.data(), count, panel.data(), winding.data(),
           near.data());
    multiply(*this, CUBLAS_OP_T, CUBLAS_OP_N, count, field.columns, faces.size(), {1.0, 0.0}, panel.data(),
             faces.size(), surface.data(), faces.size(), {1.0, 0.0}, pressure.data(), count);
    constexpr std::size_t kValue = sizeof(cuDoubleComplex);
    check(cudaMemcpy2DAsync(field.pressure + first, kValue * field.count, pressure.data(), kValue * count,
                            kValue * count, columns, cudaMemcpyDeviceToHost, stream_),
          "download");
    winding.download(field.winding + first, count);
    near.download(field.near + first, count);
  }
}

}  // namespace touchfield::cuda
