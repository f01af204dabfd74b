#pragma once

#include <cufft.h>

#include "sim/gpu/cuda/faces.cuh"

namespace touchfield::cuda {

/// cuFFT's transform of a grid in place, z side by side, and the room that it works in.
class GridTransform {
 public:
  explicit GridTransform(Context& context) : work_(context) {}
  GridTransform(const GridTransform&) = delete;
  GridTransform& operator=(const GridTransform&) = delete;
  ~GridTransform();

  void make(Context& context, int3 period);
  void run(cuComplex* grid, int direction);

 private:
  bool is_made_ = false;
  cufftHandle plan_{};
  Array<char> work_;
};

inline constexpr int kGridTile = 8;  // points of a tile of the grid along each axis

/// A face at its place in the order of cells.
struct GridFace {
  float3 place;  // from the middle of its cell, in units of the reach
  float3 normal;
  int3 cell;
  int3 first;  // point of the grid that its window reaches
};

/// What kernels see of the faces in the order of cells, and of the grid.
struct GridSumView {
  int count;            // M
  int width;            // of the window
  int3 points, period;  // of the grid
  const GridFace* face;
  const int* number;    // of the face at each place
  const float* weight;  // at each place, for each axis: weights of the window, then their slopes along the normal
  cuComplex* grid;
};

/// The sums of sum_kernels() (boundary.cuh) through a grid, as touchfield::GridSum makes them (sim/bem/grid_sum.h): the
/// local part of the kernel over faces within reach, cell by cell; its smooth part spread onto the grid tile by tile,
/// transformed by cuFFT, and read. Sums are in single precision and in an order that depends on the places alone.
///
/// accuracy   that of the grid
class GridSums {
 public:
  /// faces   outlive this; where they move, another is made
  GridSums(const Faces& faces, const GpuGrid& grid);

  double tolerance() const { return tolerance_; }

  /// y = (diagonal - K) x, or of its transpose: K = D, or with miller D + i gamma W.
  ///
  /// x, y       M x columns, not the same
  void apply(bool miller, bool transposed, const cuDoubleComplex* diagonal, const cuComplex* x, int columns,
             cuComplex* y);

 private:
  void sort_faces(const GpuGrid& grid);
  void make_tiles();
  void make_sources(float cell_size);
  void add_smooth(bool miller, bool transposed, const cuComplex* strength, cuComplex* sum);

  const Faces& faces_;
  Context& context_;
  double tolerance_;
  LocalKernel<float> local_;
  float local_unit_;     // of the local kernel
  float cell_size_ = 0;  // in units of the reach
  GridSumView view_{};
  int3 cells_{}, tiles_{};  // along each axis
  GridTransform transform_{context_};
  Array<cuComplex> symbol_{context_}, grid_{context_};
  Array<GridFace> face_{context_};
  Array<int> number_{context_}, cell_start_{context_};
  Array<float> weight_{context_};
  Array<int> tile_start_{context_}, tile_face_{context_};  // faces whose windows meet each tile of the grid
  Array<int2> item_{context_};                             // cell and its first place, of up to a warp of places each
  Array<int> source_start_{context_}, source_{context_};   // places within reach of each cell
  Array<cuComplex> strength_{context_}, sum_{context_};    // by place
};

}  // namespace touchfield::cuda
