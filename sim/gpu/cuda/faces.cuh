#pragma once

#include "sim/gpu/cuda/context.cuh"
#include "sim/gpu/cuda/face_integral.cuh"

namespace touchfield::cuda {

/// A surface's faces as kernels see them: in metres, and as the sums over them need them, in half wavelengths from a
/// centre.
struct FaceView {
  int count;
  const int3* triangle;
  const Vector* vertex;
  Vector *centroid, *normal;
  double* area;
  Vector* place;         // centroids in half wavelengths
  float3* plain_normal;  // in single precision
  float* weight;         // area / 4 pi in half wavelengths

  __device__ Triangle face(int f) const {
    const int3 t = triangle[f];
    return {vertex[t.x], vertex[t.y], vertex[t.z], normal[f], area[f]};
  }
};

/// A triangulated surface on the card, with what the sums over its faces need. As TriangleMesh: closed, normals
/// outwards, no face without area, which is not checked here.
class Faces {
 public:
  /// triangles   3 x M indices of vertices
  /// vertices    3 x V [m]
  Faces(Context& context, const int* triangles, int faces, const double* vertices, int vertex_count,
        const SurfaceWave& wave);

  /// The same triangles with their vertices elsewhere.
  void move(const double* vertices);

  Context& context() const { return context_; }
  int size() const { return view_.count; }  // M
  const SurfaceWave& wave() const { return wave_; }
  const FaceView& view() const { return view_; }

  /// On the card: 3 x M centroids [m] and unit normals.
  const double* centroids() const { return &view_.centroid->x; }
  const double* normals() const { return &view_.normal->x; }

 private:
  Context& context_;
  SurfaceWave wave_;
  Array<int3> triangle_{context_};
  Array<Vector> vertex_{context_}, centroid_{context_}, normal_{context_}, place_{context_};
  Array<double> area_{context_};
  Array<float3> plain_normal_{context_};
  Array<float> weight_{context_};
  FaceView view_{};
};

}  // namespace touchfield::cuda
