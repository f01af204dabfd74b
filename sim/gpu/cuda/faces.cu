#include <algorithm>

#include "sim/gpu/cuda/faces.cuh"
#include "sim/gpu/cuda/launch.cuh"

namespace touchfield::cuda {

namespace {

constexpr unsigned kThreads = 128;

__global__ void make_faces(FaceView faces, Vector centre, double scale) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f >= faces.count) {
    return;
  }
  const int3 t = faces.triangle[f];
  const FaceGeometry face = face_geometry(faces.vertex[t.x], faces.vertex[t.y], faces.vertex[t.z]);
  const Vector& n = face.normal;
  faces.centroid[f] = face.centroid;
  faces.normal[f] = n;
  faces.area[f] = face.area;
  faces.place[f] = scale * (face.centroid - centre);
  faces.plain_normal[f] = {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)};
  faces.weight[f] = static_cast<float>(face.area * scale * scale / (4.0 * kPi));
}

}  // namespace

Faces::Faces(Context& context, const int* triangles, int faces, const double* vertices, int vertex_count,
             const SurfaceWave& wave)
    : context_(context), wave_(wave), vertex_(context, vertex_count) {
  triangle_.upload(reinterpret_cast<const int3*>(triangles), faces);
  for (Array<Vector>* values : {&centroid_, &normal_, &place_}) {
    values->resize(faces);
  }
  area_.resize(faces);
  plain_normal_.resize(faces);
  weight_.resize(faces);
  view_ = {faces,        triangle_.data(), vertex_.data(),       centroid_.data(), normal_.data(),
           area_.data(), place_.data(),    plain_normal_.data(), weight_.data()};
  move(vertices);
}

void Faces::move(const double* vertices) {
  const auto* places = reinterpret_cast<const Vector*>(vertices);
  vertex_.upload(places, vertex_.size());
  Vector least = places[0];
  Vector most = places[0];
  for (std::size_t v = 1; v < vertex_.size(); ++v) {
    least = {std::min(least.x, places[v].x), std::min(least.y, places[v].y), std::min(least.z, places[v].z)};
    most = {std::max(most.x, places[v].x), std::max(most.y, places[v].y), std::max(most.z, places[v].z)};
  }
  launch(context_, "faces", make_faces, blocks_for(view_.count, kThreads), kThreads, view_, 0.5 * (least + most),
         wave_.scale());
}

}  // namespace touchfield::cuda
