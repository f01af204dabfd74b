#include <algorithm>
#include <cmath>
#include <cstring>

#include "sim/gpu/cuda/normal_factor.cuh"
#include "sim/gpu/cuda/phase_steps.cuh"
#include "sim/gpu/cuda/skin_kernels.cuh"

namespace touchfield::cuda {

namespace {

using Complex = std::complex<double>;

cublasStatus_t rank_update(cublasHandle_t blas, cublasOperation_t op, int n, int k, const float* a, int lda, float* c) {
  const float one = 1;
  const float zero = 0;
  return cublasSsyrk(blas, CUBLAS_FILL_MODE_LOWER, op, n, k, &one, a, lda, &zero, c, n);
}
cublasStatus_t rank_update(cublasHandle_t blas, cublasOperation_t op, int n, int k, const double* a, int lda,
                           double* c) {
  const double one = 1;
  const double zero = 0;
  return cublasDsyrk(blas, CUBLAS_FILL_MODE_LOWER, op, n, k, &one, a, lda, &zero, c, n);
}

template <typename Real>
struct Step {
  explicit Step(Context& context) : jacobian(context), factor(context) {}

  Array<Real> jacobian;  // J diag(scale)
  NormalFactor<Real> factor;
};

class CardSkin final : public SkinDevice {
 public:
  template <typename Entry>
  CardSkin(Context& context, const Entry* target, int faces, const Entry* quiet, int rank, int channels)
      : context_(context), faces_(faces), rows_(faces + rank), channels_(channels) {
    matrix_.resize(std::size_t{1} * rows_ * channels);
    stack(target, faces, 0);
    stack(quiet, rank, faces);
    Array<double> sums(context_, std::size_t{2} * rows_);
    sum_rows<<<static_cast<unsigned>(rows_), kBlock, 0, context_.stream()>>>(matrix_.data(), rows_, channels_,
                                                                             sums.data());
    context_.launched("sums of rows");
    std::vector<double> both(sums.size());
    sums.download(both.data(), both.size());
    finite_ = true;
    for (std::size_t i = 0; i < both.size(); i += 2) {
      finite_ = finite_ && std::isfinite(both[i]);
      reach_.push_back(both[i]);
      strengths_.push_back(both[i + 1]);
    }
  }

  bool finite() const override { return finite_; }
  const double* reach() const override { return reach_.data(); }
  const double* strengths() const override { return strengths_.data(); }

  void send(const Complex* q, int quiet_rows, Complex* u, Complex* t) override {
    context_.use();
    const int rows = faces_ + quiet_rows;
    auto* host = static_cast<double2*>(context_.staging(sizeof(double2) * std::max(rows, channels_)));
    std::memcpy(host, q, sizeof(double2) * channels_);
    input_.upload(host, channels_);
    field_.resize(rows);
    launch_product(context_, matrix_.data(), rows_, rows, channels_, 1, input_.data(), parts_, field_.data());
    field_.download(host, rows);
    std::memcpy(static_cast<void*>(u), host, sizeof(double2) * faces_);
    if (quiet_rows > 0) {
      std::memcpy(static_cast<void*>(t), host + faces_, sizeof(double2) * quiet_rows);
    }
  }

  void send_back(const Complex* u, const Complex* t, int first, int quiet_rows, Complex* x) override {
    context_.use();
    const int begin = u != nullptr ? 0 : faces_ + first;
    const int rows = faces_ + first + quiet_rows - begin;
    if (rows == 0) {
      std::fill(x, x + channels_, Complex(0));
      return;
    }
    auto* host = static_cast<double2*>(context_.staging(sizeof(double2) * std::max(rows, channels_)));
    if (u != nullptr) {
      std::memcpy(host, u, sizeof(double2) * faces_);
      std::fill(host + faces_, host + faces_ + first, double2{0, 0});
    }
    if (quiet_rows > 0) {
      std::memcpy(host + rows - quiet_rows, t, sizeof(double2) * quiet_rows);
    }
    input_.upload(host, rows);
    drives_.resize(channels_);
    launch_adjoint(context_, matrix_.data() + begin, rows_, rows, channels_, 1, input_.data(), drives_.data());
    drives_.download(host, channels_);
    std::memcpy(static_cast<void*>(x), host, sizeof(double2) * channels_);
  }

  double largest_row(const SkinMoves& moves) override {
    context_.use();
    const SkinModel model = upload(moves, nullptr);
    moves_.resize(std::size_t{2} * rows_);
    square_rows<<<static_cast<unsigned>(rows_), kBlock, 0, context_.stream()>>>(matrix_.data(), rows_, model,
                                                                                moves_.data());
    context_.launched("rows of the Jacobian");
    auto* host = static_cast<double*>(context_.staging(sizeof(double) * moves_.size()));
    moves_.download(host, moves_.size());
    return *std::max_element(host, host + moves_.size());
  }

  bool factorise(const SkinMoves& moves, const double* scale, bool in_double) override {
    context_.use();
    model_ = upload(moves, scale);
    in_double_ = in_double;
    return in_double ? factorise(double_) : factorise(single_);
  }

  double correct(const double* right, double unit, double* moves) override {
    context_.use();
    const int size = std::min(model_rows(), model_.columns);
    auto* host = static_cast<double*>(context_.staging(sizeof(double) * (std::max(size, model_.columns) + 1)));
    if (right != nullptr) {
      std::memcpy(host, right, sizeof(double) * size);
      right_.upload(host, size);
      remainder_.resize(size);
      check(cudaMemcpyAsync(remainder_.data(), right_.data(), sizeof(double) * size, cudaMemcpyDeviceToDevice,
                            context_.stream()),
            "copy");
      y_.resize(size);
      y_.set_zero();
    }
    moves_.resize(model_.columns + std::size_t{1});  // the norm behind them
    if (in_double_) {
      correct_by(double_.factor, unit);
    } else {
      correct_by(single_.factor, unit);
    }
    moves_.download(host, moves_.size());
    std::memcpy(moves, host, sizeof(double) * model_.columns);
    return host[model_.columns];
  }

  void scale_single(const double* target_scale, double quiet_scale) override {
    context_.use();
    auto* host = static_cast<double*>(context_.staging(sizeof(double) * faces_));
    std::memcpy(host, target_scale, sizeof(double) * faces_);
    right_.upload(host, faces_);
    single_matrix_.resize(matrix_.size());
    scale_rows<<<blocks_for(matrix_.size(), kBlock), kBlock, 0, context_.stream()>>>(
        matrix_.data(), rows_, channels_, faces_, right_.data(), quiet_scale, single_matrix_.data());
    context_.launched("rows in single precision");
    context_.synchronize();  // the host's memory is free again
  }

  void send_single(int width, const std::complex<float>* y, std::complex<float>* sent) override {
    context_.use();
    exchange(width, channels_, y, rows_, sent, [&] {
      launch_product(context_, single_matrix_.data(), rows_, rows_, channels_, width, single_input_.data(),
                     single_parts_, single_output_.data());
    });
  }

  void send_back_single(int width, const std::complex<float>* v, std::complex<float>* back) override {
    context_.use();
    exchange(width, rows_, v, channels_, back, [&] {
      launch_adjoint(context_, single_matrix_.data(), rows_, rows_, channels_, width, single_input_.data(),
                     single_output_.data());
    });
  }

 private:
  int model_rows() const { return model_.faces + 2 * model_.kept; }
  bool by_rows() const { return model_rows() <= model_.columns; }

  /// Rows from `first` on, in double of the host or of the card.
  void stack(const double2* from, int rows, int first) {
    if (rows > 0) {
      check(cudaMemcpy2DAsync(matrix_.data() + first, sizeof(double2) * rows_, from, sizeof(double2) * rows,
                              sizeof(double2) * rows, channels_, cudaMemcpyDefault, context_.stream()),
            "upload");
    }
  }
  /// In single precision of the card.
  void stack(const float2* from, int rows, int first) {
    if (rows > 0) {
      stack_rows<<<blocks_for(std::size_t{1} * rows * channels_, kBlock), kBlock, 0, context_.stream()>>>(
          from, rows, channels_, first, rows_, matrix_.data());
      context_.launched("rows in double precision");
    }
  }

  /// One copy for all of it.
  SkinModel upload(const SkinMoves& moves, const double* scale) {
    const int columns = channels_ + moves.radial_count;
    const std::size_t complex_bytes = sizeof(double2) * (faces_ + channels_);
    const std::size_t scale_bytes = sizeof(double) * columns;
    const std::size_t bytes = complex_bytes + scale_bytes + sizeof(int) * columns;
    char* host = static_cast<char*>(context_.staging(bytes));
    std::memcpy(host, moves.directions, sizeof(double2) * faces_);
    std::memcpy(host + sizeof(double2) * faces_, moves.phasors, sizeof(double2) * channels_);
    if (scale != nullptr) {
      std::memcpy(host + complex_bytes, scale, scale_bytes);
    } else {
      std::memset(host + complex_bytes, 0, scale_bytes);
    }
    int* column_of = reinterpret_cast<int*>(host + complex_bytes + scale_bytes);
    int* channel_of = column_of + channels_;
    std::fill(column_of, column_of + channels_, -1);
    for (int i = 0; i < moves.radial_count; ++i) {
      channel_of[i] = static_cast<int>(moves.radial[i]);
      column_of[channel_of[i]] = channels_ + i;
    }
    model_bytes_.upload(host, bytes);
    const char* there = model_bytes_.data();
    const auto* complex = reinterpret_cast<const double2*>(there);
    const auto* indices = reinterpret_cast<const int*>(there + complex_bytes + scale_bytes);
    return {complex,
            complex + faces_,
            reinterpret_cast<const double*>(there + complex_bytes),
            indices + channels_,
            indices,
            faces_,
            moves.quiet_rows,
            channels_,
            columns};
  }

  template <typename Real>
  bool factorise(Step<Real>& step) {
    const int rows = model_rows();
    const int columns = model_.columns;
    const int size = std::min(rows, columns);
    step.jacobian.resize(std::size_t{1} * rows * columns);
    const dim3 blocks(static_cast<unsigned>(columns),
                      blocks_for(static_cast<std::size_t>(faces_ + model_.kept), kBlock));
    fill_jacobian<<<blocks, kBlock, 0, context_.stream()>>>(matrix_.data(), rows_, model_, step.jacobian.data());
    context_.launched("Jacobian");
    Real* normal = step.factor.matrix(size);
    check(rank_update(context_.blas(), by_rows() ? CUBLAS_OP_N : CUBLAS_OP_T, size, std::max(rows, columns),
                      step.jacobian.data(), rows, normal),
          "normal matrix");
    add_identity<<<blocks_for(static_cast<std::size_t>(size), kBlock), kBlock, 0, context_.stream()>>>(size, normal);
    context_.launched("normal matrix");
    return step.factor.factorise();
  }

  template <typename Real>
  void correct_by(NormalFactor<Real>& factor, double unit) {
    const Real* x = factor.solve(remainder_.data(), unit);
    const int rows = faces_ + model_.kept;
    const unsigned by_row = blocks_for(static_cast<std::size_t>(rows), kBlock);
    const unsigned by_channel = blocks_for(static_cast<std::size_t>(channels_), kBlock);
    const cudaStream_t stream = context_.stream();
    double* norm = moves_.data() + model_.columns;
    field_.resize(rows);
    drives_.resize(channels_);
    if (by_rows()) {
      input_.resize(channels_);
      spread_rows<<<by_row, kBlock, 0, stream>>>(model_, x, unit, y_.data(), field_.data());
      context_.launched("correction");
      launch_adjoint(context_, matrix_.data(), rows_, rows, channels_, 1, field_.data(), drives_.data());
      move_back<<<by_channel, kBlock, 0, stream>>>(model_, drives_.data(), moves_.data(), input_.data());
      context_.launched("correction");
      launch_shares(context_, matrix_.data(), rows_, rows, channels_, 1, input_.data(), parts_);
      end_rows<<<1, kWide, 0, stream>>>(model_, parts_.data(), shares_of(channels_), right_.data(), y_.data(),
                                        remainder_.data(), norm);
    } else {
      move_columns<<<by_channel, kBlock, 0, stream>>>(model_, x, unit, y_.data(), moves_.data(), drives_.data());
      context_.launched("correction");
      launch_shares(context_, matrix_.data(), rows_, rows, channels_, 1, drives_.data(), parts_);
      keep_along<<<by_row, kBlock, 0, stream>>>(model_, parts_.data(), shares_of(channels_), field_.data());
      context_.launched("correction");
      launch_adjoint(context_, matrix_.data(), rows_, rows, channels_, 1, field_.data(), drives_.data());
      end_columns<<<1, kWide, 0, stream>>>(model_, drives_.data(), right_.data(), y_.data(), remainder_.data(), norm);
    }
    context_.launched("correction");
  }

  /// `width` vectors there and what `multiply` makes of them back.
  template <typename Multiply>
  void exchange(int width, int in, const std::complex<float>* from, int out, std::complex<float>* to,
                const Multiply& multiply) {
    auto* host = static_cast<float2*>(context_.staging(sizeof(float2) * width * std::max(in, out)));
    std::memcpy(host, from, sizeof(float2) * width * in);
    single_input_.upload(host, std::size_t{1} * width * in);
    single_output_.resize(std::size_t{1} * width * out);
    multiply();
    single_output_.download(host, std::size_t{1} * width * out);
    std::memcpy(static_cast<void*>(to), host, sizeof(float2) * width * out);
  }

  Context& context_;
  int faces_;
  int rows_;
  int channels_;
  bool finite_ = false;
  std::vector<double> reach_;
  std::vector<double> strengths_;
  Array<double2> matrix_{context_};        // [H_T; R]
  Array<float2> single_matrix_{context_};  // its rows scaled
  Array<double2> input_{context_};
  Array<char> model_bytes_{context_};
  Array<double2> drives_{context_};
  Array<double2> field_{context_};
  Array<double2> parts_{context_};
  Array<float2> single_input_{context_};
  Array<float2> single_output_{context_};
  Array<float2> single_parts_{context_};
  Array<double> right_{context_};
  Array<double> y_{context_};
  Array<double> remainder_{context_};
  Array<double> moves_{context_};
  Step<float> single_{context_};
  Step<double> double_{context_};
  SkinModel model_{};
  bool in_double_ = false;  // the last factor
};

}  // namespace

std::unique_ptr<SkinDevice> make_skin_device(Context& context, const cuDoubleComplex* target, int faces,
                                             const cuDoubleComplex* quiet, int rank, int channels) {
  context.use();
  return std::make_unique<CardSkin>(context, target, faces, quiet, rank, channels);
}

std::unique_ptr<SkinDevice> make_skin_device(Context& context, const cuComplex* target, int faces,
                                             const cuComplex* quiet, int rank, int channels) {
  context.use();
  return std::make_unique<CardSkin>(context, target, faces, quiet, rank, channels);
}

}  // namespace touchfield::cuda
