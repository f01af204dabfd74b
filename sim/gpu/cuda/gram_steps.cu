#include <algorithm>
#include <cmath>
#include <cstring>

#include "sim/gpu/cuda/norm_sums.cuh"
#include "sim/gpu/cuda/normal_factor.cuh"
#include "sim/gpu/cuda/phase_steps.cuh"
#include "sim/gpu/cuda/products.cuh"

namespace touchfield::cuda {

namespace {

using Complex = std::complex<double>;

constexpr unsigned kWide = 1024;  // threads of the one block that ends a correction

/// sums(2 j) = sum_i |q_ij|, but for a factor, which tells whether all is finite; sums(2 j + 1) = q_jj: a block a column.
template <typename Entry>
__global__ void look_through(const Entry* q, int size, double* sums) {
  const int column = static_cast<int>(blockIdx.x);
  const Entry* entries = q + std::size_t{1} * column * size;
  double sum = 0;
  for (int i = static_cast<int>(threadIdx.x); i < size; i += static_cast<int>(blockDim.x)) {
    sum += fabs(double{entries[i].x}) + fabs(double{entries[i].y});
  }
  sum = block_sum(sum);
  if (threadIdx.x == 0) {
    sums[2 * column] = sum;
    sums[2 * column + 1] = entries[column].x;
  }
}

/// The lower triangle of Re(diag(conj z) Q diag(z)) + mu I.
template <typename Entry, typename Real>
__global__ void fill_normal(const Entry* q, int size, const double2* z, double mu, Real* normal) {
  const int j = static_cast<int>(blockIdx.x);
  const int i = static_cast<int>(blockIdx.y * blockDim.x + threadIdx.x);
  if (i >= size || i < j) {
    return;
  }
  const Entry entry = q[i + std::size_t{1} * j * size];
  const double2 column{double{entry.x} * z[j].x - double{entry.y} * z[j].y,
                       double{entry.x} * z[j].y + double{entry.y} * z[j].x};
  const Real value = static_cast<Real>(z[i].x * column.x + z[i].y * column.y);
  normal[i + std::size_t{1} * j * size] = i == j ? value + static_cast<Real>(mu) : value;
}

/// h += unit x and turned = z h.
template <typename Real>
__global__ void turn(int size, const Real* x, double unit, const double2* z, double* h, double2* turned) {
  const int i = static_cast<int>(blockIdx.x * blockDim.x + threadIdx.x);
  if (i < size) {
    const double value = h[i] + unit * static_cast<double>(x[i]);
    h[i] = value;
    turned[i] = {z[i].x * value, z[i].y * value};
  }
}

/// remainder = right - mu h - Re(conj(z) product), and its norm: one block.
__global__ __launch_bounds__(kWide) void end_correction(int size, const double2* z, const double2* product, double mu,
                                                        const double* h, const double* right, double* remainder,
                                                        double* norm) {
  double sum = 0;
  for (int i = static_cast<int>(threadIdx.x); i < size; i += static_cast<int>(blockDim.x)) {
    const double rest = right[i] - mu * h[i] - (z[i].x * product[i].x + z[i].y * product[i].y);
    remainder[i] = rest;
    sum += rest * rest;
  }
  sum = block_sum(sum);
  if (threadIdx.x == 0) {
    *norm = sqrt(sum);
  }
}

/// C of PaperMatrices; without `columns` a column has its one entry at its face.
__global__ void weigh(int rows, int targets, const float2* columns, const int* faces, const float2* g,
                      const double* roots, const double* amplitudes, float2* c) {
  const int column = static_cast<int>(blockIdx.x);
  const int row = static_cast<int>(blockIdx.y * blockDim.x + threadIdx.x);
  if (row >= rows) {
    return;
  }
  const std::size_t at = row + std::size_t{1} * column * rows;
  if (column >= targets) {
    const float2 entry = g[at - std::size_t{1} * targets * rows];
    const float factor = static_cast<float>(-roots[row]);
    c[at] = {factor * entry.x, factor * entry.y};
    return;
  }
  const float factor = static_cast<float>(roots[row] * amplitudes[column]);
  const float2 entry = columns != nullptr ? columns[at] : float2{row == faces[column] ? 1.0F : 0.0F, 0.0F};
  c[at] = {factor * entry.x, factor * entry.y};
}

template <typename Entry>
class CardGram final : public GramDevice {
 public:
  CardGram(Context& context, Array<Entry> q, int size) : context_(context), size_(size), q_(std::move(q)) {
    Array<double> sums(context_, std::size_t{2} * size_);
    look_through<<<static_cast<unsigned>(size_), kBlock, 0, context_.stream()>>>(q_.data(), size_, sums.data());
    context_.launched("Gram matrix");
    auto* host = static_cast<double*>(context_.staging(sizeof(double) * sums.size()));
    sums.download(host, sums.size());
    largest_diagonal_ = host[1];
    for (int i = 0; i < size_; ++i) {
      finite_ = finite_ && std::isfinite(host[2 * i]);
      largest_diagonal_ = std::max(largest_diagonal_, host[2 * i + 1]);
    }
  }

  int size() const override { return size_; }
  bool finite() const override { return finite_; }
  double largest_diagonal() const override { return largest_diagonal_; }

  void multiply(const Complex* z, Complex* product) override {
    context_.use();
    double2* host = upload(z, turned_);
    launch_product(turned_);
    product_.download(host, size_);
    std::memcpy(static_cast<void*>(product), host, sizeof(double2) * size_);
  }

  bool factorise(const Complex* z, double mu, bool in_double) override {
    context_.use();
    upload(z, z_);
    mu_ = mu;
    in_double_ = in_double;
    return in_double ? factorise(double_) : factorise(single_);
  }

  double correct(const double* right, double unit, double* h) override {
    context_.use();
    const std::size_t bytes = sizeof(double) * size_;
    auto* host = static_cast<double*>(context_.staging(bytes + sizeof(double)));
    if (right != nullptr) {
      std::memcpy(host, right, bytes);
      right_.upload(host, size_);
      remainder_.resize(size_);
      check(cudaMemcpyAsync(remainder_.data(), right_.data(), bytes, cudaMemcpyDeviceToDevice, context_.stream()),
            "copy");
      answer_.resize(size_ + std::size_t{1});  // h and the norm behind it
      answer_.set_zero();
    }
    if (in_double_) {
      add_solution(double_.solve(remainder_.data(), unit), unit);
    } else {
      add_solution(single_.solve(remainder_.data(), unit), unit);
    }
    launch_product(turned_);
    end_correction<<<1, kWide, 0, context_.stream()>>>(size_, z_.data(), product_.data(), mu_, answer_.data(),
                                                       right_.data(), remainder_.data(), answer_.data() + size_);
    context_.launched("correction");
    answer_.download(host, answer_.size());
    std::memcpy(h, host, bytes);
    return host[size_];
  }

 private:
  /// Returns staging memory of the same size.
  double2* upload(const Complex* z, Array<double2>& to) {
    auto* host = static_cast<double2*>(context_.staging(sizeof(double2) * size_));
    std::memcpy(host, z, sizeof(double2) * size_);
    to.upload(host, size_);
    return host;
  }

  /// Q is its own adjoint, whose products read it column by column.
  void launch_product(const Array<double2>& z) {
    product_.resize(size_);
    launch_adjoint(context_, q_.data(), size_, size_, size_, 1, z.data(), product_.data());
  }

  template <typename Real>
  bool factorise(NormalFactor<Real>& factor) {
    Real* normal = factor.matrix(size_);
    const dim3 blocks(static_cast<unsigned>(size_), blocks_for(static_cast<std::size_t>(size_), kBlock));
    fill_normal<<<blocks, kBlock, 0, context_.stream()>>>(q_.data(), size_, z_.data(), mu_, normal);
    context_.launched("normal matrix");
    return factor.factorise();
  }

  template <typename Real>
  void add_solution(const Real* x, double unit) {
    turned_.resize(size_);
    turn<<<blocks_for(static_cast<std::size_t>(size_), kBlock), kBlock, 0, context_.stream()>>>(
        size_, x, unit, z_.data(), answer_.data(), turned_.data());
    context_.launched("correction");
  }

  Context& context_;
  int size_;
  bool finite_ = true;
  double largest_diagonal_ = 0;
  Array<Entry> q_;
  Array<double2> z_{context_};  // of the last factor
  Array<double2> product_{context_};
  Array<double2> turned_{context_};
  Array<double> right_{context_};
  Array<double> remainder_{context_};
  Array<double> answer_{context_};
  NormalFactor<float> single_{context_};
  NormalFactor<double> double_{context_};
  double mu_ = 0;
  bool in_double_ = false;
};

class CardPhase final : public PhaseDevice {
 public:
  explicit CardPhase(Context& context) : context_(context) {}

  std::unique_ptr<SkinDevice> skin(const Complex* target, int faces, const Complex* quiet, int rank,
                                   int channels) override {
    return make_skin_device(context_, reinterpret_cast<const double2*>(target), faces,
                            reinterpret_cast<const double2*>(quiet), rank, channels);
  }

  std::unique_ptr<GramDevice> gram(const Complex* q, int size, Storage storage) override {
    context_.use();
    const std::size_t entries = std::size_t{1} * size * size;
    Array<double2> there(context_);
    there.upload(reinterpret_cast<const double2*>(q), entries);
    if (storage == Storage::kDouble) {
      return make_gram_device(context_, std::move(there), size);
    }
    Array<float2> rounded(context_, entries);
    convert(context_, there.data(), rounded.data(), entries);
    return make_gram_device(context_, std::move(rounded), size);
  }

 private:
  Context& context_;
};

}  // namespace

std::unique_ptr<GramDevice> make_gram_device(Context& context, Array<cuDoubleComplex> q, int size) {
  context.use();
  return std::make_unique<CardGram<double2>>(context, std::move(q), size);
}

std::unique_ptr<GramDevice> make_gram_device(Context& context, Array<cuComplex> q, int size) {
  context.use();
  return std::make_unique<CardGram<float2>>(context, std::move(q), size);
}

Array<cuComplex> paper_gram(Context& context, const PaperMatrices& matrices) {
  context.use();
  const int unknowns = matrices.targets + matrices.channels;
  std::vector<double> factors(matrices.weights, matrices.weights + matrices.rows);
  for (double& factor : factors) {
    factor = std::sqrt(factor);
  }
  factors.insert(factors.end(), matrices.amplitudes, matrices.amplitudes + matrices.targets);
  Array<double> there(context);
  there.upload(factors);
  Array<int> faces(context);
  if (matrices.columns == nullptr && matrices.targets > 0) {
    faces.upload(matrices.faces, static_cast<std::size_t>(matrices.targets));
  }
  Array<cuComplex> c(context, std::size_t{1} * matrices.rows * unknowns);
  const dim3 blocks(static_cast<unsigned>(unknowns), blocks_for(static_cast<std::size_t>(matrices.rows), kBlock));
  weigh<<<blocks, kBlock, 0, context.stream()>>>(matrices.rows, matrices.targets, matrices.columns, faces.data(),
                                                 matrices.g, there.data(), there.data() + matrices.rows, c.data());
  context.launched("rows of the paper's problem");
  Array<cuComplex> q(context, std::size_t{1} * unknowns * unknowns);
  gram(context, matrices.rows, unknowns, c.data(), matrices.rows, q.data(), unknowns);
  return q;
}

std::unique_ptr<PhaseDevice> Context::phase_device() { return std::make_unique<CardPhase>(*this); }

}  // namespace touchfield::cuda
