#pragma once

#include "sim/gpu/cuda/context.cuh"
#include "sim/gpu/cuda/face_integral.cuh"

namespace touchfield::cuda {

/// How the difference of two points is formed: from places in single precision, as LayerSum<float> does (the phase is
/// off by 1e-7 k R, R the body's radius; near points by as much), or in double (1e-7 wherever they lie; half as fast on
/// cards with many units for double, slow on others).
enum class Differences { kSingle, kDouble };

/// Points with normals and, of sources, weights, for sums over pairs, in half wavelengths from a centre. Place is float3,
/// or Vector for differences in double.
template <typename Place>
struct PairView {
  const Place* place;
  const float3* normal;  // null: none, of layers that read none at the point
  const float* weight;   // area / 4 pi; null: none
  int count;
};

/// A surface's faces as kernels read them [m].
struct FaceView {
  const int3* triangle;
  const Vector* vertex;
  const Vector* centroid;
  const Vector* normal;
  const double* area;
  int count;

  __device__ Triangle face(int f) const {
    const int3 t = triangle[f];
    return {vertex[t.x], vertex[t.y], vertex[t.z], normal[f], area[f]};
  }
};

/// A triangulated surface on the card, with what the sums over its faces need. As TriangleMesh: closed, normals outwards,
/// no face without area, which is not checked here.
class Faces {
 public:
  /// triangles   3 x M indices of vertices
  /// vertices    3 x V [m]
  Faces(Context& context, const int* triangles, int faces, const double* vertices, int vertex_count,
        const SurfaceWave& wave);

  /// The same triangles with their vertices elsewhere.
  void move(const double* vertices);

  Context& context() const { return context_; }
  int size() const { return count_; }  // M
  const SurfaceWave& wave() const { return wave_; }
  const Vector& centre() const { return centre_; }  // [m]

  /// On the card: 3 x M centroids [m] and unit normals, M areas [m2], M weights A / 4 pi in half wavelengths.
  const double* centroids() const { return &centroid_.data()->x; }
  const double* normals() const { return &normal_.data()->x; }
  const double* areas() const { return area_.data(); }
  const float* weights() const { return weight_.data(); }

  FaceView view() const {
    return {triangle_.data(), vertex_.data(), centroid_.data(), normal_.data(), area_.data(), count_};
  }
  template <typename Place>
  PairView<Place> pairs() const;

 private:
  Context& context_;
  int count_;
  int vertex_count_;
  SurfaceWave wave_;
  Vector centre_{};
  Array<int3> triangle_;
  Array<Vector> vertex_, centroid_, normal_, place_;
  Array<double> area_;
  Array<float3> single_place_, single_normal_;
  Array<float> weight_;
};

template <>
PairView<float3> Faces::pairs() const;
template <>
PairView<Vector> Faces::pairs() const;

}  // namespace touchfield::cuda
