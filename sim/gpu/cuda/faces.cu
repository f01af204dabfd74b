#include <algorithm>

#include "sim/gpu/cuda/faces.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 128;

struct FaceOutput {
  Vector *centroid, *normal, *place;
  double* area;
  float3 *single_place, *single_normal;
  float* weight;
};

__host__ __device__ inline float3 single(const Vector& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}

__global__ void make_faces(const int3* triangle, const Vector* vertex, int count, Vector centre, double scale,
                           FaceOutput out) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f >= count) {
    return;
  }
  const int3 t = triangle[f];
  const FaceGeometry face = face_geometry(vertex[t.x], vertex[t.y], vertex[t.z]);
  const Vector place = scale * (face.centroid - centre);
  out.centroid[f] = face.centroid;
  out.normal[f] = face.normal;
  out.place[f] = place;
  out.area[f] = face.area;
  out.single_place[f] = single(place);
  out.single_normal[f] = single(face.normal);
  out.weight[f] = static_cast<float>(face.area * scale * scale / (4.0 * kPi));
}

}  // namespace

Faces::Faces(Context& context, const int* triangles, int faces, const double* vertices, int vertex_count,
             const SurfaceWave& wave)
    : context_(context),
      count_(faces),
      vertex_count_(vertex_count),
      wave_(wave),
      triangle_(context),
      vertex_(context),
      centroid_(context),
      normal_(context),
      place_(context),
      area_(context),
      single_place_(context),
      single_normal_(context),
      weight_(context) {
  const auto size = static_cast<std::size_t>(faces);
  triangle_.upload(reinterpret_cast<const int3*>(triangles), size);
  for (Array<Vector>* values : {&centroid_, &normal_, &place_}) {
    values->resize(size);
  }
  area_.resize(size);
  single_place_.resize(size);
  single_normal_.resize(size);
  weight_.resize(size);
  move(vertices);
}

void Faces::move(const double* vertices) {
  const auto* places = reinterpret_cast<const Vector*>(vertices);
  vertex_.upload(places, static_cast<std::size_t>(vertex_count_));
  Vector least = places[0];
  Vector most = places[0];
  for (int v = 1; v < vertex_count_; ++v) {
    least = {std::min(least.x, places[v].x), std::min(least.y, places[v].y), std::min(least.z, places[v].z)};
    most = {std::max(most.x, places[v].x), std::max(most.y, places[v].y), std::max(most.z, places[v].z)};
  }
  centre_ = 0.5 * (least + most);
  make_faces<<<blocks_for(static_cast<std::size_t>(count_), kThreads), kThreads, 0, context_.stream()>>>(
      triangle_.data(), vertex_.data(), count_, centre_, wave_.scale(),
      {centroid_.data(), normal_.data(), place_.data(), area_.data(), single_place_.data(), single_normal_.data(),
       weight_.data()});
  context_.launched("faces");
}

template <>
PairView<float3> Faces::pairs() const {
  return {single_place_.data(), single_normal_.data(), weight_.data(), count_};
}

template <>
PairView<Vector> Faces::pairs() const {
  return {place_.data(), single_normal_.data(), weight_.data(), count_};
}

}  // namespace touchfield::cuda
