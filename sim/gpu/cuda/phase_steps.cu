#include <algorithm>
#include <cmath>

#include "sim/gpu/cuda/launch.cuh"
#include "sim/gpu/cuda/normal_factor.cuh"
#include "sim/gpu/cuda/phase_steps.cuh"
#include "sim/gpu/cuda/products.cuh"

namespace touchfield::cuda {

namespace {

using Complex = std::complex<double>;

/// Re(diag(conj z) Q diag(z)), also rounded unless that is null.
__global__ void fill_normal(const double2* q, int size, const double2* z, double* exact, float* rounded) {
  const int j = static_cast<int>(blockIdx.x);
  const int i = static_cast<int>(blockIdx.y * blockDim.x + threadIdx.x);
  if (i >= size) {
    return;
  }
  const std::size_t at = i + std::size_t{1} * j * size;
  const double2 turned = q[at] * z[j];
  exact[at] = z[i].x * turned.x + z[i].y * turned.y;
  if (rounded != nullptr) {
    rounded[at] = static_cast<float>(exact[at]);
  }
}

class CardGram final : public GramDevice {
 public:
  CardGram(Context& context, Array<double2> q, int size) : context_(context), size_(size), q_(std::move(q)) {
    finite_ = all_finite(context_, q_.data(), q_.size());
    int largest = 1;  // counted from 1
    const int apart = 2 * (size_ + 1);
    check(cublasIdamax(context_.blas(), size_, &q_.data()->x, apart, &largest), "largest of a diagonal");
    largest_diagonal_ = q_.value((size_ + std::size_t{1}) * (largest - 1)).x;
  }

  int size() const override { return size_; }
  bool finite() const override { return finite_; }
  double largest_diagonal() const override { return largest_diagonal_; }

  /// Q is its own adjoint, whose products read it column by column.
  void multiply(const Complex* z, Complex* product) override {
    const auto size = static_cast<std::size_t>(size_);
    exchange(context_, z, size, z_, product, size, product_,
             [&] { multiply_adjoint(context_, q_.data(), size_, size_, size_, z_.data(), product_.data()); });
  }

  bool factorise(const Complex* z, double mu, bool in_double) override {
    context_.use();
    const std::size_t bytes = sizeof(double2) * size_;
    auto* host = static_cast<double2*>(context_.staging(bytes));
    std::memcpy(host, z, bytes);
    z_.upload(host, size_);
    factor_.resize(size_, 0, in_double);
    launch(context_, "normal matrix", fill_normal, dim3(size_, blocks_for(size_, kBlock)), kBlock, q_.data(), size_,
           z_.data(), factor_.exact(), factor_.rounded());
    return factor_.factorise(mu);
  }

  double correct(const double* right, double unit, double* h) override {
    context_.use();
    return factor_.correct(right, unit, h);
  }

 private:
  Context& context_;
  int size_;
  bool finite_ = true;
  double largest_diagonal_ = 0;
  Array<double2> q_;
  Array<double2> z_{context_}, product_{context_};
  NormalFactor factor_{context_};
};

/// sums(i) = sum_n |a_in|, sums(rows + i) = sum_n |a_in|^2: a block a row.
template <typename Value>
__global__ void __launch_bounds__(kColumnThreads) sum_rows(const Value* a, int rows, int columns, double* sums) {
  const int row = static_cast<int>(blockIdx.x);
  double reach = 0;
  double strength = 0;
  for (int n = static_cast<int>(threadIdx.x); n < columns; n += kColumnThreads) {
    const double size = magnitude(a[row + std::size_t{1} * n * rows]);
    reach += size;
    strength += size * size;
  }
  reach = block_sum(reach);
  strength = block_sum(strength);
  if (threadIdx.x == 0) {
    sums[row] = reach;
    sums[rows + row] = strength;
  }
}

/// J diag(scale), a row a face, then two a kept row of R; also rounded unless that is null. A column makes the move
/// `moves` of the drive of its channel.
__global__ void fill_jacobian(const double2* a, int ld, int faces, int kept, const double2* directions,
                              const double2* moves, const int* channels, double* exact, float* rounded) {
  const int column = static_cast<int>(blockIdx.x);
  const int row = static_cast<int>(blockIdx.y * blockDim.x + threadIdx.x);
  if (row >= faces + kept) {
    return;
  }
  const double2 moved = moves[column] * a[row + std::size_t{1} * channels[column] * ld];
  const std::size_t first = std::size_t{1} * column * (faces + 2 * kept);
  const auto write = [&](int at, double value) {
    exact[first + at] = value;
    if (rounded != nullptr) {
      rounded[first + at] = static_cast<float>(value);
    }
  };
  if (row < faces) {
    write(row, directions[row].x * moved.x + directions[row].y * moved.y);
  } else {
    write(2 * row - faces, moved.x);
    write(2 * row - faces + 1, moved.y);
  }
}

__global__ void scale_rows(const double2* a, int rows, int columns, const double* scale, float2* scaled) {
  const std::size_t i = std::size_t{blockIdx.x} * blockDim.x + threadIdx.x;
  if (i < std::size_t{1} * rows * columns) {
    const double by = scale[i % rows];
    scaled[i] = {static_cast<float>(by * a[i].x), static_cast<float>(by * a[i].y)};
  }
}

class CardSkin final : public SkinDevice {
 public:
  CardSkin(Context& context, const double2* target, int faces, const double2* outside, int rank, int channels)
      : context_(context),
        faces_(faces),
        rows_(faces + rank),
        channels_(channels),
        matrix_(context, std::size_t{1} * rows_ * channels) {
    stack(target, faces, 0);
    stack(outside, rank, faces);
    sums_ = sums_of_rows(matrix_.data(), rows_, channels_);
  }

  const double* reach() const override { return sums_.data(); }
  const double* strengths() const override { return sums_.data() + rows_; }

  void send(const Complex* q, int rows, Complex* sent) override {
    exchange(context_, q, static_cast<std::size_t>(channels_), input_, sent, static_cast<std::size_t>(rows), output_,
             [&] { multiply(context_, matrix_.data(), rows_, rows, channels_, input_.data(), output_.data()); });
  }

  void send_back(const Complex* v, int first, int rows, Complex* x) override {
    exchange(context_, v, static_cast<std::size_t>(rows), input_, x, static_cast<std::size_t>(channels_), output_, [&] {
      multiply_adjoint(context_, matrix_.data() + first, rows_, rows, channels_, input_.data(), output_.data());
    });
  }

  double largest_row(const SkinMoves& moves) override {
    context_.use();
    SkinMoves all = moves;
    all.outside_rows = rows_ - faces_;
    fill(all, nullptr, false);
    const int rows = faces_ + 2 * all.outside_rows;
    const std::vector<double> sums = sums_of_rows(factor_.exact(), rows, channels_ + moves.radial_count);
    return *std::max_element(sums.begin() + rows, sums.end());
  }

  bool factorise(const SkinMoves& moves, const double* scale, bool in_double) override {
    context_.use();
    fill(moves, scale, in_double);
    return factor_.factorise(1.0);
  }

  double correct(const double* right, double unit, double* inner) override {
    context_.use();
    return factor_.correct(right, unit, inner);
  }

  void scale_single(const double* scale) override {
    context_.use();
    Array<double> there(context_);
    there.upload(scale, static_cast<std::size_t>(rows_));
    single_.resize(matrix_.size());
    launch(context_, "rows in single precision", scale_rows, blocks_for(matrix_.size(), kBlock), kBlock, matrix_.data(),
           rows_, channels_, there.data(), single_.data());
  }

  void send_single(int width, const std::complex<float>* y, std::complex<float>* sent) override {
    const auto vectors = static_cast<std::size_t>(width);
    exchange(context_, y, vectors * channels_, single_input_, sent, vectors * rows_, single_output_, [&] {
      multiply(context_, single_.data(), rows_, rows_, channels_, single_input_.data(), single_output_.data(), width);
    });
  }

  void send_back_single(int width, const std::complex<float>* v, std::complex<float>* back) override {
    const auto vectors = static_cast<std::size_t>(width);
    exchange(context_, v, vectors * rows_, single_input_, back, vectors * channels_, single_output_, [&] {
      multiply_adjoint(context_, single_.data(), rows_, rows_, channels_, single_input_.data(), single_output_.data(),
                       width);
    });
  }

 private:
  /// Rows from `first` on.
  void stack(const double2* from, int rows, int first) {
    if (rows > 0) {
      check(cudaMemcpy2DAsync(matrix_.data() + first, sizeof(double2) * rows_, from, sizeof(double2) * rows,
                              sizeof(double2) * rows, channels_, cudaMemcpyDefault, context_.stream()),
            "upload");
    }
  }

  template <typename Value>
  std::vector<double> sums_of_rows(const Value* a, int rows, int columns) {
    Array<double> there(context_, std::size_t{2} * rows);
    launch(context_, "sums of rows", sum_rows<Value>, rows, kColumnThreads, a, rows, columns, there.data());
    std::vector<double> sums(there.size());
    there.download(sums.data(), sums.size());
    return sums;
  }

  /// Gives J diag(scale) to the factor; J itself where scale is null.
  void fill(const SkinMoves& moves, const double* scale, bool in_double) {
    const int columns = channels_ + moves.radial_count;
    const std::size_t numbers = std::size_t{1} * faces_ + columns;
    const std::size_t bytes = sizeof(double2) * numbers + sizeof(int) * columns;
    char* host = static_cast<char*>(context_.staging(bytes));
    auto* directions = reinterpret_cast<double2*>(host);
    auto* channels = reinterpret_cast<int*>(directions + numbers);
    std::memcpy(directions, moves.directions, sizeof(double2) * faces_);
    for (int c = 0; c < columns; ++c) {
      const bool turns = c < channels_;
      channels[c] = turns ? c : static_cast<int>(moves.radial[c - channels_]);
      const Complex move = (scale != nullptr ? scale[c] : 1.0) * moves.phasors[channels[c]];
      directions[faces_ + c] = turns ? double2{-move.imag(), move.real()} : double2{move.real(), move.imag()};
    }
    moves_.upload(host, bytes);
    const auto* there = reinterpret_cast<const double2*>(moves_.data());
    const int kept = moves.outside_rows;
    factor_.resize(faces_ + 2 * kept, columns, in_double);
    const dim3 blocks(columns, blocks_for(faces_ + kept, kBlock));
    launch(context_, "Jacobian", fill_jacobian, blocks, kBlock, matrix_.data(), rows_, faces_, kept, there,
           there + faces_, reinterpret_cast<const int*>(there + numbers), factor_.exact(), factor_.rounded());
  }

  Context& context_;
  int faces_, rows_, channels_;
  Array<double2> matrix_;     // [H_T; R]
  std::vector<double> sums_;  // of the magnitudes in its rows, then of their squares
  Array<double2> input_{context_}, output_{context_};
  Array<float2> single_{context_};  // the matrix with its rows scaled
  Array<float2> single_input_{context_}, single_output_{context_};
  Array<char> moves_{context_};  // the directions before them, the channels behind
  NormalFactor factor_{context_};
};

}  // namespace

std::unique_ptr<GramDevice> make_gram_device(Context& context, Array<cuDoubleComplex> q, int size) {
  context.use();
  return std::make_unique<CardGram>(context, std::move(q), size);
}

Array<cuDoubleComplex> paper_gram(Context& context, const PaperMatrices& matrices) {
  context.use();
  const int rows = matrices.rows;
  const int unknowns = matrices.targets + matrices.channels;
  std::vector<cuComplex> factors;  // sqrt w, -sqrt w, p'
  for (const float sign : {1.0F, -1.0F}) {
    for (int i = 0; i < rows; ++i) {
      factors.push_back({sign * static_cast<float>(std::sqrt(matrices.weights[i])), 0.0F});
    }
  }
  for (int k = 0; k < matrices.targets; ++k) {
    factors.push_back({static_cast<float>(matrices.amplitudes[k]), 0.0F});
  }
  Array<cuComplex> by(context);
  by.upload(factors);
  Array<cuComplex> c(context, std::size_t{1} * rows * unknowns);
  cuComplex* const right = c.data() + std::size_t{1} * rows * matrices.targets;
  const auto scale = [&](cublasSideMode_t side, int columns, const cuComplex* from, int first, cuComplex* to) {
    check(cublasCdgmm(context.blas(), side, rows, columns, from, rows, by.data() + first, 1, to, rows),
          "rows of paper");
  };
  scale(CUBLAS_SIDE_LEFT, matrices.targets, matrices.columns, 0, c.data());
  scale(CUBLAS_SIDE_RIGHT, matrices.targets, c.data(), 2 * rows, c.data());
  scale(CUBLAS_SIDE_LEFT, matrices.channels, matrices.g, rows, right);
  Array<cuComplex> q(context, std::size_t{1} * unknowns * unknowns);
  gram(context, rows, unknowns, c.data(), rows, q.data(), unknowns);
  Array<cuDoubleComplex> wide(context, q.size());
  convert(context, q.data(), wide.data(), q.size());
  return wide;
}

std::unique_ptr<SkinDevice> Context::skin(const Complex* target, int faces, const Complex* outside, int rank,
                                          int channels) {
  use();
  return std::make_unique<CardSkin>(*this, reinterpret_cast<const double2*>(target), faces,
                                    reinterpret_cast<const double2*>(outside), rank, channels);
}

}  // namespace touchfield::cuda
