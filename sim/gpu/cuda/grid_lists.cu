#include <algorithm>
#include <cmath>

#include "sim/gpu/cuda/grid_sums.cuh"
#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/lists.cuh"

// Where faces lie on a grid: cells, tiles and what lies within reach.

namespace touchfield::cuda {

namespace {

constexpr int kThreads = 128;

__device__ int3 operator/(int3 a, int b) { return {a.x / b, a.y / b, a.z / b}; }
__device__ int number_of_cell(int3 cells, int3 c) { return (c.x * cells.y + c.y) * cells.z + c.z; }

/// Where faces lie on the grid.
struct GridPlaces {
  Vector origin;
  double step, reach;
  int3 most;  // the last whole step along each axis
  int side;   // of cells, in steps
  int3 cells;

  __device__ Vector place(const Vector& at) const { return (1.0 / step) * (at - origin); }
  __device__ int3 whole(const Vector& at) const {
    const auto clamped = [](double v, int largest) { return max(0, min(static_cast<int>(floor(v)), largest)); };
    return {clamped(at.x, most.x), clamped(at.y, most.y), clamped(at.z, most.z)};
  }
};

__global__ void find_cells(FaceView faces, GridPlaces grid, int* cell, int* number) {
  const int f = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (f < faces.count) {
    cell[f] = number_of_cell(grid.cells, grid.whole(grid.place(faces.centroid[f])) / grid.side);
    number[f] = f;
  }
}

/// The window's weights of a place between two points and their slopes, times `along` for each.
__device__ void window_weights(int width, int lanes, const float* window, float place, float along, float* weight,
                               float* slope) {
  const float t = 2.0F * place - 1.0F;
  for (int l = 0; l < width; ++l) {
    float w = window[l];
    float s = 0.0F;
    for (int c = 1; c <= kWindowDegree; ++c) {
      s = s * t + w;
      w = w * t + window[c * lanes + l];
    }
    weight[l] = w;
    slope[l] = 2.0F * s * along;
  }
}

__global__ void place_faces(FaceView faces, GridPlaces grid, const int* number, int width, int lanes,
                            const float* window, GridFace* face, float* weight) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= faces.count) {
    return;
  }
  const int f = number[p];
  const Vector at = grid.place(faces.centroid[f]);
  const Vector n = faces.normal[f];
  const int3 whole = grid.whole(at);
  const int3 cell = whole / grid.side;
  const auto in_cell = [&](double place, int c) {
    return static_cast<float>((place - grid.side * (c + 0.5)) * (grid.step / grid.reach));
  };
  face[p] = {{in_cell(at.x, cell.x), in_cell(at.y, cell.y), in_cell(at.z, cell.z)},
             {static_cast<float>(n.x), static_cast<float>(n.y), static_cast<float>(n.z)},
             cell,
             whole};
  float* of_face = weight + std::size_t{6} * p * width;
  const double rest[3] = {at.x - whole.x, at.y - whole.y, at.z - whole.z};
  const double along[3] = {n.x, n.y, n.z};
  for (int axis = 0; axis < 3; ++axis, of_face += 2 * width) {
    window_weights(width, lanes, window, static_cast<float>(rest[axis]), static_cast<float>(along[axis] / grid.step),
                   of_face, of_face + width);
  }
}

/// Tiles that a face's window meets: how many, or with kFill their numbers and the face's place from start[p] on.
template <bool kFill>
__global__ void find_tiles(GridSumView view, int3 tiles, const int* start, int* count, int* tile, int* place) {
  const int p = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (p >= view.count) {
    return;
  }
  const int3 first = view.face[p].first;
  const int last = view.width - 1;
  const int3 from = first / kGridTile;
  const int3 to = int3{first.x + last, first.y + last, first.z + last} / kGridTile;
  if (!kFill) {
    count[p] = (to.x - from.x + 1) * (to.y - from.y + 1) * (to.z - from.z + 1);
    return;
  }
  int at = start[p];
  for (int x = from.x; x <= to.x; ++x) {
    for (int y = from.y; y <= to.y; ++y) {
      for (int z = from.z; z <= to.z; ++z, ++at) {
        tile[at] = number_of_cell(tiles, {x, y, z});
        place[at] = p;
      }
    }
  }
}

/// Places within reach of a cell's faces, in the order of places: how many, or with kFill the places from start on. A
/// warp a cell.
template <bool kFill>
__global__ void find_sources(GridSumView view, int3 cells, float cell_size, const int* cell_start, const int* start,
                             int* count, int* source) {
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  const int c = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x) / kWarp;
  if (c >= cells.x * cells.y * cells.z) {  // the whole warp
    return;
  }
  const int begin = cell_start[c];
  const int end = cell_start[c + 1];
  if (begin == end) {
    if (!kFill && lane == 0) {
      count[c] = 0;
    }
    return;
  }
  float3 low = {cell_size, cell_size, cell_size};
  float3 high = {-cell_size, -cell_size, -cell_size};
  for (int p = begin; p < end; ++p) {
    const float3 at = view.face[p].place;
    low = {fminf(low.x, at.x), fminf(low.y, at.y), fminf(low.z, at.z)};
    high = {fmaxf(high.x, at.x), fmaxf(high.y, at.y), fmaxf(high.z, at.z)};
  }
  const int z = c % cells.z;
  const int y = c / cells.z % cells.y;
  const int x = c / cells.z / cells.y;
  const int far = static_cast<int>(ceilf(1.0F / cell_size));
  const unsigned before = (1U << static_cast<unsigned>(lane)) - 1U;
  int found = kFill ? start[c] : 0;
  for (int i = max(0, x - far); i <= min(cells.x - 1, x + far); ++i) {
    for (int j = max(0, y - far); j <= min(cells.y - 1, y + far); ++j) {
      const int row = number_of_cell(cells, {i, j, 0});
      const int last = cell_start[row + min(cells.z - 1, z + far) + 1];
      for (int first = cell_start[row + max(0, z - far)]; first < last; first += kWarp) {
        const int p = first + lane;
        bool near = false;
        if (p < last) {
          const GridFace& other = view.face[p];
          const auto beyond = [&](float at, int steps, float least, float most) {
            const float moved = at + cell_size * static_cast<float>(steps);
            return moved - fmaxf(least, fminf(most, moved));
          };
          const float dx = beyond(other.place.x, i - x, low.x, high.x);
          const float dy = beyond(other.place.y, j - y, low.y, high.y);
          const float dz = beyond(other.place.z, other.cell.z - z, low.z, high.z);
          near = dx * dx + dy * dy + dz * dz < 1.0F;
        }
        const unsigned hits = __ballot_sync(kAllLanes, near);
        if (kFill && near) {
          source[found + __popc(hits & before)] = p;
        }
        found += __popc(hits);
      }
    }
  }
  if (!kFill && lane == 0) {
    count[c] = found;
  }
}

}  // namespace

void GridSums::sort_faces(const GpuGrid& grid) {
  constexpr double kCells = 2.0;  // a reach
  GridPlaces places{};
  places.origin = {grid.origin[0], grid.origin[1], grid.origin[2]};
  places.step = grid.step;
  places.reach = grid.reach;
  places.side = std::max(1, static_cast<int>(std::ceil(grid.reach / (kCells * grid.step))));
  places.most = {grid.points[0] - grid.width, grid.points[1] - grid.width, grid.points[2] - grid.width};
  places.cells = {places.most.x / places.side + 1, places.most.y / places.side + 1, places.most.z / places.side + 1};
  cells_ = places.cells;
  const auto count = static_cast<std::size_t>(faces_.size());
  const int cells = cells_.x * cells_.y * cells_.z;
  Array<float> window(context_);
  window.upload(grid.window);
  Array<int> cell(context_, count);
  Array<int> face(context_, count);
  Array<int> sorted(context_);
  const unsigned blocks = blocks_for(count, kThreads);
  launch(context_, "cells", find_cells, blocks, kThreads, faces_.view(), places, cell.data(), face.data());
  sort_pairs(context_, cells, cell, face, sorted, number_);
  find_starts(context_, sorted, cells, cell_start_);
  launch(context_, "cells", place_faces, blocks, kThreads, faces_.view(), places, number_.data(), grid.width,
         grid.lanes, window.data(), face_.data(), weight_.data());
  std::vector<int> start(static_cast<std::size_t>(cells) + 1);
  cell_start_.download(start.data(), start.size());
  std::vector<int2> items;
  for (int c = 0; c < cells; ++c) {
    for (int p = start[static_cast<std::size_t>(c)]; p < start[static_cast<std::size_t>(c) + 1]; p += kWarp) {
      items.push_back({c, p});
    }
  }
  item_.upload(items);
  view_.count = faces_.size();
  view_.face = face_.data();
  make_sources(static_cast<float>(places.side * grid.step / grid.reach));
}

void GridSums::make_sources(float cell_size) {
  cell_size_ = cell_size;
  const int cells = cells_.x * cells_.y * cells_.z;
  const unsigned blocks = blocks_for(std::size_t{kWarp} * cells, kThreads);
  Array<int> count(context_, static_cast<std::size_t>(cells) + 1);
  count.set_zero();
  launch(context_, "faces within reach", find_sources<false>, blocks, kThreads, view_, cells_, cell_size,
         cell_start_.data(), nullptr, count.data(), nullptr);
  source_.resize(add_up(context_, count, source_start_));
  launch(context_, "faces within reach", find_sources<true>, blocks, kThreads, view_, cells_, cell_size,
         cell_start_.data(), source_start_.data(), nullptr, source_.data());
}

void GridSums::make_tiles() {
  const auto along = [](int points) { return (points + kGridTile - 1) / kGridTile; };
  tiles_ = {along(view_.points.x), along(view_.points.y), along(view_.points.z)};
  const int tiles = tiles_.x * tiles_.y * tiles_.z;
  const unsigned blocks = blocks_for(view_.count, kThreads);
  Array<int> count(context_, static_cast<std::size_t>(view_.count) + 1);
  count.set_zero();
  Array<int> start(context_);
  launch(context_, "tiles", find_tiles<false>, blocks, kThreads, view_, tiles_, nullptr, count.data(), nullptr,
         nullptr);
  const auto entries = static_cast<std::size_t>(add_up(context_, count, start));
  Array<int> tile(context_, entries);
  Array<int> place(context_, entries);
  Array<int> sorted(context_);
  launch(context_, "tiles", find_tiles<true>, blocks, kThreads, view_, tiles_, start.data(), nullptr, tile.data(),
         place.data());
  sort_pairs(context_, tiles, tile, place, sorted, tile_face_);
  find_starts(context_, sorted, tiles, tile_start_);
}

}  // namespace touchfield::cuda
