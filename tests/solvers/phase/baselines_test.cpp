#include "solvers/phase/baselines.h"

#include <numbers>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "solvers/phase/skin_problem.h"
#include "solvers/phase/surface.h"
#include "tests/support/skin_support.h"

namespace touchfield::baselines_test {

using Complex = std::complex<double>;
constexpr double kPi = std::numbers::pi;
constexpr double kRounding = 1e-9;  // of unit drives after a hundred steps: rounding 1e-15, grown along flat valleys

struct Method {
  std::string name;
  PhaseSolution (*solve)(const SkinProblem&, const Eigen::VectorXcd& start, int iterations);
  bool starts;  // from given drives, and keeps a history
};

PhaseSolution gs(const SkinProblem& problem, const Eigen::VectorXcd& start, int iterations) {
  return solve_gs(problem, start, {iterations});
}
PhaseSolution wgs(const SkinProblem& problem, const Eigen::VectorXcd& start, int iterations) {
  return solve_wgs(problem, start, {iterations});
}
PhaseSolution gs_pat(const SkinProblem& problem, const Eigen::VectorXcd& /*start*/, int iterations) {
  return solve_gs_pat(problem, {iterations});
}
PhaseSolution eigen(const SkinProblem& problem, const Eigen::VectorXcd& /*start*/, int /*iterations*/) {
  return solve_eigen(problem);
}
PhaseSolution lbfgs(const SkinProblem& problem, const Eigen::VectorXcd& start, int iterations) {
  return solve_lbfgs(problem, start, {iterations});
}

const std::vector<Method>& point_methods() {
  static const std::vector<Method> methods = {
      {"gs", gs, true}, {"wgs", wgs, true}, {"gs_pat", gs_pat, false}, {"eigen", eigen, false}};
  return methods;
}

std::vector<Method> all_methods() {
  std::vector<Method> methods = point_methods();
  methods.push_back({"lbfgs", lbfgs, true});
  return methods;
}

Complex unit(Complex x) { return x == 0.0 ? Complex(1.0) : x / std::abs(x); }

Eigen::VectorXcd unit(const Eigen::VectorXcd& x) {
  return x.unaryExpr([](Complex value) { return unit(value); });
}

void expect_sound(const SkinProblem& problem, const Method& method, const Eigen::VectorXcd& start, int iterations,
                  const PhaseSolution& solution) {
  ASSERT_EQ(solution.phases.size(), problem.channel_count());
  EXPECT_TRUE((solution.phases.array() >= 0.0).all() && (solution.phases.array() < 2.0 * kPi).all());
  EXPECT_EQ(solution.amplitudes, Eigen::VectorXd::Ones(problem.channel_count()));
  EXPECT_LE(solution.iterations, iterations);
  if (solution.status == PhaseStatus::kIterationLimit) {
    EXPECT_EQ(solution.iterations, iterations);
  }
  if (!method.starts) {
    EXPECT_TRUE(solution.cost_history.empty());
    EXPECT_EQ(solution.status == PhaseStatus::kDirect, method.name == "eigen");
    return;
  }
  ASSERT_EQ(solution.cost_history.size(), static_cast<std::size_t>(solution.iterations) + 1);
  const auto [least, most] = std::minmax_element(solution.cost_history.begin(), solution.cost_history.end());
  EXPECT_TRUE(*least >= 0.0 && std::isfinite(*most));
  EXPECT_NEAR(solution.cost_history.front(), skin_cost(problem, unit(start)), 1e-12 * *most);
  EXPECT_NEAR(solution.cost_history.back(), skin_cost(problem, drive(solution)), 1e-12 * *most);
}

PhaseSolution sound(const SkinProblem& problem, const Method& method, const Eigen::VectorXcd& start, int iterations) {
  PhaseSolution solution = method.solve(problem, start, iterations);
  expect_sound(problem, method, start, iterations, solution);
  return solution;
}

/// The greatest distance of two sets of unit drives, their common phase aside.
double distance_but_for_a_turn(const Eigen::VectorXcd& a, const Eigen::VectorXcd& b) {
  return (a - unit(b.dot(a)) * b).cwiseAbs().maxCoeff();
}

// ---- Gerchberg-Saxon

/// Both kinds as published, with the limits baselines.h gives the weights.
Eigen::VectorXcd direct_gerchberg_saxon(const SkinProblem& problem, Eigen::VectorXcd q, int iterations, bool weighted) {
  const Eigen::Index faces = problem.target_count();
  std::vector<double> v(static_cast<std::size_t>(faces), 1.0);
  for (int i = 0; i < iterations; ++i) {
    std::vector<Complex> u;
    double mean = 0.0;
    for (Eigen::Index j = 0; j < faces; ++j) {
      u.push_back((problem.target.row(j) * q)(0));
      mean += std::abs(u.back()) / problem.amplitudes(j) / static_cast<double>(faces);
    }
    if (weighted) {
      double sum = 0.0;
      for (std::size_t j = 0; j < v.size(); ++j) {
        const double share = std::abs(u[j]) / problem.amplitudes(static_cast<Eigen::Index>(j));
        v[j] *= mean / std::max(share, 1e-3 * mean);
        sum += v[j];
      }
      for (double& weight : v) weight = std::max(weight * static_cast<double>(faces) / sum, 1e-6);
    }
    for (Eigen::Index n = 0; n < q.size(); ++n) {
      Complex sum = 0.0;
      for (std::size_t j = 0; j < v.size(); ++j) {
        const auto row = static_cast<Eigen::Index>(j);
        sum += std::conj(problem.target(row, n)) * v[j] * problem.amplitudes(row) * unit(u[j]);
      }
      q(n) = unit(sum);
    }
  }
  return q;
}

TEST(Baselines, GerchbergSaxonsFollowTheirFormulas) {
  for (unsigned seed = 30; seed < 40; ++seed) {
    SkinProblem problem = random_problem(2 + seed % 5, 1, 9, 0.4, seed);
    problem.target.row(0) *= seed % 2 == 0 ? 1.0 : 1e-7;  // beyond both limits of the weights
    const Eigen::VectorXcd start = random_start(9, seed);
    for (const int iterations : {1, 2, 6}) {
      EXPECT_LT((drive(gs(problem, start, iterations)) - direct_gerchberg_saxon(problem, start, iterations, false))
                    .cwiseAbs()
                    .maxCoeff(),
                kRounding);
      EXPECT_LT((drive(wgs(problem, start, iterations)) - direct_gerchberg_saxon(problem, start, iterations, true))
                    .cwiseAbs()
                    .maxCoeff(),
                kRounding);
    }
  }
}

// ---- GS-PAT

/// As published: columns of B in turn, sums written out.
Eigen::VectorXcd direct_gs_pat(const SkinProblem& problem, int iterations) {
  const Eigen::Index faces = problem.target_count();
  const Eigen::Index channels = problem.channel_count();
  Eigen::MatrixXcd b(channels, faces);
  for (Eigen::Index j = 0; j < faces; ++j) {
    double energy = 0.0;
    for (Eigen::Index n = 0; n < channels; ++n) energy += std::norm(problem.target(j, n));
    for (Eigen::Index n = 0; n < channels; ++n) b(n, j) = std::conj(problem.target(j, n)) / energy;
  }
  Eigen::VectorXcd p = problem.amplitudes.cast<Complex>();
  for (int i = 0; i <= iterations; ++i) {
    const Eigen::VectorXcd g = problem.target * (b * p);
    for (Eigen::Index j = 0; j < faces; ++j) {
      const double wanted = problem.amplitudes(j);
      p(j) = i < iterations ? wanted * g(j) / std::abs(g(j)) : wanted * wanted * g(j) / std::norm(g(j));
    }
  }
  return unit(b * p);
}

TEST(Baselines, GsPatFollowsItsFormulas) {
  for (unsigned seed = 100; seed < 120; ++seed) {
    const SkinProblem problem = random_problem(2 + seed % 6, 2, 3 + seed % 17, 0.3, seed);
    for (const int iterations : {1, 3, 40}) {
      const Eigen::VectorXcd q = drive(solve_gs_pat(problem, {iterations}));
      EXPECT_LT((q - direct_gs_pat(problem, iterations)).cwiseAbs().maxCoeff(), 1e-8) << "seed " << seed;
    }
  }
}

// ---- Eigensolver

/// Power iteration on M, columns as published, then the N x N normal equations.
Eigen::VectorXcd direct_eigen(const SkinProblem& problem) {
  const Eigen::Index faces = problem.target_count();
  const Eigen::Index channels = problem.channel_count();
  Eigen::MatrixXcd m(faces, faces);
  for (Eigen::Index j = 0; j < faces; ++j) {
    const Eigen::VectorXcd focus =
        problem.target.row(j).adjoint() * (problem.amplitudes(j) / problem.target.row(j).squaredNorm());
    m.col(j) = problem.target * focus;
  }
  // M^(2^20) but for its size: any gap above 1e-4 is resolved to rounding.
  Eigen::MatrixXcd power = m / m.norm();
  for (int i = 0; i < 20; ++i) {
    power = (power * power).eval();
    power /= power.norm();
  }
  Eigen::Index widest = 0;
  power.colwise().norm().maxCoeff(&widest);
  const Eigen::VectorXcd dominant = power.col(widest).normalized();
  const Eigen::VectorXcd image = m * dominant;
  EXPECT_LT((image - dominant.dot(image) * dominant).norm(), 1e-10 * image.norm());
  Eigen::MatrixXcd normal = problem.target.adjoint() * problem.target;
  for (Eigen::Index n = 0; n < channels; ++n) {
    normal(n, n) += problem.amplitudes.dot(problem.target.col(n).cwiseAbs()) / static_cast<double>(faces);
  }
  const Eigen::VectorXcd wanted = problem.amplitudes.cwiseProduct(unit(dominant));
  return unit(normal.partialPivLu().solve(problem.target.adjoint() * wanted));
}

TEST(Baselines, EigensolverFollowsItsFormulas) {
  for (unsigned seed = 130; seed < 150; ++seed) {
    // More faces than channels, and fewer.
    const SkinProblem problem = random_problem(2 + seed % 6, 2, 2 + seed % 11, 0.1 + 0.1 * (seed % 5), seed);
    const Eigen::VectorXcd q = drive(solve_eigen(problem));
    EXPECT_LT(distance_but_for_a_turn(q, direct_eigen(problem)), 1e-8) << "seed " << seed;  // condition below 1e4
  }
}

// ---- L-BFGS

TEST(Baselines, LbfgsAgreesWithSurface) {
  for (const double level : {0.3, 1.0}) {  // what can be had exactly, and what cannot
    for (unsigned seed = 200; seed < 206; ++seed) {
      const SkinProblem problem = random_problem(4, 6, 30, level, seed);
      const Eigen::VectorXcd start = adjoint_start(problem);
      const SurfaceOptions options{.iterations = 200};
      const double expected = solve_surface(problem, start, options).cost_history.back();
      const PhaseSolution solution = lbfgs(problem, start, 1000);
      EXPECT_NEAR(solution.cost_history.back(), expected, 0.01 * expected + 1e-9 * solution.cost_history.front())
          << "seed " << seed;
      EXPECT_LT(solution.cost_history.back(), 0.99 * solution.cost_history.front());
    }
  }
}

// ---- Edges

TEST(Baselines, ChannelsWithoutReachKeepTheirPhase) {
  SkinProblem problem = random_problem(4, 3, 20, 0.3, 280);
  problem.amplitudes(3) = 0.0;
  problem.target.col(5).setZero();
  problem.outside.col(5).setZero();
  problem.target.col(9).head(3).setZero();  // hears of the unwanted face and of the skin outside the target only
  problem.target.col(11).setZero();
  problem.outside.col(11).setZero();
  Eigen::VectorXcd start = random_start(20, 12);
  start(11) = 0.0;
  for (const Method& method : all_methods()) {
    SCOPED_TRACE(method.name);
    const Eigen::VectorXcd q = drive(sound(problem, method, start, 30));
    EXPECT_LT(std::abs(q(5) - (method.starts ? start(5) : 1.0)), 1e-15);
    EXPECT_EQ(q(11), 1.0);
    if (method.name != "lbfgs") {
      EXPECT_LT(std::abs(q(9) - (method.starts ? start(9) : 1.0)), 1e-15);
    }
  }
}

TEST(Baselines, ExtremeProblemsAreSolvedInSilence) {
  auto cases = extreme_problems(1500);
  cases.emplace_back("more faces than channels, a micropascal", random_problem(40, 0, 6, 0.3, 319));
  cases.back().second.amplitudes.setConstant(1e-6);
  SkinProblem& opposed = cases.emplace_back("opposed faces", random_problem(2, 0, 8, 0.3, 322)).second;
  opposed.target.row(1) = -opposed.target.row(0);
  opposed.amplitudes.setOnes();  // g = 0 in the first step of gs_pat
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  for (const auto& [name, problem] : cases) {
    const Eigen::VectorXcd start = random_start(problem.channel_count(), 15);
    for (const Method& method : all_methods()) {
      SCOPED_TRACE(name + ", " + method.name);
      const PhaseSolution solution = sound(problem, method, start, 300);
      if (method.name == "lbfgs") {
        EXPECT_TRUE(std::is_sorted(solution.cost_history.rbegin(), solution.cost_history.rend()));
        if (problem.channel_count() > 1) {
          EXPECT_LT(solution.cost_history.back(), solution.cost_history.front());
        }
      }
    }
  }
  const std::string printed = testing::internal::GetCapturedStdout() + testing::internal::GetCapturedStderr();
  EXPECT_EQ(printed, "");
}

}  // namespace touchfield::baselines_test
