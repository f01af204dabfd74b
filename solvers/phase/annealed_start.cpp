#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstddef>
#include <memory>
#include <random>
#include <stdexcept>
#include <utility>
#include <vector>

#include <Eigen/Eigenvalues>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/random_share.h"
#include "solvers/phase/phase_solution.h"
#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"

namespace touchfield {

namespace {

using Single = std::complex<float>;
using Eigen::Index;
using Eigen::MatrixXcf;
using Eigen::VectorXf;

constexpr std::array kBounds = {0.8F, 0.65F, 0.5F, 0.4F, 0.3F, 0.2F, 0.1F, 0.0F};
constexpr Index kPass = 16;   // columns of A that stay in a core's cache for their second use
constexpr Index kShares = 8;  // sums over the drives, so many whatever the number of threads
constexpr int kPowerSteps = 5;
constexpr unsigned kSeeds = 5;
constexpr int kFollowed = 2;  // of them
constexpr int kLevelTrials = 8;
constexpr double kNearLevel = 0.9;
constexpr double kTooStrong = 0.5;  // above it phases find a use for full drive
constexpr float kGrow = 1.05F;      // of the length of a step that lowered F
constexpr float kShrink = 0.7F;

/// Makes a row of length one, what is beyond its first number of length `bound` at most.
void confine(Eigen::Ref<Eigen::RowVectorXcf, 0, Eigen::InnerStride<>> row, float bound) {
  const float length = row.norm();
  if (!(length > 0)) {
    row.setZero();
    row(0) = 1;
    return;
  }
  row /= length;
  auto rest = row.tail(row.size() - 1);
  const float others = rest.norm();
  if (others > bound) {
    rest *= bound / others;
    const float first = std::abs(row(0));
    row(0) = (first > 0 ? row(0) / first : Single(1)) * std::sqrt(1 - bound * bound);
  }
}

/// All columns of A where a device has it.
struct OnDevice {
  SkinDevice& device;
  Index columns;

  Index cols() const { return columns; }
};

/// back = columns^H v.
template <class Columns, class Rows>
void apply_adjoint(const Columns& columns, const MatrixXcf& v, Rows& back) {
  for (Index i = 0; i < v.cols(); ++i) {
    multiply(Op::kAdjoint, columns, v.col(i), 0.0F, back.col(i));
  }
}
template <class Rows>
void apply_adjoint(const OnDevice& a, const MatrixXcf& v, Rows& back) {
  MatrixXcf all(a.columns, v.cols());
  a.device.send_back_single(static_cast<int>(v.cols()), v.data(), all.data());
  back = all;
}

/// F with its rows scaled to a largest singular value of A of about one.
class RelaxedMisfit {
 public:
  explicit RelaxedMisfit(const SkinProblem& problem)
      : device_(problem.device),
        faces_(problem.target_count()),
        rows_(faces_ + problem.outside.rows()),
        channels_(problem.channel_count()) {
    const Eigen::VectorXd roots = problem.weights.cwiseSqrt();
    // Normalised in double, so that single precision holds a problem in any unit.
    const double unit = norm_of(problem, roots);
    if (!(unit > 0)) {
      return;
    }
    const Eigen::VectorXd scale = roots / unit;
    if (device_) {
      Eigen::VectorXd all = Eigen::VectorXd::Constant(rows_, 1.0 / unit);
      all.head(faces_) = scale;
      device_->scale_single(all.data());
    } else {
      a_.resize(rows_, channels_);
      a_.topRows(faces_) = (scale.asDiagonal() * problem.target).cast<Single>();
      a_.bottomRows(problem.outside.rows()) = (problem.outside / unit).cast<Single>();
    }
    wanted_at_full_ = (roots.cwiseProduct(problem.amplitudes) / unit).cast<float>();
    wanted_ = wanted_at_full_;
    silent_ = false;
  }

  /// Drives of length one stand for some of length `level` from here on.
  void set_level(double level) { wanted_ = wanted_at_full_ / static_cast<float>(level); }

  bool is_silent() const { return silent_; }
  Index channels() const { return channels_; }

  /// An estimate of ||A||^2, from below.
  float squared_norm() {
    if (squared_norm_ > 0) {
      return squared_norm_;
    }
    MatrixXcf x = MatrixXcf::Ones(channels(), 1);
    MatrixXcf sent;
    pass(1, sent, [&](Index at, const auto& columns) { return x.middleRows(at, columns.cols()); });
    for (int step = 0; step < kPowerSteps; ++step) {
      const MatrixXcf unit = sent.normalized();
      pass(1, sent, [&](Index at, const auto& columns) {
        auto rows = x.middleRows(at, columns.cols());
        apply_adjoint(columns, unit, rows);
        return rows;
      });
      squared_norm_ = sent.norm();
    }
    return squared_norm_;
  }

  /// sent = A Y.
  void send(const MatrixXcf& y, MatrixXcf& sent) {
    pass(y.cols(), sent, [&](Index at, const auto& columns) { return y.middleRows(at, columns.cols()); });
  }

  double cost(const MatrixXcf& sent) const {
    const VectorXf loudness = sent.topRows(faces_).rowwise().norm();
    return (loudness - wanted_).cast<double>().squaredNorm() +
           sent.bottomRows(sent.rows() - faces_).cast<std::complex<double>>().squaredNorm();
  }

  /// sent <- what is left of it beside what is wanted: half of F's gradient there.
  void leave_misfit(MatrixXcf& sent) const {
    for (Index j = 0; j < faces_; ++j) {
      const float loudness = sent.row(j).norm();
      sent.row(j) *= loudness > 0 ? 1 - wanted_(j) / loudness : 0;
    }
  }

  /// to = from - length A^H misfit with its rows confined, and sent = A to, in one pass over A.
  void step(const MatrixXcf& from, const MatrixXcf& misfit, float length, float bound, MatrixXcf& to, MatrixXcf& sent) {
    to.resize(from.rows(), from.cols());
    pass(from.cols(), sent, [&](Index at, const auto& columns) {
      auto rows = to.middleRows(at, columns.cols());
      apply_adjoint(columns, misfit, rows);
      rows = from.middleRows(at, columns.cols()) - length * rows;
      for (Index n = 0; n < rows.rows(); ++n) {
        confine(rows.row(n), bound);
      }
      return rows;
    });
  }

 private:
  /// Of A before it is scaled.
  static double norm_of(const SkinProblem& problem, const Eigen::VectorXd& roots) {
    if (!problem.device) {
      return std::hypot((roots.asDiagonal() * problem.target).norm(), problem.outside.norm());
    }
    const double* strengths = problem.device->strengths();
    double sum = 0;
    for (Index i = 0; i < roots.size(); ++i) {
      sum += roots(i) * roots(i) * strengths[i];
    }
    return std::sqrt(sum + outside_strengths(problem).sum());
  }

  /// sent = sum over blocks of A's columns of columns rows_of(at, columns), in an order that the number of threads does
  /// not change; rows_of may work out its rows from these columns.
  template <class RowsOf>
  void pass(Index width, MatrixXcf& sent, const RowsOf& rows_of) {
    if (device_) {
      const MatrixXcf rows = rows_of(0, OnDevice{*device_, channels_});
      sent.resize(rows_, width);
      device_->send_single(static_cast<int>(width), rows.data(), sent.data());
      return;
    }
    const Index each = (channels() + kShares - 1) / kShares;
    shares_.resize(kShares);
#pragma omp parallel for schedule(static)
    for (Index share = 0; share < kShares; ++share) {
      MatrixXcf& sum = shares_[static_cast<std::size_t>(share)];
      sum.setZero(rows_, width);
      const Index end = std::min(channels(), (share + 1) * each);
      for (Index at = share * each; at < end; at += kPass) {
        const auto columns = a_.middleCols(at, std::min(kPass, end - at));
        const auto rows = rows_of(at, columns);
        for (Index i = 0; i < width; ++i) {
          multiply(Op::kPlain, columns, rows.col(i), 1.0F, sum.col(i));
        }
      }
    }
    sent = shares_[0];
    for (std::size_t share = 1; share < shares_.size(); ++share) {
      sent += shares_[share];
    }
  }

  std::shared_ptr<SkinDevice> device_;
  Index faces_;
  Index rows_;
  Index channels_;
  MatrixXcf a_;  // of no size where a device has it
  VectorXf wanted_at_full_;
  VectorXf wanted_;
  bool silent_ = true;
  float squared_norm_ = 0;
  std::vector<MatrixXcf> shares_;
};

/// Y with A Y, which go down together.
class AnnealedDescent {
 public:
  AnnealedDescent(RelaxedMisfit& misfit, MatrixXcf y)
      : misfit_(misfit), y_(std::move(y)), length_(1 / misfit.squared_norm()) {}

  /// Y turned so that its columns are orthogonal, the strongest first: F does not see that.
  void turn() {
    const Eigen::SelfAdjointEigenSolver<MatrixXcf> eigen(y_.adjoint() * y_);
    y_ = y_ * eigen.eigenvectors().rowwise().reverse();
  }

  void run(int steps, float bound) {
    for (Index n = 0; n < y_.rows(); ++n) {
      confine(y_.row(n), bound);
    }
    MatrixXcf sent;
    misfit_.send(y_, sent);
    MatrixXcf ahead = y_;
    MatrixXcf ahead_sent = sent;
    MatrixXcf next;
    MatrixXcf next_sent;
    double cost = misfit_.cost(sent);
    float t = 1;
    for (int i = 0; i < steps; ++i) {
      misfit_.leave_misfit(ahead_sent);
      misfit_.step(ahead, ahead_sent, length_, bound, next, next_sent);
      const double next_cost = misfit_.cost(next_sent);
      if (!(next_cost <= cost)) {
        t = 1;
        length_ *= kShrink;
        ahead = y_;
        ahead_sent = sent;
        continue;
      }
      const float t_next = (1 + std::sqrt(1 + 4 * t * t)) / 2;
      const float momentum = (t - 1) / t_next;
      ahead = next + momentum * (next - y_);
      ahead_sent = next_sent + momentum * (next_sent - sent);
      std::swap(y_, next);
      std::swap(sent, next_sent);
      cost = next_cost;
      t = t_next;
      length_ *= kGrow;
    }
  }

  const MatrixXcf& rows() const { return y_; }

 private:
  RelaxedMisfit& misfit_;
  MatrixXcf y_;
  float length_;
};

MatrixXcf random_rows(Index channels, int width, unsigned seed) {
  std::mt19937_64 generator(seed);
  const auto number = [&] { return static_cast<float>(2.0 * random_share(generator) - 1.0); };
  MatrixXcf rows(channels, width);
  for (Single& y : rows.reshaped()) {
    const float real = number();
    y = {real, number()};
  }
  return rows;
}

Eigen::VectorXcd anneal(RelaxedMisfit& misfit, const AnnealingOptions& options) {
  if (misfit.is_silent()) {
    return Eigen::VectorXcd::Constant(misfit.channels(), options.level);
  }
  misfit.set_level(options.level);
  AnnealedDescent descent(misfit, random_rows(misfit.channels(), options.width, options.seed));
  descent.run(options.descent, 1.0F);
  descent.turn();
  for (const float bound : kBounds) {
    descent.run(options.stage, bound);
  }
  return options.level * phasors_of(descent.rows().col(0).cast<std::complex<double>>());
}

}  // namespace

Eigen::VectorXcd annealed_start(const SkinProblem& problem, const AnnealingOptions& options) {
  require_valid(problem, "annealed_start");
  if (options.width < 2 || options.width > 8 || options.descent < 1 || options.stage < 1 || !(options.level > 0)) {
    throw std::invalid_argument("annealed_start: an option is out of range");
  }
  RelaxedMisfit misfit(problem);
  return anneal(misfit, options);
}

AnnealedStarts annealed_starts(const SkinProblem& problem, bool free_level) {
  require_valid(problem, "annealed_starts");
  RelaxedMisfit misfit(problem);
  AnnealedStarts result;
  Eigen::VectorXcd first = anneal(misfit, {});
  result.at_full = first;
  for (int trial = 0; free_level && trial < kLevelTrials; ++trial) {
    const double wanted = best_level(problem, phasors_of(first));
    if (wanted > kNearLevel * result.level || !(wanted > 0)) {
      break;
    }
    result.level = wanted;
    first = anneal(misfit, {.level = wanted});
  }
  if (!(result.level < kTooStrong)) {
    result.level = 1.0;
    first = result.at_full;
  }
  std::vector<std::pair<double, Eigen::VectorXcd>> starts;
  starts.emplace_back(skin_cost(problem, first), first);
  for (unsigned seed = 2; seed <= kSeeds; ++seed) {
    Eigen::VectorXcd drives = anneal(misfit, {.level = result.level, .seed = seed});
    starts.emplace_back(skin_cost(problem, drives), std::move(drives));
  }
  std::ranges::stable_sort(starts, {}, &std::pair<double, Eigen::VectorXcd>::first);
  result.drives.resize(problem.channel_count(), kFollowed);
  for (int i = 0; i < kFollowed; ++i) {
    result.drives.col(i) = starts[static_cast<std::size_t>(i)].second;
  }
  return result;
}

}  // namespace touchfield
