#include "sim/bem/scattering_solver.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <mutex>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/bem/boundary_operator.h"
#include "sim/core/errors.h"
#include "solvers/linear/blas_product.h"
#include "solvers/linear/gmres.h"
#include "solvers/linear/linear_operator.h"

namespace touchfield {

namespace {

// What GMRES is asked for inside a refinement: products in single precision are good to about 1e-6, and a correction
// need only win a few digits.
constexpr double kSingleLimit = 3e-6;
constexpr double kCorrection = 1e-3;
constexpr int kMaxRounds = 8;
constexpr Eigen::Index kSample = 8;  // columns whose residual tells for a block of more, if unrefined or by LU
constexpr double kGridMargin = 5.0;  // the same for products by a grid: tolerance over their error
constexpr double kLoose = 30.0 * kSingleLimit;  // tolerances from here on need no residual in double

constexpr double kWorstCoarse = 1e-5;     // reciprocal condition number of E, factorised in single precision
constexpr int kPreconditionedSteps = 40;  // at most: a preconditioner that needs more does not serve

/// The preconditioner of a solver: made when it is first used, set aside for good where it does not serve.
class Preconditioning {
 public:
  explicit Preconditioning(const ScatteringSystem& system) : system_(system) {}

  /// None: there is none, or it was set aside.
  std::shared_ptr<const TwoLevel> get() {
    const std::scoped_lock lock(mutex_);
    if (!tried_) {
      tried_ = true;
      try {
        made_ = system_.two_level();
        if (made_ && made_->reciprocal_condition() < kWorstCoarse) {
          drop(fmt::format("the condition number of its coarse matrix is {:.1e}", 1.0 / made_->reciprocal_condition()));
        }
      } catch (const std::domain_error& error) {
        drop(error.what());
      }
    }
    return made_;
  }

  void set_aside(const std::string& why) {
    const std::scoped_lock lock(mutex_);
    drop(why);
  }

  void tell(SolveReport& report) {
    const std::scoped_lock lock(mutex_);
    report.two_level = made_ != nullptr;
    report.set_aside = why_;
  }

 private:
  void drop(const std::string& why) {
    made_.reset();
    why_ = why;
  }

  const ScatteringSystem& system_;
  std::mutex mutex_;
  bool tried_ = false;
  std::shared_ptr<const TwoLevel> made_;
  std::string why_;
};

struct Applied {
  Eigen::MatrixXcd x;
  double residual = std::numeric_limits<double>::quiet_NaN();  // worst relative one by the inverse's own products
};

/// B^-1 or B^-T in the solver's own precision, without a check of what it reached.
struct Inverse {
  /// tolerance   what an iterative inverse is to reach
  /// steps       raised by the steps taken
  std::function<Applied(bool transposed, const Eigen::MatrixXcd& b, double tolerance, int& steps,
                        const ScatteringSolver::Report& report)>
      apply;
  std::function<double()> reciprocal_condition = [] { return std::numeric_limits<double>::quiet_NaN(); };
};

template <typename Real>
Inverse lu_inverse(Eigen::Matrix<std::complex<Real>, Eigen::Dynamic, Eigen::Dynamic> matrix) {
  const auto lu = std::make_shared<const BasicDenseLu<Real>>(std::move(matrix));
  const auto apply = [lu](bool transposed, const Eigen::MatrixXcd& b, double /*tolerance*/, int& /*steps*/,
                          const ScatteringSolver::Report& /*report*/) -> Applied {
    const auto solve = [&](auto right) { return transposed ? lu->solve_transpose(right) : lu->solve(right); };
    if constexpr (std::is_same_v<Real, double>) {
      return {solve(b)};
    } else {
      return {solve(Eigen::MatrixXcf(b.cast<std::complex<float>>())).template cast<Complex>()};
    }
  };
  return {apply, [lu] { return lu->reciprocal_condition(); }};
}

/// preconditioning   outlives the inverse; may be null
Inverse gmres_inverse(const std::shared_ptr<const LinearOperator>& given, const SolverOptions& options,
                      Preconditioning* preconditioning) {
  return {[given, options, preconditioning](bool transposed, const Eigen::MatrixXcd& b, double tolerance, int& steps,
                                            const ScatteringSolver::Report& report) -> Applied {
    const auto times = [&](const LinearOperator& a) -> Product {
      return [&a, transposed](const Eigen::MatrixXcd& x) { return transposed ? a.apply_transpose(x) : a.apply(x); };
    };
    const auto solve = [&](int most, const Product& preconditioner) {
      const GmresOptions limits{tolerance, std::max(0, std::min(most, options.max_steps - steps)), options.restart};
      GmresResult result = gmres(times(*given), b, limits, report, preconditioner);
      const int taken = *std::max_element(result.steps.begin(), result.steps.end());
      steps += taken;
      return std::pair(
          Applied{std::move(result.x), *std::max_element(result.residuals.begin(), result.residuals.end())},
          taken < most);
    };
    if (const std::shared_ptr<const TwoLevel> two_level = preconditioning ? preconditioning->get() : nullptr) {
      auto [applied, quick] = solve(kPreconditionedSteps, times(*two_level));
      if (quick || applied.residual <= tolerance) {
        return std::move(applied);
      }
      preconditioning->set_aside(fmt::format("it left {:.1e} after {} steps", applied.residual, kPreconditionedSteps));
    }
    return solve(options.max_steps, {}).first;
  }};
}

/// The system's own operator, which outlives the solver.
std::shared_ptr<const LinearOperator> borrowed(const LinearOperator& given) {
  return {std::shared_ptr<const LinearOperator>(), &given};
}

Inverse make_inverse(const ScatteringSystem& system, const SolverOptions& options, Preconditioning* preconditioning) {
  const bool single = options.precision == Precision::kSingle;
  switch (options.kind) {
    case SolverKind::kLu:
      return single ? lu_inverse<float>(system.dense_single()) : lu_inverse<double>(system.dense());
    case SolverKind::kGmres:
      if (single) {
        return gmres_inverse(std::make_shared<DenseOperator<float>>(system.dense_single()), options, preconditioning);
      }
      return gmres_inverse(std::make_shared<DenseOperator<double>>(system.dense()), options, preconditioning);
    case SolverKind::kMatrixFree:
      if (single) {
        return gmres_inverse(system.single_operator(), options, preconditioning);
      }
      return gmres_inverse(borrowed(system.exact()), options, preconditioning);
    case SolverKind::kFft:
      return gmres_inverse(borrowed(system.by_grid()), options, preconditioning);
  }
  throw std::logic_error("unknown solver");
}

/// Worst relative residual of kSample columns spread over all.
double sampled_residual(const Product& exact, const Eigen::MatrixXcd& x, const Eigen::MatrixXcd& b) {
  Eigen::MatrixXcd some(x.rows(), kSample);
  Eigen::MatrixXcd right(x.rows(), kSample);
  for (Eigen::Index s = 0; s < kSample; ++s) {
    some.col(s) = x.col(s * (x.cols() - 1) / (kSample - 1));
    right.col(s) = b.col(s * (x.cols() - 1) / (kSample - 1));
  }
  const Eigen::MatrixXcd residual = exact(some) - right;
  return (residual.colwise().norm().array() / right.colwise().norm().array()).maxCoeff();
}

class RefinedSolver : public ScatteringSolver {
 public:
  RefinedSolver(const ScatteringSystem& system, const SolverOptions& options)
      : system_(system),
        options_(options),
        preconditioning_(options.two_level ? std::make_unique<Preconditioning>(system) : nullptr),
        inverse_(make_inverse(system, options, preconditioning_.get())) {}

  Solved solve(const Eigen::MatrixXcd& b, const Report& report) const override { return told(run(false, b, report)); }
  Solved solve_transpose(const Eigen::MatrixXcd& b, const Report& report) const override {
    return told(run(true, b, report));
  }
  double reciprocal_condition() const override { return inverse_.reciprocal_condition(); }
  const SolverOptions& options() const override { return options_; }

 private:
  Solved told(Solved solved) const {
    if (preconditioning_) {
      preconditioning_->tell(solved.report);
    }
    return solved;
  }

  Solved run(bool transposed, const Eigen::MatrixXcd& b, const Report& report) const {
    if (b.cols() == 0) {
      return {b, {0, 0, 0.0, true}};
    }
    int steps = 0;
    bool first = true;
    const double floor = by_grid()                                  ? system_.options().grid_tolerance
                         : options_.precision == Precision::kSingle ? kSingleLimit
                                                                    : 0.0;
    const auto inverse = [&](const Eigen::MatrixXcd& r) {
      // The residual by the solver's own products differs from the exact one: aim a little below.
      const double tolerance = std::max(first ? 0.7 * options_.tolerance : kCorrection, floor);
      first = false;
      return inverse_.apply(transposed, r, tolerance, steps, report).x;
    };
    const auto exact = [&](const Eigen::MatrixXcd& x) {
      return transposed ? system_.exact().apply_transpose(x) : system_.exact().apply(x);
    };
    try {
      if (is_rough()) {
        // Products by a grid are off by a tenth of the tolerance, single ones by a thirtieth at most.
        const double aim = by_grid() ? 0.55 : 0.7;
        Applied applied = inverse_.apply(transposed, b, aim * options_.tolerance, steps, report);
        const double error = by_grid() ? system_.options().grid_tolerance : kSingleLimit;
        const double residual = applied.residual + error;
        return {std::move(applied.x), {steps, 0, residual, residual <= options_.tolerance}};
      }
      if (b.cols() > kSample && (!options_.refine || options_.kind == SolverKind::kLu)) {
        Eigen::MatrixXcd x = inverse(b);
        const double worst = sampled_residual(exact, x, b);
        if (worst <= options_.tolerance || !options_.refine) {
          return {std::move(x), {steps, 0, worst, worst <= options_.tolerance}};
        }
      }
      RefinementResult result =
          touchfield::refine(exact, inverse, b, {options_.tolerance, options_.refine ? kMaxRounds : 0});
      const double worst = *std::max_element(result.residuals.begin(), result.residuals.end());
      return {std::move(result.x), {steps, result.rounds, worst, result.converged}};
    } catch (const std::domain_error& error) {
      throw NumericalError(fmt::format("scattering by {} faces, scheme {}, {} in {} precision: {}", system_.faces(),
                                       to_string(system_.scheme()), to_string(options_.kind),
                                       to_string(options_.precision), error.what()));
    }
  }

  bool by_grid() const { return options_.kind == SolverKind::kFft; }

  /// GMRES to a tolerance far above the error of its products: its own residual tells.
  bool is_rough() const {
    if (by_grid()) {
      return options_.tolerance >= kGridMargin * system_.options().grid_tolerance;
    }
    return options_.kind != SolverKind::kLu && options_.precision == Precision::kSingle && options_.tolerance >= kLoose;
  }

  const ScatteringSystem& system_;
  SolverOptions options_;
  std::unique_ptr<Preconditioning> preconditioning_;  // before the inverse, which refers to it
  Inverse inverse_;
};

}  // namespace

std::string to_string(SolverKind kind) {
  switch (kind) {
    case SolverKind::kLu:
      return "LU";
    case SolverKind::kGmres:
      return "GMRES, stored";
    case SolverKind::kMatrixFree:
      return "GMRES, matrix-free";
    case SolverKind::kFft:
      return "GMRES, FFT";
  }
  return {};
}

std::string to_string(Precision precision) { return precision == Precision::kSingle ? "single" : "double"; }

std::unique_ptr<ScatteringSolver> make_solver(const ScatteringSystem& system, const SolverOptions& options) {
  try {
    return std::make_unique<RefinedSolver>(system, options);
  } catch (const std::domain_error& error) {
    throw NumericalError(
        fmt::format("scattering by {} faces, scheme {}: {}", system.faces(), to_string(system.scheme()), error.what()));
  }
}

double solver_memory(Eigen::Index unknowns, const SolverOptions& options, Eigen::Index right_hand_sides) {
  const auto n = static_cast<double>(unknowns);
  const double entry = options.precision == Precision::kSingle ? 8.0 : 16.0;
  const bool stored = options.kind == SolverKind::kLu || options.kind == SolverKind::kGmres;
  const double matrix = stored ? entry * n * n : 0.0;
  const double krylov = options.kind == SolverKind::kLu
                            ? 0.0
                            : 16.0 * n * static_cast<double>(right_hand_sides) *
                                  static_cast<double>(std::min(options.restart, options.max_steps));
  return matrix + krylov + 6.0 * 16.0 * n * static_cast<double>(right_hand_sides);
}

using Eigen::MatrixXcf;
using Eigen::VectorXcf;

FactoredTransfer::FactoredTransfer(const ScatteringSystem& system)
    : faces_(system.faces()), lu_(system.dense_single()), interior_(system.interior_rows_single()) {
  if (traits(system.scheme()).polished) {
    polisher_ = -BoundaryOperator<float>(system.mesh(), system.wave().wavenumber(),
                                         polishing_parts(gauss_diagonal(system.mesh()).cast<Complex>()))
                     .dense();
    polisher_.diagonal().array() += 1.0F;
  }
}

void FactoredTransfer::face(const ScatteringSystem& system, const TransducerArray& array) {
  b_ = system.right_hand_side_single(array, incident_);
}

VectorXcf FactoredTransfer::pressure(const VectorXcf& q) const {
  VectorXcf parts(b_.rows());
  multiply(Op::kPlain, b_, q, 0.0F, parts);
  VectorXcf b = parts.head(faces_);
  if (interior_.size() > 0) {
    multiply(Op::kAdjoint, interior_, parts.tail(interior_.rows()), 1.0F, b);
  }
  VectorXcf p = lu_.solve(b);
  if (polisher_.size() > 0) {
    VectorXcf incident(faces_);
    multiply(Op::kPlain, incident_, q, 0.0F, incident);
    for (int step = 0; step < kPolishingSteps; ++step) {
      VectorXcf polished = incident;
      multiply(Op::kPlain, polisher_, p, 1.0F, polished);
      p.swap(polished);
    }
  }
  return p;
}

VectorXcf FactoredTransfer::sent_back(const VectorXcf& v) const {
  VectorXcf back = VectorXcf::Zero(b_.cols());
  VectorXcf x = v;
  if (polisher_.size() > 0) {
    VectorXcf sum = VectorXcf::Zero(faces_);
    for (int step = 0; step < kPolishingSteps; ++step) {
      sum += x;
      VectorXcf before = x;
      multiply(Op::kAdjoint, polisher_, before, 0.0F, x);
    }
    multiply(Op::kAdjoint, incident_, sum, 0.0F, back);
  }
  x = lu_.solve_transpose(x.conjugate()).conjugate();  // B^-H
  VectorXcf parts(b_.rows());
  parts.head(faces_) = x;
  if (interior_.size() > 0) {
    multiply(Op::kPlain, interior_, x, 0.0F, parts.tail(interior_.rows()));
  }
  multiply(Op::kAdjoint, b_, parts, 1.0F, back);
  return back;
}

}  // namespace touchfield
