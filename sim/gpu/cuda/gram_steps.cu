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

}  // namespace touchfield::cuda
