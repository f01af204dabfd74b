#include "solvers/linear/gmres.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <cstddef>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include <Eigen/Jacobi>

namespace touchfield {

namespace {

// A vector left with this share of its norm after orthogonalisation is rounding, not a new direction.
constexpr double kRounding = 64.0 * std::numeric_limits<double>::epsilon();

// A cycle that leaves more than this share of the residual has stagnated: the next one would start from the same.
constexpr double kStagnation = 0.999;

// Rows that a thread takes at once; sums over them do not depend on the number of threads.
constexpr Eigen::Index kRows = 4096;

/// work(first row, number of rows, number of the block) for all blocks of rows, by all threads that are idle.
template <typename Work>
void by_rows(Eigen::Index rows, const Work& work) {
  const Eigen::Index blocks = (rows + kRows - 1) / kRows;
#pragma omp parallel for schedule(static) if (blocks > 1)
  for (Eigen::Index b = 0; b < blocks; ++b) {
    work(b * kRows, std::min(kRows, rows - b * kRows), b);
  }
}

/// The Krylov space of one column and the least-squares problem in it, triangular by Givens rotations.
class KrylovSpace {
 public:
  KrylovSpace(Eigen::Index column, double rhs_norm, Eigen::Index rows, Eigen::Index restart)
      : column_(column),
        rhs_norm_(rhs_norm),
        basis_(rows, restart),
        triangle_(restart + 1, restart),
        reduced_(restart + 1),
        update_(restart),
        parts_(restart, (rows + kRows - 1) / kRows),
        rotations_(static_cast<std::size_t>(restart)) {}

  void begin(const Eigen::Ref<const Eigen::VectorXcd>& residual, double norm) {
    dimension_ = 0;
    exhausted_ = false;
    basis_.col(0) = residual / norm;
    reduced_(0) = norm;
    estimate_ = norm / rhs_norm_;
  }

  /// Takes in w = A last(), which is overwritten. The estimate is not finite if w is not.
  void extend(Eigen::Ref<Eigen::VectorXcd> w) {
    const Eigen::Index k = dimension_;
    const double norm = w.norm();
    if (!std::isfinite(norm)) {
      estimate_ = norm;
      return;
    }
    const auto basis = basis_.leftCols(k + 1);
    auto h = triangle_.col(k);
    auto update = update_.head(k + 1);
    auto parts = parts_.topRows(k + 1);
    h.head(k + 1).setZero();
    for (int pass = 0; pass < 2; ++pass) {
      by_rows(w.size(), [&](Eigen::Index first, Eigen::Index count, Eigen::Index block) {
        parts.col(block).noalias() = basis.middleRows(first, count).adjoint() * w.segment(first, count);
      });
      update = parts.rowwise().sum();
      by_rows(w.size(), [&](Eigen::Index first, Eigen::Index count, Eigen::Index /*block*/) {
        w.segment(first, count).noalias() -= basis.middleRows(first, count) * update;
      });
      h.head(k + 1) += update;
    }
    const double rest = w.norm();
    exhausted_ = !(rest > kRounding * norm);
    h(k + 1) = exhausted_ ? 0.0 : rest;
    for (Eigen::Index i = 0; i < k; ++i) {
      h.applyOnTheLeft(i, i + 1, rotation(i).adjoint());
    }
    if (exhausted_ && std::abs(h(k)) <= kRounding * norm) {
      return;  // A is singular on the space: the new direction cannot lessen the residual
    }
    rotation(k).makeGivens(h(k), h(k + 1));
    h.applyOnTheLeft(k, k + 1, rotation(k).adjoint());
    reduced_(k + 1) = 0.0;
    reduced_.applyOnTheLeft(k, k + 1, rotation(k).adjoint());
    estimate_ = std::abs(reduced_(k + 1)) / rhs_norm_;
    dimension_ = k + 1;
    if (!exhausted_ && !full()) {
      basis_.col(k + 1) = w / rest;
    }
  }

  /// The minimiser in the space; ends the cycle.
  void minimiser(Eigen::Ref<Eigen::VectorXcd> x) {
    auto y = reduced_.head(dimension_);
    triangle_.topLeftCorner(dimension_, dimension_).triangularView<Eigen::Upper>().solveInPlace(y);
    x.noalias() = basis_.leftCols(dimension_) * y;
  }

  Eigen::Index column() const { return column_; }
  double rhs_norm() const { return rhs_norm_; }
  double estimate() const { return estimate_; }
  bool exhausted() const { return exhausted_; }
  bool full() const { return dimension_ == basis_.cols(); }
  auto last() const { return basis_.col(dimension_); }

 private:
  Eigen::JacobiRotation<std::complex<double>>& rotation(Eigen::Index i) {
    return rotations_[static_cast<std::size_t>(i)];
  }

  Eigen::Index column_;
  double rhs_norm_;
  Eigen::Index dimension_ = 0;
  double estimate_ = 0.0;   // relative residual of the minimiser
  bool exhausted_ = false;  // the space holds its image
  Eigen::MatrixXcd basis_;  // not touched, so not resident, before a step needs it
  Eigen::MatrixXcd triangle_;
  Eigen::VectorXcd reduced_;  // right-hand side of the triangular system, then its solution
  Eigen::VectorXcd update_;
  Eigen::MatrixXcd parts_;  // of the update, a block of rows a column
  std::vector<Eigen::JacobiRotation<std::complex<double>>> rotations_;
};

Eigen::Index count(const std::vector<KrylovSpace*>& spaces) { return static_cast<Eigen::Index>(spaces.size()); }

KrylovSpace& at(const std::vector<KrylovSpace*>& spaces, Eigen::Index i) {
  return *spaces[static_cast<std::size_t>(i)];
}

class Gmres {
 public:
  Gmres(const Product& apply, const Eigen::MatrixXcd& b, const GmresOptions& options,
        const std::function<void(int, double)>& report, const Product& preconditioner)
      : apply_(apply), preconditioner_(preconditioner), b_(b), options_(options), report_(report) {}

  GmresResult solve() {
    std::vector<KrylovSpace> spaces = start();
    std::vector<KrylovSpace*> running;
    for (KrylovSpace& space : spaces) {
      running.push_back(&space);
    }
    while (!running.empty()) {
      run_cycle(running);
      update(running);
    }
    result_.converged =
        std::ranges::all_of(result_.residuals, [&](double residual) { return residual <= options_.tolerance; });
    return std::move(result_);
  }

 private:
  std::vector<KrylovSpace> start() {
    const auto columns = static_cast<std::size_t>(b_.cols());
    result_.x = Eigen::MatrixXcd::Zero(b_.rows(), b_.cols());
    result_.steps.assign(columns, 0);
    result_.residuals.assign(columns, 0.0);
    const Eigen::Index restart = std::min<Eigen::Index>(std::min(options_.restart, options_.max_steps), b_.rows());
    std::vector<KrylovSpace> spaces;
    for (Eigen::Index s = 0; s < b_.cols(); ++s) {
      const double norm = b_.col(s).stableNorm();
      if (!std::isfinite(norm)) {
        throw std::domain_error("gmres: right-hand side " + std::to_string(s) + " holds a value that is not finite");
      }
      residual(s) = norm > 0.0 ? 1.0 : 0.0;
      if (residual(s) > options_.tolerance && options_.max_steps > 0) {
        spaces.emplace_back(s, norm, b_.rows(), restart);
        spaces.back().begin(b_.col(s), norm);
      }
    }
    return spaces;
  }

  /// Enlarges the spaces, all of them a step at once, until each is done for this cycle.
  void run_cycle(const std::vector<KrylovSpace*>& running) {
    std::vector<KrylovSpace*> live = running;
    Eigen::MatrixXcd block;
    while (!live.empty()) {
      block.resize(b_.rows(), count(live));
      for (Eigen::Index i = 0; i < count(live); ++i) {
        block.col(i) = at(live, i).last();
      }
      Eigen::MatrixXcd product = multiply(preconditioned(block));
#pragma omp parallel for schedule(dynamic) if (product.cols() > 1)
      for (Eigen::Index i = 0; i < product.cols(); ++i) {
        at(live, i).extend(product.col(i));
      }
      ++block_steps_;
      for (const KrylovSpace* space : live) {
        check_finite(space->estimate());
        ++steps(space->column());
      }
      if (report_) {
        double worst = 0.0;
        for (const KrylovSpace* space : running) {
          worst = std::max(worst, space->estimate());
        }
        report_(block_steps_, worst);
      }
      std::erase_if(live, [&](const KrylovSpace* space) {
        return space->estimate() <= options_.tolerance || space->exhausted() || space->full() ||
               steps(space->column()) >= options_.max_steps;
      });
    }
  }

  /// Moves to the minimisers, forms their true residuals, and begins a new cycle for those that go on.
  void update(std::vector<KrylovSpace*>& running) {
    Eigen::MatrixXcd x(b_.rows(), count(running));
#pragma omp parallel for schedule(dynamic)
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      at(running, i).minimiser(x.col(i));
    }
    x = preconditioned(x);
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      x.col(i) += result_.x.col(at(running, i).column());
    }
    Eigen::MatrixXcd r = multiply(x);
    std::vector<KrylovSpace*> next;
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      KrylovSpace& space = at(running, i);
      const Eigen::Index s = space.column();
      r.col(i) = b_.col(s) - r.col(i);
      const double norm = r.col(i).stableNorm();
      check_finite(norm);
      const double reached = norm / space.rhs_norm();
      const bool stagnated = reached > kStagnation * residual(s);
      if (reached < residual(s)) {
        result_.x.col(s) = x.col(i);
        residual(s) = reached;
      }
      if (residual(s) > options_.tolerance && steps(s) < options_.max_steps && !stagnated) {
        space.begin(r.col(i), norm);
        next.push_back(&space);
      }
    }
    running = std::move(next);
  }

  Eigen::MatrixXcd preconditioned(const Eigen::MatrixXcd& block) const {
    return preconditioner_ ? preconditioner_(block) : block;
  }

  Eigen::MatrixXcd multiply(const Eigen::MatrixXcd& block) {
    Eigen::MatrixXcd product = apply_(block);
    if (product.rows() != block.rows() || product.cols() != block.cols()) {
      throw std::invalid_argument("gmres: the product has another shape than the block it multiplies");
    }
    ++result_.products;
    result_.columns += static_cast<int>(block.cols());
    return product;
  }

  void check_finite(double value) const {
    if (!std::isfinite(value)) {
      throw std::domain_error("gmres: product " + std::to_string(result_.products) +
                              " holds a value that is not finite");
    }
  }

  double& residual(Eigen::Index s) { return result_.residuals[static_cast<std::size_t>(s)]; }
  int& steps(Eigen::Index s) { return result_.steps[static_cast<std::size_t>(s)]; }

  const Product& apply_;
  const Product& preconditioner_;
  const Eigen::MatrixXcd& b_;
  const GmresOptions& options_;
  const std::function<void(int, double)>& report_;
  GmresResult result_;
  int block_steps_ = 0;
};

constexpr double kLeastProgress = 0.5;  // share of the worst residual a round may leave

void check_shape(const Eigen::MatrixXcd& product, const Eigen::MatrixXcd& block) {
  if (product.rows() != block.rows() || product.cols() != block.cols()) {
    throw std::invalid_argument("refine: a product has another shape than the block it multiplies");
  }
}

double finite_norm(const Eigen::Ref<const Eigen::VectorXcd>& v, const char* what) {
  const double norm = v.stableNorm();
  if (!std::isfinite(norm)) {
    throw std::domain_error(std::string("refine: ") + what + " holds a value that is not finite");
  }
  return norm;
}

}  // namespace

GmresResult gmres(const Product& apply, const Eigen::MatrixXcd& b, const GmresOptions& options,
                  const std::function<void(int step, double worst_residual)>& report, const Product& preconditioner) {
  if (!(options.tolerance > 0.0) || options.max_steps < 0 || options.restart < 1) {
    throw std::invalid_argument("gmres: tolerance must be > 0, max_steps >= 0 and restart >= 1");
  }
  return Gmres(apply, b, options, report, preconditioner).solve();
}

RefinementResult refine(const Product& exact, const Product& approximate_inverse, const Eigen::MatrixXcd& b,
                        const RefinementOptions& options) {
  if (!(options.tolerance > 0.0) || options.max_rounds < 0) {
    throw std::invalid_argument("refine: tolerance must be > 0 and max_rounds >= 0");
  }
  const Eigen::Index n = b.rows();
  RefinementResult result;
  result.x = Eigen::MatrixXcd::Zero(n, b.cols());
  result.residuals.assign(static_cast<std::size_t>(b.cols()), 0.0);
  const auto residual = [&](Eigen::Index s) -> double& { return result.residuals[static_cast<std::size_t>(s)]; };

  Eigen::MatrixXcd directions = b;  // residual vectors, scaled to unit norm
  Eigen::VectorXd scales(b.cols());
  std::vector<Eigen::Index> active;
  const auto select = [&] {
    active.clear();
    double worst = 0.0;
    for (Eigen::Index s = 0; s < b.cols(); ++s) {
      worst = std::max(worst, residual(s));
      if (residual(s) > options.tolerance) {
        active.push_back(s);
      }
    }
    return worst;
  };

  Eigen::VectorXd norms(b.cols());
  for (Eigen::Index s = 0; s < b.cols(); ++s) {
    norms(s) = finite_norm(b.col(s), "a right-hand side");
    scales(s) = norms(s);
    if (norms(s) > 0.0) {
      residual(s) = 1.0;
      directions.col(s) /= norms(s);
    }
  }
  double worst = select();
  for (int solved = 0; !active.empty() && solved <= options.max_rounds; ++solved) {
    const Eigen::MatrixXcd block = directions(Eigen::all, active);
    Eigen::MatrixXcd x = approximate_inverse(block);
    check_shape(x, block);
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Eigen::Index s = active[static_cast<std::size_t>(i)];
      finite_norm(x.col(i), "a correction");
      x.col(i) = result.x.col(s) + scales(s) * x.col(i);
    }
    const Eigen::MatrixXcd product = exact(x);
    check_shape(product, x);
    for (Eigen::Index i = 0; i < x.cols(); ++i) {
      const Eigen::Index s = active[static_cast<std::size_t>(i)];
      const Eigen::VectorXcd r = b.col(s) - product.col(i);
      const double norm = finite_norm(r, "a product");
      if (norm < residual(s) * norms(s)) {
        result.x.col(s) = x.col(i);
        residual(s) = norm / norms(s);
        scales(s) = norm;
        if (norm > 0.0) {
          directions.col(s) = r / norm;
        }
      }
    }
    result.rounds = solved;
    const double before = worst;
    worst = select();
    if (solved > 0 && worst > kLeastProgress * before) {
      break;
    }
  }
  result.converged = active.empty();
  return result;
}

}  // namespace touchfield
