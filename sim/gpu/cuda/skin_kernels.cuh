#pragma once

#include "sim/gpu/cuda/norm_sums.cuh"

namespace touchfield::cuda {

/// The kernels of skin_steps.cu, which alone includes this.
namespace {

constexpr unsigned kWide = 1024;  // threads of the one block that ends a correction

/// SkinMoves on the card. J has a row a face, then two a kept row of R.
struct SkinModel {
  const double2* directions;
  const double2* phasors;
  const double* scale;       // a column; not of largest_row
  const int* radial;         // the channel of a column beyond the first `channels`
  const int* radial_column;  // of a channel, -1: none
  int faces;
  int kept;
  int channels;
  int columns;

  __device__ int field_rows() const { return faces + kept; }
};

__device__ inline double along(double2 direction, double2 value) {
  return direction.x * value.x + direction.y * value.y;
}
__device__ inline double2 product(double2 a, double2 b) { return {a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x}; }

template <typename From>
__global__ void stack_rows(const From* from, int rows, int columns, int first, int ld, double2* to) {
  const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i < std::size_t{1} * rows * columns) {
    const std::size_t column = i / rows;
    to[column * ld + first + i % rows] = {static_cast<double>(from[i].x), static_cast<double>(from[i].y)};
  }
}

/// sums(2 i) = sum_n |a_in|, sums(2 i + 1) = sum_n |a_in|^2: a block a row.
__global__ void sum_rows(const double2* a, int rows, int columns, double* sums) {
  const int row = static_cast<int>(blockIdx.x);
  double reach = 0;
  double strength = 0;
  for (int n = static_cast<int>(threadIdx.x); n < columns; n += static_cast<int>(blockDim.x)) {
    const double2 entry = a[row + std::size_t{1} * n * rows];
    reach += hypot(entry.x, entry.y);
    strength += entry.x * entry.x + entry.y * entry.y;
  }
  reach = block_sum(reach);
  strength = block_sum(strength);
  if (threadIdx.x == 0) {
    sums[2 * row] = reach;
    sums[2 * row + 1] = strength;
  }
}

/// The squared norms of J's rows, two a row of [H_T; R]: a block each.
__global__ void square_rows(const double2* a, int rows, SkinModel model, double* squares) {
  const int row = static_cast<int>(blockIdx.x);
  double first = 0;
  double second = 0;
  for (int n = static_cast<int>(threadIdx.x); n < model.channels; n += static_cast<int>(blockDim.x)) {
    const double2 radial = product(model.phasors[n], a[row + std::size_t{1} * n * rows]);
    const double2 tangential{-radial.y, radial.x};
    const bool moves = model.radial_column[n] >= 0;
    if (row < model.faces) {
      const double turn = along(model.directions[row], tangential);
      const double stretch = moves ? along(model.directions[row], radial) : 0.0;
      first += turn * turn + stretch * stretch;
    } else {
      first += tangential.x * tangential.x + (moves ? radial.x * radial.x : 0.0);
      second += tangential.y * tangential.y + (moves ? radial.y * radial.y : 0.0);
    }
  }
  first = block_sum(first);
  second = block_sum(second);
  if (threadIdx.x == 0) {
    squares[2 * row] = first;
    squares[2 * row + 1] = second;
  }
}

/// J diag(scale).
template <typename Real>
__global__ void fill_jacobian(const double2* a, int ld, SkinModel model, Real* jacobian) {
  const int column = static_cast<int>(blockIdx.x);
  const int row = static_cast<int>(blockIdx.y * blockDim.x + threadIdx.x);
  if (row >= model.field_rows()) {
    return;
  }
  const bool turns = column < model.channels;
  const int n = turns ? column : model.radial[column - model.channels];
  const double2 phasor = model.phasors[n];
  const double scale = model.scale[column];
  const double2 move =
      turns ? double2{-scale * phasor.y, scale * phasor.x} : double2{scale * phasor.x, scale * phasor.y};
  const double2 moved = product(move, a[row + std::size_t{1} * n * ld]);
  Real* to = jacobian + std::size_t{1} * column * (model.faces + 2 * model.kept);
  if (row < model.faces) {
    to[row] = static_cast<Real>(along(model.directions[row], moved));
  } else {
    to[2 * row - model.faces] = static_cast<Real>(moved.x);
    to[2 * row - model.faces + 1] = static_cast<Real>(moved.y);
  }
}

template <typename Real>
__global__ void add_identity(int size, Real* matrix) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    matrix[i * (size + std::size_t{1})] += 1;
  }
}

// ---- A correction where J has no more rows than columns: y has a value a row.

/// y += unit x; the field that it weighs the rows with.
template <typename Real>
__global__ void spread_rows(SkinModel model, const Real* x, double unit, double* y, double2* field) {
  const int row = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (row >= model.field_rows()) {
    return;
  }
  const bool target = row < model.faces;
  const int at = target ? row : 2 * row - model.faces;
  const double first = y[at] + unit * static_cast<double>(x[at]);
  y[at] = first;
  if (target) {
    field[row] = {model.directions[row].x * first, model.directions[row].y * first};
  } else {
    const double second = y[at + 1] + unit * static_cast<double>(x[at + 1]);
    y[at + 1] = second;
    field[row] = {first, second};
  }
}

/// moves = S S J^T y from the field that was sent back, and the drives that move so.
__global__ void move_back(SkinModel model, const double2* back, double* moves, double2* drives) {
  const int n = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (n >= model.channels) {
    return;
  }
  const double2 phasor = model.phasors[n];
  const double turn = model.scale[n] * model.scale[n] * (phasor.x * back[n].y - phasor.y * back[n].x);
  moves[n] = turn;
  double stretch = 0;
  if (const int radial = model.radial_column[n]; radial >= 0) {
    stretch = model.scale[radial] * model.scale[radial] * along(phasor, back[n]);
    moves[radial] = stretch;
  }
  drives[n] = product(phasor, {stretch, turn});
}

/// remainder = right - y - J (moves), and its norm: one block.
__global__ __launch_bounds__(kWide) void end_rows(SkinModel model, const double2* parts, int shares,
                                                  const double* right, const double* y, double* remainder,
                                                  double* norm) {
  double sum = 0;
  const int rows = model.field_rows();
  for (int row = static_cast<int>(threadIdx.x); row < rows; row += static_cast<int>(blockDim.x)) {
    const double2 field = sum_shares(parts, rows, shares, row);
    const bool target = row < model.faces;
    const int at = target ? row : 2 * row - model.faces;
    const double first = right[at] - y[at] - (target ? along(model.directions[row], field) : field.x);
    remainder[at] = first;
    sum += first * first;
    if (!target) {
      const double second = right[at + 1] - y[at + 1] - field.y;
      remainder[at + 1] = second;
      sum += second * second;
    }
  }
  sum = block_sum(sum);
  if (threadIdx.x == 0) {
    *norm = sqrt(sum);
  }
}

// ---- A correction where J has fewer columns: y has a value a column.

/// y += unit x; moves = S y and the drives that move so.
template <typename Real>
__global__ void move_columns(SkinModel model, const Real* x, double unit, double* y, double* moves, double2* drives) {
  const int n = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (n >= model.channels) {
    return;
  }
  const auto moved = [&](int column) {
    y[column] += unit * static_cast<double>(x[column]);
    return moves[column] = model.scale[column] * y[column];
  };
  const double turn = moved(n);
  const int radial = model.radial_column[n];
  drives[n] = product(model.phasors[n], {radial >= 0 ? moved(radial) : 0.0, turn});
}

/// What the rows make of a field, as the field that weighs them with it.
__global__ void keep_along(SkinModel model, const double2* parts, int shares, double2* field) {
  const int row = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (row >= model.field_rows()) {
    return;
  }
  const double2 value = sum_shares(parts, model.field_rows(), shares, row);
  if (row < model.faces) {
    const double2 direction = model.directions[row];
    const double part = along(direction, value);
    field[row] = {direction.x * part, direction.y * part};
  } else {
    field[row] = value;
  }
}

/// remainder = right - y - S J^T (the field that was sent back), and its norm: one block.
__global__ __launch_bounds__(kWide) void end_columns(SkinModel model, const double2* back, const double* right,
                                                     const double* y, double* remainder, double* norm) {
  double sum = 0;
  for (int column = static_cast<int>(threadIdx.x); column < model.columns; column += static_cast<int>(blockDim.x)) {
    const bool turns = column < model.channels;
    const int n = turns ? column : model.radial[column - model.channels];
    const double2 phasor = model.phasors[n];
    const double pull = turns ? phasor.x * back[n].y - phasor.y * back[n].x : along(phasor, back[n]);
    const double rest = right[column] - y[column] - model.scale[column] * pull;
    remainder[column] = rest;
    sum += rest * rest;
  }
  sum = block_sum(sum);
  if (threadIdx.x == 0) {
    *norm = sqrt(sum);
  }
}

// ---- Single precision, for annealed starts

__global__ void scale_rows(const double2* a, int rows, int columns, int faces, const double* target_scale,
                           double quiet_scale, float2* scaled) {
  const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i < std::size_t{1} * rows * columns) {
    const int row = static_cast<int>(i % rows);
    const double scale = row < faces ? target_scale[row] : quiet_scale;
    scaled[i] = {static_cast<float>(scale * a[i].x), static_cast<float>(scale * a[i].y)};
  }
}

}  // namespace

}  // namespace touchfield::cuda
