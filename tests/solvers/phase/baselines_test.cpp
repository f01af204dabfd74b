#include "solvers/phase/baselines.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <stdexcept>
#include <string>
#include <vector>

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

// ---- Known answers

TEST(Baselines, OneFaceGetsPhaseConjugation) {
  const SkinProblem problem = random_problem(1, 0, 12, 2.5, 10);  // more than all channels together make
  const double reach = problem.target.cwiseAbs().sum();
  ASSERT_GT(problem.amplitudes(0), reach);
  const Eigen::VectorXcd conjugate = unit(problem.target.adjoint().eval().col(0));
  for (const Method& method : all_methods()) {
    SCOPED_TRACE(method.name);
    const Eigen::VectorXcd q = drive(sound(problem, method, random_start(12, 1), 200));
    // lbfgs stops by the share of the cost, which is flat to second order in the phases.
    const double phase_error = method.name == "lbfgs" ? 1e-4 : 1e-9;
    EXPECT_LT(distance_but_for_a_turn(q, conjugate), phase_error);
    EXPECT_NEAR(std::abs((problem.target * q)(0)), reach, std::max(phase_error * phase_error, 1e-14) * reach);
  }
}

TEST(Baselines, FacesWithChannelsOfTheirOwnAllGetPhaseConjugation) {
  SkinProblem problem = random_problem(3, 0, 12, 2.5, 20);
  for (Eigen::Index j = 0; j < 3; ++j) {
    for (Eigen::Index n = 0; n < 12; ++n) {
      problem.target(j, n) *= n / 4 == j ? 1.0 : 0.0;
    }
  }
  const Eigen::VectorXd reach = problem.target.cwiseAbs().rowwise().sum();
  for (const Method& method : all_methods()) {
    SCOPED_TRACE(method.name);
    const Eigen::VectorXcd q = drive(sound(problem, method, random_start(12, 2), 500));
    const double error = method.name == "lbfgs" ? 1e-6 : 1e-13;  // lbfgs stops by the share of the cost
    EXPECT_LT(((problem.target * q).cwiseAbs() - reach).cwiseAbs().maxCoeff(), error * reach.maxCoeff());
  }
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
      for (double& weight : v) {
        weight = std::max(weight * static_cast<double>(faces) / sum, 1e-6);
      }
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

TEST(Baselines, GerchbergSaxonNeverLowersItsMeasure) {
  for (unsigned seed = 50; seed < 70; ++seed) {
    const Eigen::Index channels = 1 + seed % 13;
    const SkinProblem problem = random_problem(1 + seed % 7, 2, channels, 0.3, seed);
    const Eigen::VectorXcd start = random_start(channels, seed);
    const auto measure = [&](const Eigen::VectorXcd& q) {
      return problem.amplitudes.dot((problem.target * q).cwiseAbs());
    };
    double last = measure(start);
    std::vector<double> history;
    for (int iterations = 1; iterations <= 25; ++iterations) {
      const PhaseSolution solution = gs(problem, start, iterations);
      const double now = measure(drive(solution));
      EXPECT_GE(now, last * (1.0 - 1e-14)) << "seed " << seed << ", iteration " << iterations;
      last = now;
      // A longer run goes on where a shorter one ended.
      ASSERT_GE(solution.cost_history.size(), history.size());
      EXPECT_TRUE(std::equal(history.begin(), history.end(), solution.cost_history.begin()));
      history = solution.cost_history;
    }
  }
}

TEST(Baselines, GerchbergSaxonConvergesWhereAnotherStepChangesNothing) {
  const SkinProblem problem = random_problem(3, 0, 20, 0.3, 71);
  const PhaseSolution solution = gs(problem, random_start(20, 3), 100000);
  ASSERT_EQ(solution.status, PhaseStatus::kConverged);
  EXPECT_LT(solution.iterations, 100000);
  const Eigen::VectorXcd q = drive(solution);
  EXPECT_LT((direct_gerchberg_saxon(problem, q, 1, false) - q).cwiseAbs().maxCoeff(), 1.1e-10);
  EXPECT_EQ(gs(problem, random_start(20, 3), 2).status, PhaseStatus::kIterationLimit);
}

/// Standard deviation of |u_j| / p'_j over its mean.
double spread(const SkinProblem& problem, const PhaseSolution& solution) {
  const Eigen::ArrayXd share = (problem.target * drive(solution)).array().abs() / problem.amplitudes.array();
  return std::sqrt((share - share.mean()).square().mean()) / share.mean();
}

TEST(Baselines, WeightsEvenThePointsOut) {
  int exact = 0;
  for (unsigned seed = 80; seed < 90; ++seed) {
    SkinProblem problem = random_problem(6, 0, 60, 0.3, seed);
    problem.target.topRows(3) *= 0.3;
    problem.amplitudes.tail(2) *= 2.0;
    const Eigen::VectorXcd start = random_start(60, seed);
    const double even = spread(problem, wgs(problem, start, 300));
    // Ten channels to a point can serve it. What is left is a point that hears too much of the others at no weight.
    EXPECT_LT(even, 0.1) << "seed " << seed;
    EXPECT_GT(spread(problem, gs(problem, start, 300)), 5.0 * even) << "seed " << seed;
    exact += even < 1e-6 ? 1 : 0;
  }
  EXPECT_GE(exact, 7);
}

TEST(Baselines, WeightsDoNotSpendAllOnAPointInDeepShadow) {
  SkinProblem problem = random_problem(4, 0, 60, 0.3, 95);
  problem.target.row(1) *= 1e-9;
  const Eigen::VectorXd reach = problem.target.cwiseAbs().rowwise().sum();
  const Eigen::VectorXcd q = drive(wgs(problem, random_start(60, 4), 300));
  for (const Eigen::Index j : {0, 2, 3}) {
    // Evenly shared, three points get 1 / sqrt(3) each of what one would.
    EXPECT_GT(std::abs((problem.target.row(j) * q)(0)), 0.2 * reach(j)) << "face " << j;
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
    for (Eigen::Index n = 0; n < channels; ++n) {
      energy += std::norm(problem.target(j, n));
    }
    for (Eigen::Index n = 0; n < channels; ++n) {
      b(n, j) = std::conj(problem.target(j, n)) / energy;
    }
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

TEST(Baselines, GsPatStopsWhereThePointsStandStill) {
  const SkinProblem problem = random_problem(4, 0, 40, 0.3, 121);
  const PhaseSolution solution = solve_gs_pat(problem, {100000});
  ASSERT_EQ(solution.status, PhaseStatus::kConverged);
  EXPECT_LT(solution.iterations, 100000);
  const Eigen::VectorXcd later = direct_gs_pat(problem, 2 * solution.iterations);
  // A move of 1e-10 is followed by ever smaller ones.
  EXPECT_LT((drive(solution) - later).cwiseAbs().maxCoeff(), 1e-7);
  EXPECT_EQ(solve_gs_pat(problem, {1}).status, PhaseStatus::kIterationLimit);
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

TEST(Baselines, EigensolverSendsLoudWishesStraightBack) {
  // s_n^2 grows with p', theta does not change: at last q = S^-1 H^H p' e^{i theta}.
  SkinProblem problem = random_problem(5, 0, 12, 0.3, 151);
  problem.amplitudes *= 1e9;
  Eigen::MatrixXcd power = problem.target * problem.target.adjoint() *
                           problem.amplitudes.cwiseQuotient(problem.target.rowwise().squaredNorm()).asDiagonal();
  for (int i = 0; i < 20; ++i) {
    power = (power * power / power.squaredNorm()).eval();
  }
  const Eigen::VectorXcd wanted = problem.amplitudes.cwiseProduct(unit(power.col(0)));
  // h / p' from the limit.
  EXPECT_LT(distance_but_for_a_turn(drive(solve_eigen(problem)), unit(problem.target.adjoint() * wanted)), 1e-6);
}

TEST(Baselines, EigensolverRefusesAWishLostInRounding) {
  SkinProblem problem = random_problem(9, 0, 3, 0.3, 152);
  problem.amplitudes *= 1e-25;
  EXPECT_THROW(solve_eigen(problem), std::domain_error);
}

// ---- L-BFGS

/// Greatest curvature of the cost along any unit move of the phases, 2 (|J|^2 + |f| |f''|) at most.
double greatest_curvature(const SkinProblem& problem) {
  const Eigen::ArrayXd reach = problem.target.cwiseAbs().rowwise().sum();
  return 4.0 * ((problem.weights.array() * reach * (2.0 * reach + problem.amplitudes.array())).sum() +
                2.0 * problem.outside.cwiseAbs().rowwise().sum().squaredNorm());
}

TEST(Baselines, LbfgsNeverRaisesTheCostAndEndsWhereItIsFlat) {
  int converged = 0;
  for (unsigned seed = 160; seed < 200; ++seed) {
    const Eigen::Index channels = 2 + seed % 13;
    const SkinProblem problem = random_problem(1 + seed % 9, seed % 4, channels, 0.1 + 0.1 * (seed % 7), seed);
    const PhaseSolution solution = sound(problem, {"lbfgs", lbfgs, true}, random_start(channels, seed), 2000);
    const auto& history = solution.cost_history;
    EXPECT_TRUE(std::is_sorted(history.rbegin(), history.rend())) << "seed " << seed;
    if (solution.status == PhaseStatus::kConverged) {
      ++converged;
      // A step that lowers the cost by 1e-10 at most: g^2 is about 1e-10 cost curvature; 100 for a poor last step.
      const double silence = silent_cost(problem);
      const double flat = 10.0 * std::sqrt(1e-10 * history.back() * greatest_curvature(problem)) +
                          1e-10 * std::max(silence, history.front());
      EXPECT_LT(2.0 * skin_half_gradient(problem, drive(solution)).lpNorm<Eigen::Infinity>(), flat) << "seed " << seed;
    }
  }
  EXPECT_GE(converged, 35);
}

TEST(Baselines, LbfgsAgreesWithSurface) {
  for (const double level : {0.3, 1.0}) {  // what can be had exactly, and what cannot
    for (unsigned seed = 200; seed < 206; ++seed) {
      const SkinProblem problem = random_problem(4, 6, 30, level, seed);
      const Eigen::VectorXcd start = adjoint_start(problem);
      SurfaceOptions options;
      options.iterations = 200;
      const double expected = solve_surface(problem, start, options).cost_history.back();
      const PhaseSolution solution = lbfgs(problem, start, 1000);
      EXPECT_NEAR(solution.cost_history.back(), expected, 0.01 * expected + 1e-9 * solution.cost_history.front())
          << "seed " << seed;
      EXPECT_LT(solution.cost_history.back(), 0.99 * solution.cost_history.front());
    }
  }
}

TEST(Baselines, LbfgsPrintsNothingWhereTheCostHardlyChanges) {
  testing::internal::CaptureStderr();
  for (const unsigned seed : {37U, 72U, 107U, 182U, 187U}) {
    const Eigen::Index channels = 2 + seed % 11;
    SkinProblem problem = random_problem(1 + seed % 7, seed % 3, channels, 0.05 + 0.1 * (seed % 9), seed);
    problem.amplitudes.setConstant(1e6);
    sound(problem, {"lbfgs", lbfgs, true}, random_start(channels, seed), 3000);
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

TEST(Baselines, LbfgsReturnsAStationaryStart) {
  // Three in line, one of them against the other two.
  SkinProblem problem;
  problem.target = Eigen::MatrixXcd::Ones(1, 3);
  problem.amplitudes = Eigen::VectorXd::Constant(1, 3.0);
  problem.weights = Eigen::VectorXd::Ones(1);
  problem.outside.resize(0, 3);
  const Eigen::Vector3cd start(1.0, 1.0, -1.0);
  const PhaseSolution solution = sound(problem, {"lbfgs", lbfgs, true}, start, 50);
  EXPECT_EQ(solution.status, PhaseStatus::kConverged);
  EXPECT_EQ(solution.iterations, 0);
  EXPECT_DOUBLE_EQ(solution.cost_history.front(), 4.0);
  EXPECT_LT((drive(solution) - start).norm(), 1e-15);
}

// ---- Invariance

TEST(Baselines, TheOrderOfChannelsDoesNotMatter) {
  const SkinProblem problem = random_problem(5, 4, 30, 0.3, 210);
  const Eigen::VectorXcd start = random_start(30, 5);
  Eigen::PermutationMatrix<Eigen::Dynamic> turn(30);
  turn.setIdentity();
  std::shuffle(turn.indices().begin(), turn.indices().end(), std::mt19937(1));
  SkinProblem shuffled = problem;
  shuffled.target = problem.target * turn.transpose();
  shuffled.outside = problem.outside * turn.transpose();
  for (const Method& method : all_methods()) {
    const Eigen::VectorXcd expected = turn * drive(method.solve(problem, start, 20));
    const Eigen::VectorXcd q = drive(method.solve(shuffled, turn * start, 20));
    EXPECT_LT(distance_but_for_a_turn(q, expected), 1e-7) << method.name;
    if (method.name != "eigen") {
      EXPECT_LT((q - expected).cwiseAbs().maxCoeff(), 1e-7) << method.name;
    }
  }
}

TEST(Baselines, TheOrderOfFacesDoesNotMatter) {
  const SkinProblem problem = random_problem(6, 4, 30, 0.3, 220);
  SkinProblem turned = problem;
  turned.target = problem.target.colwise().reverse().eval();
  turned.amplitudes = problem.amplitudes.reverse().eval();
  turned.weights = problem.weights.reverse().eval();
  turned.outside = problem.outside.colwise().reverse().eval();
  const Eigen::VectorXcd start = random_start(30, 6);
  for (const Method& method : all_methods()) {
    const Eigen::VectorXcd expected = drive(method.solve(problem, start, 20));
    const Eigen::VectorXcd q = drive(method.solve(turned, start, 20));
    EXPECT_LT(distance_but_for_a_turn(q, expected), 1e-7) << method.name;
  }
}

TEST(Baselines, ATurnOfTheStartTurnsTheAnswer) {
  const SkinProblem problem = random_problem(5, 4, 30, 0.3, 230);
  const Eigen::VectorXcd start = random_start(30, 7);
  const Complex turn = std::polar(1.0, 0.7);
  for (const Method& method : all_methods()) {
    if (method.starts) {
      const Eigen::VectorXcd expected = turn * drive(method.solve(problem, start, 20));
      EXPECT_LT((drive(method.solve(problem, turn * start, 20)) - expected).cwiseAbs().maxCoeff(), 1e-7) << method.name;
      // Only phases count: powers of two leave no rounding at all.
      EXPECT_EQ(method.solve(problem, 4.0 * start, 20).phases, method.solve(problem, start, 20).phases) << method.name;
    }
  }
}

TEST(Baselines, TheUnitOfPressureDoesNotMatter) {
  const SkinProblem problem = random_problem(5, 4, 30, 0.3, 240);
  const Eigen::VectorXcd start = random_start(30, 8);
  for (const double pressure : {1e-12, 1e9}) {
    SkinProblem scaled = problem;
    scaled.target *= pressure;
    scaled.amplitudes *= pressure;
    scaled.outside *= pressure;
    for (const Method& method : all_methods()) {
      const Eigen::VectorXcd expected = drive(method.solve(problem, start, 20));
      EXPECT_LT(distance_but_for_a_turn(drive(method.solve(scaled, start, 20)), expected), 1e-7) << method.name;
    }
  }
}

TEST(Baselines, OnlyLbfgsKnowsOfWeightsAndTheSkinOutside) {
  const SkinProblem problem = random_problem(5, 4, 30, 0.3, 250);
  SkinProblem bare = problem;
  bare.weights *= 3.0;
  bare.weights(2) = 9.0;
  bare.outside.resize(0, 30);
  const Eigen::VectorXcd start = random_start(30, 9);
  for (const Method& method : point_methods()) {
    EXPECT_LT((drive(method.solve(problem, start, 20)) - drive(method.solve(bare, start, 20))).cwiseAbs().maxCoeff(),
              1e-14)
        << method.name;
  }
  EXPECT_GT(distance_but_for_a_turn(drive(lbfgs(problem, start, 20)), drive(lbfgs(bare, start, 20))), 0.1);
}

TEST(Baselines, LoudnessAsSuchDoesNotMatterToGerchbergSaxons) {
  const SkinProblem problem = random_problem(5, 4, 30, 0.3, 260);
  SkinProblem loud = problem;
  loud.amplitudes *= 1e6;
  const Eigen::VectorXcd start = random_start(30, 10);
  for (const Method& method : point_methods()) {
    if (method.name != "eigen") {
      const Eigen::VectorXcd expected = drive(method.solve(problem, start, 20));
      EXPECT_LT((drive(method.solve(loud, start, 20)) - expected).cwiseAbs().maxCoeff(), 1e-7) << method.name;
    }
  }
}

// ---- Edges

TEST(Baselines, FacesWithoutWishOrReachTakeNoPart) {
  const SkinProblem less = random_problem(4, 3, 20, 0.3, 270);
  SkinProblem more = random_problem(6, 3, 20, 0.3, 271);
  more.target({0, 2, 3, 5}, Eigen::all) = less.target;
  more.amplitudes({0, 2, 3, 5}) = less.amplitudes;
  more.amplitudes(1) = 0.0;
  more.target.row(4).setZero();
  const Eigen::VectorXcd start = random_start(20, 11);
  for (const Method& method : point_methods()) {
    SCOPED_TRACE(method.name);
    const Eigen::VectorXcd expected = drive(sound(less, method, start, 20));
    EXPECT_LT(distance_but_for_a_turn(drive(sound(more, method, start, 20)), expected), 1e-7);
  }
}

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

TEST(Baselines, NothingWantedChangesNothing) {
  SkinProblem problem = random_problem(4, 3, 20, 0.3, 290);
  problem.amplitudes.setZero();
  const Eigen::VectorXcd start = random_start(20, 13);
  for (const bool deaf : {false, true}) {
    if (deaf) {
      problem.target.setZero();
      problem.outside.setZero();
    }
    for (const Method& method : all_methods()) {
      SCOPED_TRACE(method.name);
      const PhaseSolution solution = sound(problem, method, start, 10);
      if (method.name != "lbfgs" || deaf) {
        const Eigen::VectorXcd expected = method.starts ? start : Eigen::VectorXcd::Ones(20).eval();
        EXPECT_LT((drive(solution) - expected).cwiseAbs().maxCoeff(), 1e-15);
        EXPECT_NE(solution.status, PhaseStatus::kIterationLimit);
      } else {
        EXPECT_LT(solution.cost_history.back(), 0.5 * solution.cost_history.front());  // it makes silence
      }
    }
  }
}

TEST(Baselines, CoincidentChannelsThatStartAlikeStayAlike) {
  SkinProblem problem = random_problem(6, 4, 20, 0.3, 300);
  problem.target.col(13) = problem.target.col(4);
  problem.outside.col(13) = problem.outside.col(4);
  Eigen::VectorXcd start = random_start(20, 14);
  start(13) = start(4);
  for (const Method& method : all_methods()) {
    const Eigen::VectorXcd q = drive(method.solve(problem, start, 30));
    EXPECT_LT(std::abs(q(13) - q(4)), 1e-10) << method.name;
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

TEST(Baselines, CallBackOncePerIteration) {
  const SkinProblem problem = random_problem(5, 3, 12, 0.3, 330);
  const Eigen::VectorXcd start = random_start(12, 16);
  for (const auto& solve : {solve_gs, solve_wgs, solve_lbfgs}) {
    for (const int iterations : {1, 4, 5000}) {
      std::vector<double> heard;
      const PhaseSolution solution = solve(problem, start, {iterations}, [&](int iteration, double cost) {
        EXPECT_EQ(iteration, static_cast<int>(heard.size()) + 1);
        heard.push_back(cost);
      });
      EXPECT_EQ(solution.status == PhaseStatus::kIterationLimit, iterations < 5000);
      ASSERT_EQ(heard.size() + 1, solution.cost_history.size());
      EXPECT_TRUE(std::equal(heard.begin(), heard.end(), solution.cost_history.begin() + 1));
    }
  }
}

TEST(Baselines, RefuseWhatIsNoProblem) {
  const SkinProblem problem = random_problem(3, 2, 4, 0.3, 340);
  const Eigen::VectorXcd start = Eigen::VectorXcd::Ones(4);
  SkinProblem bad = problem;
  bad.target(0, 1) = std::nan("");
  Eigen::VectorXcd endless = start;
  endless(2) = std::numeric_limits<double>::infinity();
  for (const Method& method : all_methods()) {
    SCOPED_TRACE(method.name);
    EXPECT_THROW(method.solve(bad, start, 10), std::invalid_argument);
    EXPECT_NO_THROW(method.solve(problem, start, 1));
    if (method.name != "eigen") {
      EXPECT_THROW(method.solve(problem, start, 0), std::invalid_argument);
      EXPECT_THROW(method.solve(problem, start, -3), std::invalid_argument);
    }
    if (method.starts) {
      EXPECT_THROW(method.solve(problem, Eigen::VectorXcd::Ones(5), 10), std::invalid_argument);
      EXPECT_THROW(method.solve(problem, Eigen::VectorXcd(), 10), std::invalid_argument);
      EXPECT_THROW(method.solve(problem, Eigen::VectorXcd::Constant(4, std::nan("")), 10), std::invalid_argument);
      EXPECT_THROW(method.solve(problem, endless, 10), std::invalid_argument);
    }
  }
}

}  // namespace touchfield::baselines_test
