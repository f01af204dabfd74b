#include "solvers/phase/incident_problem.h"

#include <algorithm>
#include <cmath>
#include <complex>
#include <stdexcept>
#include <type_traits>
#include <utility>

#include "solvers/linear/blas_product.h"
#include "solvers/linear/factorisations.h"
#include "solvers/phase/levenberg_marquardt.h"

namespace touchfield {

namespace {

using Complex = std::complex<double>;

template <typename Real>
using Matrix = Eigen::Matrix<Real, Eigen::Dynamic, Eigen::Dynamic>;

/// The angles x with z = exp(i x), Q z and the cost.
struct AnglePoint {
  Eigen::VectorXd x;
  Eigen::VectorXcd z;
  Eigen::VectorXcd gram_z;
  double cost = 0.0;

  void evaluate(const IncidentProblem& problem) {
    z.resize(x.size());
    for (Eigen::Index i = 0; i < x.size(); ++i) {
      z(i) = std::polar(1.0, x(i));
    }
    multiply_by_gram(problem, z, gram_z);
    cost = z.dot(gram_z).real();
  }

  /// Re(conj(i z) .* (Q z))
  Eigen::VectorXd half_gradient() const { return (z.conjugate().array() * gram_z.array()).imag(); }
};

AnglePoint point_at(const IncidentProblem& problem, const Eigen::VectorXd& x) {
  AnglePoint point;
  point.x = x;
  point.evaluate(problem);
  return point;
}

/// normal = Re(diag(conj z) Q diag(z)) + mu I, its lower triangle.
template <typename Real>
void fill_normal_matrix(const Eigen::MatrixXcd& gram, const Eigen::VectorXcd& z, double mu, Matrix<Real>& normal) {
  const Eigen::Index size = z.size();
  normal.resize(size, size);
#pragma omp parallel for schedule(static, 16)
  for (Eigen::Index j = 0; j < size; ++j) {
    const Complex* column = gram.data() + j * size;
    Real* to = normal.data() + j * size;
    for (Eigen::Index i = j; i < size; ++i) {
      const Complex turned = column[i] * z(j);
      to[i] = static_cast<Real>(z(i).real() * turned.real() + z(i).imag() * turned.imag());
    }
    to[j] += static_cast<Real>(mu);
  }
}

/// Steps h with (J^T J + mu I) h = -J^T f: factorised in single precision and refined by products in double, in double
/// from the damping on at which that fails. Where the problem has a device, that factorises and corrects.
class NormalStep {
 public:
  /// returns   false where the matrix is not positive definite
  bool solve(const IncidentProblem& problem, const AnglePoint& point, const Eigen::VectorXd& gradient, double mu,
             Eigen::VectorXd& h) {
    if (mu > too_small_) {
      if (factorise(problem, point, mu, single_) && refine(problem, point, gradient, mu, h)) {
        return true;
      }
      too_small_ = mu;
    }
    if (!factorise(problem, point, mu, double_)) {
      return false;
    }
    h = -gradient;
    if (problem.device) {
      remainder_ = h;
      problem.device->correct(remainder_.data(), unit_of(gradient.norm()), h.data());
      return true;
    }
    cholesky_solve(size_of(double_), double_.data(), h.data());
    return true;
  }

 private:
  static constexpr double kAccuracy = 1e-9;  // of a refined step, relative to itself
  static constexpr double kSlowest = 0.2;    // a correction that leaves more of the residual is not worth its product
  static constexpr int kCorrections = 20;    // at that rate these leave 1e-14 of it

  static int size_of(const auto& matrix) { return static_cast<int>(matrix.rows()); }
  static double unit_of(double norm) { return norm > 0 ? norm : 1.0; }

  template <typename Real>
  static bool factorise(const IncidentProblem& problem, const AnglePoint& point, double mu, Matrix<Real>& normal) {
    if (problem.device) {
      return problem.device->factorise(point.z.data(), mu, std::is_same_v<Real, double>);
    }
    fill_normal_matrix(problem.gram, point.z, mu, normal);
    return cholesky_factorise(size_of(normal), normal.data());
  }

  bool refine(const IncidentProblem& problem, const AnglePoint& point, const Eigen::VectorXd& gradient, double mu,
              Eigen::VectorXd& h) {
    h.setZero(gradient.size());
    remainder_ = -gradient;
    product_.resize(gradient.size());
    GramDevice* device = problem.device.get();
    double before = gradient.norm();
    for (int correction = 0; correction < kCorrections; ++correction) {
      double after = 0.0;
      if (device != nullptr) {
        after = device->correct(correction == 0 ? remainder_.data() : nullptr, unit_of(before), h.data());
      } else {
        correct(before, h);
        turned_ = point.z.array() * h.array();
        multiply(Op::kPlain, problem.gram, turned_, 0.0, product_);
        remainder_ = -gradient - mu * h - (point.z.conjugate().array() * product_.array()).real().matrix();
        after = remainder_.norm();
      }
      if (after <= kAccuracy * mu * h.norm()) {  // mu is no more than the least eigenvalue
        // Once more: the rest of single precision's rounding, about.
        if (device != nullptr) {
          device->correct(nullptr, unit_of(after), h.data());
        } else {
          correct(after, h);
        }
        return true;
      }
      if (!(after <= kSlowest * before)) {
        return false;
      }
      before = after;
    }
    return false;
  }

  /// h += what the single factor makes of the remainder, whose norm is given so that any unit fits.
  void correct(double norm, Eigen::VectorXd& h) {
    if (norm > 0) {
      right_ = (remainder_ / norm).cast<float>();
      cholesky_solve(size_of(single_), single_.data(), right_.data());
      h += norm * right_.cast<double>();
    }
  }

  double too_small_ = 0.0;  // the largest damping at which single precision failed
  Matrix<float> single_;
  Matrix<double> double_;
  Eigen::VectorXf right_;
  Eigen::VectorXd remainder_;
  Eigen::VectorXcd turned_;
  Eigen::VectorXcd product_;
};

/// Where Levenberg-Marquardt is.
class IncidentDescent {
 public:
  IncidentDescent(const IncidentProblem& problem, const Eigen::VectorXd& start,
                  const LevenbergMarquardtOptions& options)
      : problem_(problem), options_(options), point_(point_at(problem, start)), candidate_(point_) {
    gradient_ = point_.half_gradient();
  }

  const AnglePoint& point() const { return point_; }
  bool is_flat() const {
    return gradient_.cwiseAbs().maxCoeff() <= options_.gradient_tolerance * std::abs(point_.cost);
  }

  bool solve(double mu) {
    if (!normal_.solve(problem_, point_, gradient_, mu, step_)) {
      return false;
    }
    candidate_.x = point_.x + step_;
    candidate_.evaluate(problem_);
    predicted_ = step_.dot(mu * step_ - gradient_);
    tiny_ = step_.norm() <= options_.step_tolerance * (1.0 + point_.x.norm());
    return true;
  }

  bool lowers_cost() const { return candidate_.cost < point_.cost && predicted_ > 0; }

  double accept() {
    const double gain = (point_.cost - candidate_.cost) / predicted_;
    std::swap(point_, candidate_);
    gradient_ = point_.half_gradient();
    return gain;
  }

  bool rests() const { return tiny_ || is_flat(); }
  Refusal refuse() const { return tiny_ ? Refusal::kAtRest : Refusal::kDamp; }

 private:
  const IncidentProblem& problem_;
  const LevenbergMarquardtOptions& options_;
  AnglePoint point_;
  AnglePoint candidate_;
  NormalStep normal_;
  Eigen::VectorXd gradient_;
  Eigen::VectorXd step_;
  double predicted_ = 0.0;
  bool tiny_ = false;
};

void require_valid(const IncidentProblem& problem, const Eigen::VectorXd& start,
                   const LevenbergMarquardtOptions& options) {
  if ((!problem.device && problem.gram.rows() != problem.gram.cols()) || problem.target_count < 0 ||
      problem.target_count > problem.size()) {
    throw std::invalid_argument("solve_incident: the gram matrix is not square or has fewer rows than targets");
  }
  if (start.size() != problem.size()) {
    throw std::invalid_argument("solve_incident: the start has another size than the problem");
  }
  if (!(problem.device ? problem.device->finite() : problem.gram.allFinite()) || !start.allFinite()) {
    throw std::invalid_argument("solve_incident: the gram matrix or the start holds a value that is not finite");
  }
  if (options.iterations < 1 || !(options.initial_damping > 0) || !(options.gradient_tolerance >= 0) ||
      !(options.step_tolerance >= 0)) {
    throw std::invalid_argument("solve_incident: an option is out of range");
  }
}

double largest_diagonal(const IncidentProblem& problem) {
  return problem.device ? problem.device->largest_diagonal() : problem.gram.diagonal().real().maxCoeff();
}

}  // namespace

void multiply_by_gram(const IncidentProblem& problem, const Eigen::VectorXcd& z, Eigen::VectorXcd& product) {
  product.resize(z.size());
  if (problem.device) {
    problem.device->multiply(z.data(), product.data());
  } else {
    multiply(Op::kPlain, problem.gram, z, 0.0, product);
  }
}

double incident_cost(const IncidentProblem& problem, const Eigen::VectorXd& x) { return point_at(problem, x).cost; }

Eigen::VectorXd incident_half_gradient(const IncidentProblem& problem, const Eigen::VectorXd& x) {
  return point_at(problem, x).half_gradient();
}

Eigen::MatrixXd incident_normal_matrix(const IncidentProblem& problem, const Eigen::VectorXd& x) {
  Eigen::MatrixXd normal;
  fill_normal_matrix(problem.gram, point_at(problem, x).z, 0.0, normal);
  return normal.selfadjointView<Eigen::Lower>();
}

PhaseSolution solve_incident(const IncidentProblem& problem, const Eigen::VectorXd& start,
                             const LevenbergMarquardtOptions& options, const IterationCallback& callback) {
  require_valid(problem, start, options);
  const bool empty = start.size() == 0;
  IncidentDescent descent(problem, start, options);
  PhaseSolution solution;
  solution.status = empty || descent.is_flat() ? PhaseStatus::kConverged : PhaseStatus::kIterationLimit;
  solution.cost_history.push_back(descent.point().cost);
  // The diagonal of J^T J is that of Q, since |z| = 1.
  MadsenDamping damping(empty ? 0.0 : options.initial_damping * largest_diagonal(problem));
  iterate(solution, options.iterations, callback, [&](PhaseStatus& status) {
    status = try_step(descent, damping);
    return descent.point().cost;
  });
  return full_drive(descent.point().x.tail(problem.channel_count()), std::move(solution));
}

}  // namespace touchfield
