#include "solvers/phase/incident_problem.h"

#include <numbers>
#include <stdexcept>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace touchfield::incident_problem_test {

/// A small case with all rows of C kept: M rows, K targets, N channels.
struct SmallCase {
  Eigen::MatrixXcd c;
  IncidentProblem problem;
  Eigen::VectorXd x;
};

SmallCase small_case(Eigen::Index rows, Eigen::Index targets, Eigen::Index channels, unsigned seed) {
  std::srand(seed);
  SmallCase small;
  small.c = Eigen::MatrixXcd::Random(rows, targets + channels);
  small.problem = {small.c.adjoint() * small.c, targets};
  small.x = 3.0 * Eigen::VectorXd::Random(targets + channels);
  return small;
}

Eigen::VectorXcd phasors(const Eigen::VectorXd& x) {
  return (std::complex<double>(0, 1) * x.cast<std::complex<double>>()).array().exp();
}

/// The real residual [Re C z; Im C z] and its Jacobian, row by row.
Eigen::VectorXd direct_residual(const Eigen::MatrixXcd& c, const Eigen::VectorXd& x) {
  const Eigen::VectorXcd f = c * phasors(x);
  Eigen::VectorXd stacked(2 * f.size());
  stacked << f.real(), f.imag();
  return stacked;
}

Eigen::MatrixXd direct_jacobian(const Eigen::MatrixXcd& c, const Eigen::VectorXd& x) {
  const Eigen::MatrixXcd j = c * (std::complex<double>(0, 1) * phasors(x)).asDiagonal();
  Eigen::MatrixXd stacked(2 * j.rows(), j.cols());
  stacked << j.real(), j.imag();
  return stacked;
}

// The Gram form squares the residual, so it keeps half the digits of a small one; here nothing is small.
constexpr double kRounding = 1e-12;

TEST(IncidentProblem, GramFormEqualsTheRowByRowForm) {
  const SmallCase small = small_case(70, 9, 14, 1);
  const Eigen::VectorXd f = direct_residual(small.c, small.x);
  const Eigen::MatrixXd j = direct_jacobian(small.c, small.x);
  EXPECT_NEAR(incident_cost(small.problem, small.x), f.squaredNorm(), kRounding * f.squaredNorm());
  EXPECT_LT((incident_half_gradient(small.problem, small.x) - j.transpose() * f).norm(), kRounding * f.squaredNorm());
  EXPECT_LT((incident_normal_matrix(small.problem, small.x) - j.transpose() * j).norm(), kRounding * j.squaredNorm());
}

/// Levenberg-Marquardt written from Madsen, Nielsen and Tingleff's algorithm 3.16 on the M-row residual.
std::vector<double> reference_costs(const Eigen::MatrixXcd& c, Eigen::VectorXd x, int iterations, double tau = 1e-3) {
  std::vector<double> costs = {direct_residual(c, x).squaredNorm()};
  Eigen::MatrixXd j = direct_jacobian(c, x);
  double mu = tau * (j.transpose() * j).diagonal().maxCoeff();
  double nu = 2.0;
  for (int i = 0; i < iterations; ++i) {
    const Eigen::VectorXd g = j.transpose() * direct_residual(c, x);
    const Eigen::MatrixXd a = j.transpose() * j + mu * Eigen::MatrixXd::Identity(x.size(), x.size());
    const Eigen::VectorXd h = a.ldlt().solve(-g);
    const double next = direct_residual(c, x + h).squaredNorm();
    const double gain = (costs.back() - next) / h.dot(mu * h - g);
    if (gain > 0) {
      x += h;
      j = direct_jacobian(c, x);
      mu *= std::max(1.0 / 3.0, 1.0 - std::pow(2.0 * gain - 1.0, 3));
      nu = 2.0;
      costs.push_back(next);
    } else {
      mu *= nu;
      nu *= 2.0;
      costs.push_back(costs.back());
    }
  }
  return costs;
}

TEST(IncidentProblem, IteratesAsTheRowByRowFormDoes) {
  const SmallCase small = small_case(80, 10, 20, 3);
  const LevenbergMarquardtOptions options{.iterations = 12};
  const PhaseSolution solution = solve_incident(small.problem, Eigen::VectorXd::Zero(30), options);
  const std::vector<double> expected = reference_costs(small.c, Eigen::VectorXd::Zero(30), 12);
  ASSERT_EQ(solution.cost_history.size(), 13U);
  for (std::size_t i = 0; i < expected.size(); ++i) {
    // Rounding grows along the path, by less than ten an iteration here.
    EXPECT_NEAR(solution.cost_history[i], expected[i], 1e-9 * expected[0]) << "iteration " << i;
  }
}

// Normal matrices of rank 24 in 60 unknowns, so that their condition number is about that of the damping's inverse: the
// first steps are beyond what single precision can factorise or refine. Rounding of the step itself grows alike.
TEST(IncidentProblem, StepsOfAlmostSingularMatricesAreAsTheRowByRowFormsToo) {
  const SmallCase small = small_case(12, 20, 40, 5);
  for (const double tau : {1e-5, 1e-7, 1e-9}) {
    const LevenbergMarquardtOptions options{.iterations = 4, .initial_damping = tau};
    const PhaseSolution solution = solve_incident(small.problem, small.x, options);
    const std::vector<double> expected = reference_costs(small.c, small.x, 4, tau);
    for (std::size_t i = 0; i < expected.size(); ++i) {
      EXPECT_NEAR(solution.cost_history.at(i), expected[i], 1e-14 / tau * expected[0])
          << "tau " << tau << ", step " << i;
    }
  }
}

// A Gram matrix far beyond what single precision can hold, either way.
TEST(IncidentProblem, TheUnitOfPressureChangesNoPhase) {
  const SmallCase small = small_case(50, 5, 9, 80);
  const LevenbergMarquardtOptions options{.iterations = 10};
  const PhaseSolution plain = solve_incident(small.problem, small.x, options);
  for (const double unit : {1e-45, 1e42}) {
    const PhaseSolution scaled = solve_incident({unit * small.problem.gram, 5}, small.x, options);
    for (Eigen::Index n = 0; n < 9; ++n) {
      EXPECT_NEAR(std::remainder(plain.phases(n) - scaled.phases(n), 2.0 * std::numbers::pi), 0.0, 1e-7);
    }
  }
}

TEST(IncidentProblem, RefusesWhatIsNoProblem) {
  SmallCase small = small_case(20, 3, 4, 70);
  EXPECT_THROW(solve_incident(small.problem, Eigen::VectorXd::Zero(6), {}), std::invalid_argument);
  const LevenbergMarquardtOptions options{.iterations = 0};
  EXPECT_THROW(solve_incident(small.problem, small.x, options), std::invalid_argument);
  small.problem.gram(2, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(solve_incident(small.problem, small.x, {}), std::invalid_argument);
}

}  // namespace touchfield::incident_problem_test
