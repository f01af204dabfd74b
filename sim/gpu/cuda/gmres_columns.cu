#include <algorithm>

#include "sim/gpu/cuda/block_gmres.cuh"
#include "sim/gpu/cuda/launch.cuh"

// What BlockGmres does to columns.

namespace touchfield::cuda {

namespace {

constexpr double kCancelled = 0.1;  // of a vector that Gram-Schmidt leaves: less is orthogonalised once more

constexpr int kTile = 4;  // vectors that a thread multiplies by one value of w

// Few long columns are worked on in parts, each by a block of its own.
constexpr std::size_t kLongColumn = 16384;
constexpr std::size_t kPartRows = 1024;     // at least
constexpr std::size_t kWantedBlocks = 264;  // two for each multiprocessor of a large card

/// A row of a sum.
__device__ cuComplex combination(const BlockGmres::Term* terms, int count, int row) {
  cuComplex sum = {0.0F, 0.0F};
#pragma unroll 4
  for (int i = 0; i < count; ++i) {
    sum = cuCfmaf(terms[i].vector[row], terms[i].factor, sum);
  }
  return sum;
}

__device__ double column_squares(int begin, int end, const cuComplex* column) {
  double squares = 0.0;
  for (int row = begin + static_cast<int>(threadIdx.x); row < end; row += kColumnThreads) {
    squares += square(column[row]);
  }
  return block_sum(squares);
}

__device__ double column_norm(int n, const cuComplex* column) { return sqrt(column_squares(0, n, column)); }

/// The rows of a part of a column: blocks along y.
struct Rows {
  int begin, end;

  __device__ explicit Rows(int n) {
    const int rows = (n + static_cast<int>(gridDim.y) - 1) / static_cast<int>(gridDim.y);
    begin = min(n, rows * static_cast<int>(blockIdx.y));
    end = min(n, begin + rows);
  }
};

/// The scaled sum of `count` terms for each target, which may be one of its own terms, and the squares of its parts.
__global__ void __launch_bounds__(kColumnThreads) combine_columns(int n, int count, const BlockGmres::Term* terms,
                                                                  const BlockGmres::Target* targets, double* squares) {
  const BlockGmres::Target target = targets[blockIdx.x];
  const Rows rows(n);
  for (int row = rows.begin + static_cast<int>(threadIdx.x); row < rows.end; row += kColumnThreads) {
    target.column[row] = scaled(combination(terms + std::size_t{blockIdx.x} * count, count, row), target.scale);
  }
  const double of_part = column_squares(rows.begin, rows.end, target.column);
  if (threadIdx.x == 0) {
    squares[blockIdx.x * gridDim.y + blockIdx.y] = of_part;
  }
}

/// Norms of columns from the squares of so many parts.
__global__ void add_squares(int columns, int parts, const double* squares, cuDoubleComplex* norms) {
  const int column = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (column < columns) {
    double sum = 0.0;
    for (int part = 0; part < parts; ++part) {
      sum += squares[column * parts + part];
    }
    norms[column] = {sqrt(sum), 0.0};
  }
}

/// Takes from each column w of a block its parts along `count` vectors of its own, whose factors it uses. Found are
/// count + 1 numbers a column: these parts, then norms, of what is left and of w before. A thread has the same rows of
/// w throughout; it adds its products in single precision, n / 512 of them, and threads are added in double.
__global__ void __launch_bounds__(kColumnThreads, 2)
    orthogonalise(int n, int count, BlockGmres::Term* vectors, cuComplex* block, cuDoubleComplex* found) {
  __shared__ cuDoubleComplex sums[2][kWarps][kTile];
  const int thread = static_cast<int>(threadIdx.x);
  BlockGmres::Term* terms = vectors + std::size_t{blockIdx.x} * count;
  cuComplex* w = block + std::size_t{blockIdx.x} * n;
  cuDoubleComplex* parts = found + std::size_t{blockIdx.x} * (count + 1);
  const double norm = column_norm(n, w);
  double rest = 0.0;
  for (int pass = 0; pass < 2 && !(rest > kCancelled * norm); ++pass) {
    for (int first = 0; first < count; first += kTile) {
      cuComplex products[kTile] = {};
#pragma unroll 2
      for (int row = thread; row < n; row += kColumnThreads) {
        const cuComplex value = w[row];
        for (int t = 0; t < kTile; ++t) {
          const cuComplex* v = terms[min(first + t, count - 1)].vector;  // of an incomplete tile the last one again
          products[t] = cuCfmaf(cuConjf(v[row]), value, products[t]);
        }
      }
      auto& of_warps = sums[first / kTile % 2];  // the other ones may not have been read yet
      for (int t = 0; t < kTile; ++t) {
        const cuDoubleComplex of_warp = {lane_sum<kWarp>(products[t].x), lane_sum<kWarp>(products[t].y)};
        if (thread % kWarp == 0) {
          of_warps[thread / kWarp][t] = of_warp;
        }
      }
      __syncthreads();
      const int i = first + thread;
      if (thread < kTile && i < count) {
        cuDoubleComplex part = {0.0, 0.0};
        for (const auto& of_warp : of_warps) {
          part = cuCadd(part, of_warp[thread]);
        }
        terms[i].factor = {static_cast<float>(part.x), static_cast<float>(part.y)};
        parts[i] = pass == 0 ? part : cuCadd(parts[i], part);
      }
    }
    __syncthreads();
    for (int row = thread; row < n; row += kColumnThreads) {
      w[row] = cuCsubf(w[row], combination(terms, count, row));
    }
    rest = column_norm(n, w);
  }
  if (thread == 0) {
    parts[count] = {rest, norm};
  }
}

/// What orthogonalise() does, for columns in parts: kernels that work on their rows, and between them sums over parts. A
/// pass is left out where the one before has left enough.
struct PassView {
  int pass;
  double *squares, *left;  // of parts: of w at first; of what each pass has left, pass 0 before pass 1
  cuDoubleComplex* products;

  int parts;

  __device__ double of_column(const double* values) const {
    double sum = 0.0;
    for (int part = static_cast<int>(threadIdx.x); part < parts; part += kColumnThreads) {
      sum += values[static_cast<int>(blockIdx.x) * parts + part];
    }
    return block_sum(sum);
  }
  __device__ bool is_needed() const {
    return pass == 0 || !(of_column(left) > kCancelled * kCancelled * of_column(squares));
  }
  __device__ double* left_by(int of) const { return left + std::size_t{1} * of * gridDim.x * parts; }
};

/// Products of a part of w with `count` vectors; a warp a vector.
__global__ void __launch_bounds__(kColumnThreads)
    project(PassView view, int n, int count, const BlockGmres::Term* vectors, const cuComplex* block) {
  const cuComplex* w = block + std::size_t{blockIdx.x} * n;
  const Rows rows(n);
  if (view.pass == 0) {
    const double squares = column_squares(rows.begin, rows.end, w);
    if (threadIdx.x == 0) {
      view.squares[blockIdx.x * gridDim.y + blockIdx.y] = squares;
    }
  } else if (!view.is_needed()) {
    return;
  }
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  for (int i = static_cast<int>(threadIdx.x) / kWarp; i < count; i += kWarps) {
    const cuComplex* v = vectors[std::size_t{blockIdx.x} * count + i].vector;
    cuComplex product = {0.0F, 0.0F};
#pragma unroll 4
    for (int row = rows.begin + lane; row < rows.end; row += kWarp) {
      product = cuCfmaf(cuConjf(v[row]), w[row], product);
    }
    const cuDoubleComplex whole = {lane_sum<kWarp>(product.x), lane_sum<kWarp>(product.y)};
    if (lane == 0) {
      view.products[(std::size_t{blockIdx.x} * count + i) * gridDim.y + blockIdx.y] = whole;
    }
  }
}

/// The products of whole columns become factors; a warp a vector, a block a column.
__global__ void __launch_bounds__(kColumnThreads)
    add_products(PassView view, int count, BlockGmres::Term* vectors, cuDoubleComplex* found) {
  if (!view.is_needed()) {
    return;
  }
  const int lane = static_cast<int>(threadIdx.x) % kWarp;
  for (int i = static_cast<int>(threadIdx.x) / kWarp; i < count; i += kWarps) {
    const std::size_t at = std::size_t{blockIdx.x} * count + i;
    cuDoubleComplex sum = {0.0, 0.0};
    for (int part = lane; part < view.parts; part += kWarp) {
      sum = cuCadd(sum, view.products[at * view.parts + part]);
    }
    sum = {lane_sum<kWarp>(sum.x), lane_sum<kWarp>(sum.y)};
    if (lane == 0) {
      vectors[at].factor = {static_cast<float>(sum.x), static_cast<float>(sum.y)};
      cuDoubleComplex& all = found[std::size_t{blockIdx.x} * (count + 1) + i];
      all = view.pass == 0 ? sum : cuCadd(all, sum);
    }
  }
}

__global__ void __launch_bounds__(kColumnThreads)
    subtract(PassView view, int n, int count, const BlockGmres::Term* vectors, cuComplex* block) {
  if (!view.is_needed()) {
    return;
  }
  cuComplex* w = block + std::size_t{blockIdx.x} * n;
  const Rows rows(n);
  for (int row = rows.begin + static_cast<int>(threadIdx.x); row < rows.end; row += kColumnThreads) {
    w[row] = cuCsubf(w[row], combination(vectors + std::size_t{blockIdx.x} * count, count, row));
  }
  const double squares = column_squares(rows.begin, rows.end, w);
  if (threadIdx.x == 0) {
    view.left_by(view.pass)[blockIdx.x * gridDim.y + blockIdx.y] = squares;
  }
}

/// Norms of what is left and of w before, after both passes; a block a column.
__global__ void __launch_bounds__(kColumnThreads) find_norms(PassView view, int count, cuDoubleComplex* found) {
  const bool twice = view.is_needed();
  const double left = view.of_column(twice ? view.left_by(1) : view.left);
  const double before = view.of_column(view.squares);
  if (threadIdx.x == 0) {
    found[std::size_t{blockIdx.x} * (count + 1) + count] = {sqrt(left), sqrt(before)};
  }
}

}  // namespace

/// In how many parts so many columns are worked on.
unsigned BlockGmres::parts(std::size_t columns) const {
  const std::size_t wanted = rows_ < kLongColumn ? 1 : std::min(kWantedBlocks / columns, rows_ / kPartRows);
  return static_cast<unsigned>(std::max<std::size_t>(wanted, 1));
}

/// To each target the sum of `count` terms, in this order; more terms are uploaded only. The sums' norms are found.
void BlockGmres::combine(const std::vector<Term>& terms, std::size_t count, const std::vector<Target>& targets) {
  terms_.upload(terms);
  targets_.upload(targets);
  const auto columns = static_cast<unsigned>(targets.size());
  const unsigned in_parts = parts(columns);
  squares_.resize(std::size_t{1} * columns * in_parts);
  launch(*context_, "sums of columns", combine_columns, dim3(columns, in_parts), kColumnThreads,
         static_cast<int>(rows_), static_cast<int>(count), terms_.data(), targets_.data(), squares_.data());
  launch(*context_, "sums of columns", add_squares, blocks_for(columns, kColumnThreads), kColumnThreads,
         static_cast<int>(columns), static_cast<int>(in_parts), squares_.data(), found_.data());
}

/// Takes from the columns of the product their parts along `count` vectors each; see orthogonalise().
void BlockGmres::make_orthogonal(std::size_t columns, int count, Term* vectors) {
  const auto n = static_cast<int>(rows_);
  const unsigned in_parts = parts(columns);
  const dim3 blocks(static_cast<unsigned>(columns), in_parts);
  if (in_parts == 1) {
    launch(*context_, "Krylov step", orthogonalise, blocks, kColumnThreads, n, count, vectors, product_.data(),
           found_.data());
    return;
  }
  const std::size_t all = columns * in_parts;
  squares_.resize(3 * all);
  products_.resize(all * static_cast<std::size_t>(count));
  PassView view{0, squares_.data(), squares_.data() + all, products_.data(), static_cast<int>(in_parts)};
  for (; view.pass < 2; ++view.pass) {
    launch(*context_, "Krylov step", project, blocks, kColumnThreads, view, n, count, vectors, product_.data());
    launch(*context_, "Krylov step", add_products, static_cast<unsigned>(columns), kColumnThreads, view, count, vectors,
           found_.data());
    launch(*context_, "Krylov step", subtract, blocks, kColumnThreads, view, n, count, vectors, product_.data());
  }
  launch(*context_, "Krylov step", find_norms, static_cast<unsigned>(columns), kColumnThreads, view, count,
         found_.data());
}

}  // namespace touchfield::cuda
