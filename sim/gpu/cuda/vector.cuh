#pragma once

#include <cmath>
#include <cuda_runtime.h>

namespace touchfield::cuda {

inline constexpr double kPi = 3.14159265358979323846;

/// A place or direction in double; three numbers in memory, as columns of 3 x N matrices are.
struct Vector {
  double x, y, z;
};

/// Rounded one by one, never fused: what the CPU, without fused products, decides by a comparison is decided alike.
#ifdef __CUDA_ARCH__
__device__ inline double rounded_product(double a, double b) { return __dmul_rn(a, b); }
__device__ inline double rounded_sum(double a, double b) { return __dadd_rn(a, b); }
#else
__host__ __device__ inline double rounded_product(double a, double b) { return a * b; }
__host__ __device__ inline double rounded_sum(double a, double b) { return a + b; }
#endif

__host__ __device__ inline Vector operator+(const Vector& a, const Vector& b) {
  return {a.x + b.x, a.y + b.y, a.z + b.z};
}
__host__ __device__ inline Vector operator-(const Vector& a, const Vector& b) {
  return {a.x - b.x, a.y - b.y, a.z - b.z};
}
__host__ __device__ inline Vector operator*(double s, const Vector& a) { return {s * a.x, s * a.y, s * a.z}; }
__host__ __device__ inline Vector operator/(const Vector& a, double s) { return {a.x / s, a.y / s, a.z / s}; }
__host__ __device__ inline double dot(const Vector& a, const Vector& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

/// Without fused products, as the geometry of faces and distances needs them.
__host__ __device__ inline Vector cross(const Vector& a, const Vector& b) {
  return {rounded_sum(rounded_product(a.y, b.z), -rounded_product(a.z, b.y)),
          rounded_sum(rounded_product(a.z, b.x), -rounded_product(a.x, b.z)),
          rounded_sum(rounded_product(a.x, b.y), -rounded_product(a.y, b.x))};
}
__host__ __device__ inline double squared_norm(const Vector& a) {
  return rounded_sum(rounded_sum(rounded_product(a.x, a.x), rounded_product(a.y, a.y)), rounded_product(a.z, a.z));
}
__host__ __device__ inline double norm(const Vector& a) { return std::sqrt(squared_norm(a)); }

}  // namespace touchfield::cuda
