#include <algorithm>
#include <cfloat>
#include <cmath>
#include <limits>

#include "sim/gpu/cuda/block_gmres.cuh"
#include "sim/gpu/cuda/block_sum.cuh"

namespace touchfield::cuda {

namespace {

constexpr int kMostSteps = 512;  // what a block's shared memory holds of a column's problem

// A vector left with this share of its norm after orthogonalisation is rounding, not a new direction.
constexpr double kRounding = 16.0 * FLT_EPSILON;
constexpr double kCancelled = 0.1;  // of a vector that Gram-Schmidt leaves: less is orthogonalised once more

// A cycle that leaves more than this share of the residual has stagnated: the next one would start from the same.
constexpr double kStagnation = 0.999;

constexpr int kTile = 4;    // basis vectors that a thread multiplies by one value of w
constexpr int kRound = 64;  // basis vectors whose sums over warps are held at once
constexpr int kChunk = 16;  // products a thread adds in float, before it goes on in double

/// The Krylov spaces of all columns, S of them; `most` is the greatest dimension.
struct Spaces {
  const BlockGmres::Step* steps;
  int* places;                      // S a step: where the column lies in steps[k].basis
  cuDoubleComplex* reduced;         // most + 1 a column
  BlockGmres::Rotation* rotations;  // most a column
  int n;
  int columns;
  int most;
};

/// What one column's space needs of shared memory for its first `count` vectors, kSharedBytes each.
struct SharedColumn {
  cuDoubleComplex* values;
  cuComplex* factors;
  const cuComplex** vectors;

  __device__ SharedColumn(double2* room, int count)
      : values(room),
        factors(reinterpret_cast<cuComplex*>(room + count)),
        vectors(reinterpret_cast<const cuComplex**>(factors + count)) {}
};
constexpr std::size_t kSharedBytes = sizeof(cuDoubleComplex) + sizeof(cuComplex) + sizeof(const cuComplex*);

/// What column a space's vector of a step lies in.
__device__ std::size_t offset_of(const Spaces& spaces, int step, int column) {
  const int place = spaces.places[static_cast<std::size_t>(step) * spaces.columns + column];
  return static_cast<std::size_t>(place) * spaces.n;
}

/// factors = V^H w of the first `count` vectors, added to values too. Each warp sums its rows, `sums` takes what they found.
/// All threads of the block see the factors when it returns.
__device__ void project(const SharedColumn& shared, int count, int n, const cuComplex* w, double* sums) {
  const int thread = static_cast<int>(threadIdx.x);
  const int warp = thread / 32;
  const int lane = thread % 32;
  static_assert(kRound <= kColumnThreads && kRound % kTile == 0, "a thread a sum");
  for (int first = 0; first < count; first += kRound) {
    const int round = min(kRound, count - first);
    for (int i = 0; i < round; i += kTile) {
      const cuComplex* v[kTile];
#pragma unroll
      for (int t = 0; t < kTile; ++t) {
        v[t] = shared.vectors[first + min(i + t, round - 1)];  // the last one again where the tile is not full
      }
      double total[2 * kTile] = {};
      for (int start = thread; start < n; start += kColumnThreads * kChunk) {
        const int end = n - start > kColumnThreads * kChunk ? start + kColumnThreads * kChunk : n;
        float part[2 * kTile] = {};
#pragma unroll 2
        for (int row = start; row < end; row += kColumnThreads) {
          const cuComplex value = w[row];
#pragma unroll
          for (int t = 0; t < kTile; ++t) {
            const cuComplex other = v[t][row];
            part[2 * t] += other.x * value.x + other.y * value.y;
            part[2 * t + 1] += other.x * value.y - other.y * value.x;
          }
        }
#pragma unroll
        for (int t = 0; t < 2 * kTile; ++t) {
          total[t] += part[t];
        }
      }
      const double sum = warp_sums(total);
      const int which = lane / (32 / (2 * kTile));
      if (lane % (32 / (2 * kTile)) == 0 && i + which / 2 < round) {
        sums[2 * (warp * kRound + i) + which] = sum;
      }
    }
    __syncthreads();
    if (thread < round) {
      cuDoubleComplex sum = {0.0, 0.0};
      for (int from = 0; from < kWarps; ++from) {
        sum.x += sums[2 * (from * kRound + thread)];
        sum.y += sums[2 * (from * kRound + thread) + 1];
      }
      const int i = first + thread;
      shared.factors[i] = {static_cast<float>(sum.x), static_cast<float>(sum.y)};
      shared.values[i] = cuCadd(shared.values[i], sum);
    }
    __syncthreads();
  }
}

/// A row of V factors.
__device__ cuComplex combination(const SharedColumn& shared, int count, int row) {
  cuComplex sum = {0.0F, 0.0F};
#pragma unroll 4
  for (int i = 0; i < count; ++i) {
    const cuComplex v = shared.vectors[i][row];
    const cuComplex factor = shared.factors[i];
    sum.x += v.x * factor.x - v.y * factor.y;
    sum.y += v.x * factor.y + v.y * factor.x;
  }
  return sum;
}

/// Makes column k of the least-squares problem, values with `rest` below, triangular by Givens rotations.
__device__ ColumnStatus rotate(const Spaces& spaces, int k, const Slot& slot, double norm, double rest, bool exhausted,
                               cuDoubleComplex* values) {
  BlockGmres::Rotation* rotations = spaces.rotations + static_cast<std::size_t>(slot.column) * spaces.most;
  cuDoubleComplex* reduced = spaces.reduced + static_cast<std::size_t>(slot.column) * (spaces.most + 1);
  const cuDoubleComplex right = k == 0 ? cuDoubleComplex{slot.residual * slot.norm, 0.0} : reduced[k];
  cuDoubleComplex last = values[0];
  for (int i = 0; i < k; ++i) {
    const double c = rotations[i].cosine;
    const cuDoubleComplex s = rotations[i].sine;
    const cuDoubleComplex next = values[i + 1];
    values[i] = {c * last.x + s.x * next.x - s.y * next.y, c * last.y + s.x * next.y + s.y * next.x};
    last = {c * next.x - s.x * last.x - s.y * last.y, c * next.y - s.x * last.y + s.y * last.x};
  }
  const double size = cuCabs(last);
  if (exhausted && size <= kRounding * norm) {
    return {cuCabs(right) / slot.norm, 0,
            1};  // A is singular on the space: the new direction cannot lessen the residual
  }
  const double below = exhausted ? 0.0 : rest;
  const double length = hypot(size, below);
  const cuDoubleComplex phase = size > 0.0 ? cuDoubleComplex{last.x / size, last.y / size} : cuDoubleComplex{1.0, 0.0};
  const double c = size / length;
  const cuDoubleComplex s = {phase.x * below / length, phase.y * below / length};
  rotations[k] = {c, s};
  values[k] = {phase.x * length, phase.y * length};
  reduced[k] = {c * right.x, c * right.y};
  reduced[k + 1] = {-s.x * right.x - s.y * right.y, -s.x * right.y + s.y * right.x};
  return {cuCabs(reduced[k + 1]) / slot.norm, 1, exhausted ? 1 : 0};
}

/// Takes w = A v_k, in the place of v_(k+1), into the space of each slot. A thread has the same rows of w throughout.
__global__ void __launch_bounds__(kColumnThreads, 2)
    extend_spaces(Spaces spaces, int k, const Slot* slots, ColumnStatus* status) {
  extern __shared__ double2 room[];
  __shared__ double sums[2 * kRound * kWarps];
  const SharedColumn shared(room, k + 1);
  const Slot slot = slots[blockIdx.x];
  const int thread = static_cast<int>(threadIdx.x);
  const int n = spaces.n;
  const std::size_t offset = std::size_t{blockIdx.x} * n;
  cuComplex* w = spaces.steps[k + 1].basis + offset;
  for (int i = thread; i <= k; i += kColumnThreads) {
    shared.vectors[i] = spaces.steps[i].basis + (i < k ? offset_of(spaces, i, slot.column) : offset);
    shared.values[i] = {0.0, 0.0};
  }
  if (thread == 0) {
    spaces.places[static_cast<std::size_t>(k) * spaces.columns + slot.column] = static_cast<int>(blockIdx.x);
  }
  double squares = 0.0;
  for (int row = thread; row < n; row += kColumnThreads) {
    squares += square(w[row]);
  }
  const double norm = sqrt(block_sum(squares));
  if (!isfinite(norm)) {
    if (thread == 0) {
      status[blockIdx.x] = {norm, 0, 0};
    }
    return;
  }
  double rest = 0.0;
  for (int pass = 0; pass < 2; ++pass) {
    project(shared, k + 1, n, w, sums);
    squares = 0.0;
    for (int row = thread; row < n; row += kColumnThreads) {
      const cuComplex left = cuCsubf(w[row], combination(shared, k + 1, row));
      w[row] = left;
      squares += square(left);
    }
    rest = sqrt(block_sum(squares));
    if (rest > kCancelled * norm) {  // few digits went: once is enough
      break;
    }
  }
  const bool exhausted = !(rest > kRounding * norm);
  if (thread == 0) {
    status[blockIdx.x] = rotate(spaces, k, slot, norm, rest, exhausted, shared.values);
  }
  __syncthreads();
  cuDoubleComplex* triangle = spaces.steps[k].triangle + static_cast<std::size_t>(slot.column) * (k + 1);
  for (int i = thread; i <= k; i += kColumnThreads) {
    triangle[i] = shared.values[i];
  }
  if (!exhausted) {
    const double factor = 1.0 / rest;
    for (int row = thread; row < n; row += kColumnThreads) {
      w[row] = scaled(w[row], factor);
    }
  }
}

/// candidate = x + Z y with the minimising y and the directions Z, a column a slot.
__global__ void __launch_bounds__(kColumnThreads)
    add_minimisers(Spaces spaces, const Slot* slots, const cuComplex* x, cuComplex* candidate) {
  extern __shared__ double2 room[];
  const Slot slot = slots[blockIdx.x];
  const int dimension = slot.dimension;
  const SharedColumn shared(room, dimension);
  const int thread = static_cast<int>(threadIdx.x);
  const cuDoubleComplex* reduced = spaces.reduced + static_cast<std::size_t>(slot.column) * (spaces.most + 1);
  for (int i = thread; i < dimension; i += kColumnThreads) {
    shared.vectors[i] = spaces.steps[i].direction + offset_of(spaces, i, slot.column);
    shared.values[i] = reduced[i];
  }
  __syncthreads();
  for (int j = dimension - 1; j >= 0; --j) {
    const cuDoubleComplex* triangle = spaces.steps[j].triangle + static_cast<std::size_t>(slot.column) * (j + 1);
    if (thread == 0) {
      const cuDoubleComplex y = cuCdiv(shared.values[j], triangle[j]);
      shared.values[j] = y;
      shared.factors[j] = {static_cast<float>(y.x), static_cast<float>(y.y)};
    }
    __syncthreads();
    const cuDoubleComplex y = shared.values[j];
    for (int i = thread; i < j; i += kColumnThreads) {
      shared.values[i] = cuCsub(shared.values[i], cuCmul(triangle[i], y));
    }
    __syncthreads();
  }
  const cuComplex* old = x + static_cast<std::size_t>(slot.column) * spaces.n;
  cuComplex* own = candidate + std::size_t{blockIdx.x} * spaces.n;
  for (int row = thread; row < spaces.n; row += kColumnThreads) {
    own[row] = cuCaddf(old[row], combination(shared, dimension, row));
  }
}

std::size_t index(int i) { return static_cast<std::size_t>(i); }

}  // namespace

BlockGmres::BlockGmres(Context& context)
    : context_(context),
      block_(context),
      steps_there_(context),
      places_(context),
      reduced_(context),
      rotations_(context),
      candidate_(context) {}

GmresReport BlockGmres::solve(const BlockProduct& apply, int n, int columns, const cuComplex* b, cuComplex* x,
                              const GmresLimits& limits, bool x_is_start,
                              const std::function<void(int, double)>& report, const BlockProduct* loose,
                              const BlockProduct* precondition) {
  if (!(limits.tolerance > 0.0) || limits.max_steps < 0 || limits.restart < 1) {
    throw std::invalid_argument("gmres: tolerance must be > 0, max_steps >= 0 and restart >= 1");
  }
  result_ = {};
  result_.residuals.assign(index(columns), 0.0);
  if (n > 0 && columns > 0) {
    const int most = std::min({limits.restart, limits.max_steps, n, kMostSteps});
    const Problem problem{apply, loose != nullptr ? *loose : apply, precondition, n, columns, b, x, limits, report,
                          most};
    places_.resize(index(most) * index(columns));
    reduced_.resize(index(most + 1) * index(columns));
    rotations_.resize(index(most) * index(columns));
    column_steps_.assign(index(columns), 0);
    dimensions_.assign(index(columns), 0);
    estimates_.assign(index(columns), 0.0);
    std::vector<Slot> running = block_.start("gmres", n, columns, b, x, x_is_start);
    for (Slot& slot : running) {
      slot.residual = x_is_start ? std::numeric_limits<double>::infinity() : 1.0;
      result_.residuals[index(slot.column)] = 1.0;
    }
    if (x_is_start) {
      if (!running.empty()) {
        update(problem, running);
      }
    } else if (limits.max_steps == 0 || limits.tolerance >= 1.0) {
      running.clear();
    } else if (!running.empty()) {
      prepare(problem, 0, static_cast<int>(running.size()));
      drop(running, [](const Slot&) { return false; });
      block_.upload(running);
      block_.judge(n, b, nullptr, nullptr, x, bases_[0].data());
    }
    while (!running.empty()) {
      run_cycle(problem, running);
      update(problem, running);
    }
  }
  for (const double residual : result_.residuals) {
    result_.worst = std::max(result_.worst, residual);
  }
  result_.converged = result_.worst <= limits.tolerance;
  return std::move(result_);
}

void BlockGmres::release() {
  bases_.clear();
  directions_.clear();
  triangles_.clear();
  steps_.clear();
  steps_there_.reset();
  places_.reset();
  reduced_.reset();
  rotations_.reset();
  candidate_.reset();
}

/// Room for the vectors that a step multiplies.
void BlockGmres::prepare(const Problem& problem, int step, int columns) {
  while (bases_.size() <= index(step)) {
    bases_.emplace_back(context_);
    directions_.emplace_back(context_);
    triangles_.emplace_back(context_);
    steps_.push_back({});
  }
  Array<cuComplex>& basis = bases_[index(step)];
  Array<cuComplex>& direction = problem.precondition != nullptr ? directions_[index(step)] : basis;
  Array<cuDoubleComplex>& triangle = triangles_[index(step)];
  basis.resize(index(problem.n) * index(columns));
  direction.resize(basis.size());
  triangle.resize(index(step + 1) * index(problem.columns));
  Step& known = steps_[index(step)];
  if (known.basis != basis.data() || known.direction != direction.data() || known.triangle != triangle.data() ||
      steps_there_.size() < steps_.size()) {
    known = {basis.data(), direction.data(), triangle.data()};
    steps_there_.upload(steps_);
  }
}

/// Enlarges the spaces, all of them a step at once, until each is done for this cycle.
void BlockGmres::run_cycle(const Problem& problem, const std::vector<Slot>& running) {
  std::vector<Slot> live = running;
  for (const Slot& slot : running) {
    dimensions_[index(slot.column)] = 0;
    estimates_[index(slot.column)] = slot.residual;
  }
  for (int k = 0; !live.empty(); ++k) {
    const int columns = static_cast<int>(live.size());
    prepare(problem, k + 1, columns);
    const Step& step = steps_[index(k)];
    if (problem.precondition != nullptr) {
      (*problem.precondition)(step.basis, step.direction, columns);
    }
    multiply(problem.step, step.direction, bases_[index(k + 1)].data(), columns);
    const Spaces spaces{steps_there_.data(), places_.data(),  reduced_.data(), rotations_.data(),
                        problem.n,           problem.columns, problem.most};
    extend_spaces<<<static_cast<unsigned>(columns), kColumnThreads, index(k + 1) * kSharedBytes, context_.stream()>>>(
        spaces, k, block_.slots(), block_.status());
    context_.launched("Krylov step");
    const std::vector<ColumnStatus>& said = block_.wait();
    ++result_.steps;
    for (std::size_t i = 0; i < live.size(); ++i) {
      const std::size_t s = index(live[i].column);
      check_finite(said[i].value);
      estimates_[s] = said[i].value;
      dimensions_[s] += said[i].extended;
      ++column_steps_[s];
    }
    if (problem.report) {
      double worst = 0.0;
      for (const Slot& slot : running) {
        worst = std::max(worst, estimates_[index(slot.column)]);
      }
      problem.report(result_.steps, worst);
    }
    drop(live, [&](const Slot& slot) {
      const std::size_t s = index(slot.column);
      return estimates_[s] <= problem.limits.tolerance || said[index(slot.from)].exhausted != 0 ||
             dimensions_[s] == problem.most || column_steps_[s] >= problem.limits.max_steps;
    });
    if (!live.empty() && index(columns) != live.size()) {
      block_.upload(live);
      block_.compact(problem.n, bases_[index(k + 1)].data());
    }
  }
}

/// Moves to the minimisers, forms their true residuals, and begins a new cycle for those that go on.
void BlockGmres::update(const Problem& problem, std::vector<Slot>& running) {
  int dimension = 0;
  for (Slot& slot : running) {
    slot.dimension = dimensions_[index(slot.column)];
    dimension = std::max(dimension, slot.dimension);
  }
  const int columns = static_cast<int>(running.size());
  candidate_.resize(index(problem.n) * index(columns));
  prepare(problem, 0, columns);
  block_.upload(running);
  const Spaces spaces{steps_there_.data(), places_.data(),  reduced_.data(), rotations_.data(),
                      problem.n,           problem.columns, problem.most};
  add_minimisers<<<static_cast<unsigned>(columns), kColumnThreads, index(dimension) * kSharedBytes,
                   context_.stream()>>>(spaces, block_.slots(), problem.x, candidate_.data());
  context_.launched("minimisers");
  cuComplex* residuals = bases_[0].data();
  multiply(problem.apply, candidate_.data(), residuals, columns);
  block_.judge(problem.n, problem.b, residuals, candidate_.data(), problem.x, residuals);
  const std::vector<ColumnStatus>& said = block_.wait();
  for (std::size_t i = 0; i < running.size(); ++i) {
    check_finite(said[i].value);
  }
  drop(running, [&](Slot& slot) {
    const double reached = said[index(slot.from)].value;
    const bool stagnated = reached > kStagnation * slot.residual;
    slot.residual = std::min(slot.residual, reached);
    result_.residuals[index(slot.column)] = slot.residual;
    return slot.residual <= problem.limits.tolerance || column_steps_[index(slot.column)] >= problem.limits.max_steps ||
           stagnated;
  });
  if (!running.empty()) {
    block_.upload(running);
    block_.compact(problem.n, residuals);
  }
}

void BlockGmres::multiply(const BlockProduct& product, const cuComplex* x, cuComplex* y, int columns) {
  product(x, y, columns);
  ++result_.products;
  result_.columns += columns;
}

void BlockGmres::check_finite(double value) const {
  if (!std::isfinite(value)) {
    throw std::domain_error("gmres: product " + std::to_string(result_.products) + " holds a value that is not finite");
  }
}

}  // namespace touchfield::cuda
