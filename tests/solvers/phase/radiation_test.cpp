#include "solvers/phase/radiation.h"

#include <random>

#include <gtest/gtest.h>

#include "solvers/phase/phase_solution.h"
#include "tests/support/radiation_support.h"

namespace touchfield::radiation_test {

/// Products in double precision up to the one with the matrix, which RadiationMisfit has in single.
SkinMap map_of(const RadiationProblem& problem) {
  Eigen::MatrixXcf all(problem.rows.rows() + problem.outside.rows(), problem.channel_count());
  all << problem.rows.cast<std::complex<float>>(), problem.outside.cast<std::complex<float>>();
  return {[all](const Eigen::VectorXcf& q) -> Eigen::VectorXcf { return all * q; },
          [all](const Eigen::VectorXcf& v) -> Eigen::VectorXcf { return all.adjoint() * v; }};
}

struct Freedom {
  const char* name;
  double wanted;  // factor on level
  bool level;
  bool amplitudes;
};

// Of the cost in double precision, at the level that the misfit chose.
TEST(Radiation, TheGradientIsThatOfTheCost) {
  for (const Freedom& freedom : {Freedom{"full drive", 0.2, false, false},
                                 {"free level", 0.002, true, false},
                                 {"free amplitudes", 0.02, false, true},
                                 {"both", 0.002, true, true}}) {
    SCOPED_TRACE(freedom.name);
    RadiationProblem problem = random_radiation_problem(9, 5, 4, 30, freedom.wanted, 3);
    problem.skin.energies *= 0.01;  // so that the best level is not the least one
    const SkinMap map = map_of(problem);
    const RadiationMisfit misfit(map, problem.skin, freedom.level, freedom.amplitudes);
    Uniform uniform(7);
    Eigen::VectorXd angles(freedom.amplitudes ? 60 : 30);
    Eigen::VectorXd along(angles.size());
    for (Eigen::Index n = 0; n < angles.size(); ++n) {
      angles(n) = uniform(0.2, 1.2);
      along(n) = uniform(-1.0, 1.0);
    }
    const auto cost = [&](double step) {
      const RadiationMisfit::Point point = misfit.at(angles + step * along);
      const PhaseSolution drives = misfit.solution(point, {});
      const double exact = radiation_cost(problem, drive(drives));
      EXPECT_NEAR(point.cost, exact, 1e-5 * exact);
      return exact;
    };
    constexpr double kStep = 1e-4;
    const double slope = (cost(kStep) - cost(-kStep)) / (2.0 * kStep);
    EXPECT_EQ(misfit.at(angles).level < 1.0, freedom.level);
    EXPECT_NEAR(misfit.gradient(misfit.at(angles)).dot(along), slope, 1e-4 * std::abs(slope));
  }
}

TEST(Radiation, TenRandomStartsEndAlike) {
  const RadiationProblem problem = sheet_problem(0.05);
  double least = std::numeric_limits<double>::infinity();
  double most = 0.0;
  for (unsigned seed = 1; seed <= 10; ++seed) {
    const PhaseSolution found = solve_radiation(problem, random_start(problem.channel_count(), seed));
    EXPECT_TRUE(std::ranges::is_sorted(found.cost_history, std::greater<>())) << seed;
    EXPECT_NEAR(radiation_cost(problem, drive(found)), found.cost_history.back(), 1e-5) << seed;
    least = std::min(least, found.cost_history.back());
    most = std::max(most, found.cost_history.back());
  }
  EXPECT_LT(most, 1.02 * least);
  EXPECT_LT(most, 0.6 * silent_cost(problem.skin));
  const PhaseSolution searched = solve_radiation(problem, radiation_starts(problem));
  EXPECT_LT(searched.cost_history.back(), 1.02 * least);
  const PhaseSolution free =
      solve_radiation(problem, radiation_starts(problem), {.free_amplitudes = true, .free_level = true});
  EXPECT_LT(free.cost_history.back(), searched.cost_history.back());
  EXPECT_LE(free.amplitudes.maxCoeff(), 1.0);
  EXPECT_GE(free.amplitudes.minCoeff(), 0.0);
}

TEST(Radiation, AnArrayThatIsTooStrongTurnsItselfDown) {
  for (const double level : {0.05, 5e-4, 5e-6}) {
    SCOPED_TRACE(level);
    const RadiationProblem problem = sheet_problem(level);
    const Eigen::MatrixXcd starts = radiation_starts(problem);
    const PhaseSolution full = solve_radiation(problem, starts);
    const PhaseSolution free = solve_radiation(problem, starts, {.free_level = true});
    EXPECT_TRUE((full.amplitudes.array() == 1.0).all());
    EXPECT_EQ(free.amplitudes.minCoeff(), free.amplitudes.maxCoeff());
    EXPECT_LE(free.amplitudes.maxCoeff(), 1.0);
    EXPECT_LT(free.cost_history.back(), 0.6 * silent_cost(problem.skin));
    EXPECT_LE(free.cost_history.back(), 1.02 * full.cost_history.back());
    if (level < 1e-5) {  // many steps at full drive find phases whose sound cancels on the skin
      const PhaseSolution soon = solve_radiation(problem, starts, {.iterations = 5, .free_level = true});
      EXPECT_LT(soon.amplitudes.maxCoeff(), 0.1);
      EXPECT_LT(soon.cost_history.back(), silent_cost(problem.skin));
      EXPECT_GT(solve_radiation(problem, starts, {.iterations = 5}).cost_history.back(), silent_cost(problem.skin));
    }
  }
}

TEST(Radiation, ExpectedPressuresOfChannelsThatAreNotAsDesigned) {
  constexpr int kDraws = 20'000;
  const RadiationProblem problem = random_radiation_problem(6, 3, 4, 20, 0.2, 5);
  const ChannelTolerances tolerances{.phase = 0.35, .gain = 0.1, .dead = 0.03};
  const RadiationProblem expected = with_tolerances(problem, tolerances);
  const double amplitude = 0.8;
  const Eigen::VectorXcd q = amplitude * random_start(20, 3);
  const auto pressures = [](const RadiationProblem& of, const Eigen::VectorXcd& drives) {
    Eigen::VectorXcd p(of.rows.rows() + of.outside.rows());
    p << of.rows * drives, of.outside * drives;
    return p;
  };
  std::mt19937 generator(1);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform;
  Eigen::VectorXd mean = Eigen::VectorXd::Zero(6);
  double energy = 0.0;
  for (int i = 0; i < kDraws; ++i) {
    Eigen::VectorXcd drives = q;
    for (std::complex<double>& drive : drives) {
      const double gain = 1.0 + tolerances.gain * normal(generator);
      drive *= std::polar(uniform(generator) < tolerances.dead ? 0.0 : gain, tolerances.phase * normal(generator));
    }
    const Eigen::VectorXcd p = pressures(problem, drives);
    mean += radiation_of(problem.skin, p) / kDraws;
    energy += problem.skin.energies.dot(p.cwiseAbs2()) / kDraws;
  }
  const Eigen::VectorXcd p = pressures(expected, q);
  const double level = amplitude * amplitude;
  const Eigen::VectorXd found = radiation_of(expected.skin, p) + level * expected.skin.deviations;
  EXPECT_LT((found - mean).cwiseAbs().maxCoeff(), 0.01 * mean.cwiseAbs().maxCoeff());
  const double found_energy = expected.skin.energies.dot(p.cwiseAbs2()) + level * expected.skin.deviation_energy;
  EXPECT_NEAR(found_energy, energy, 0.01 * energy);
  // The deviations are no small part of it, so they are tested.
  EXPECT_GT((level * expected.skin.deviations).cwiseAbs().maxCoeff(), 0.05 * mean.cwiseAbs().maxCoeff());
  const double misfit = expected.skin.weights.dot((found - expected.skin.wanted).cwiseAbs2());
  EXPECT_NEAR(radiation_cost(expected, q), misfit + found_energy, 1e-9 * misfit);
}

TEST(Radiation, TheBestLevelIsTheLowestPoint) {
  for (const double wanted : {0.002, 0.3}) {  // less than full drive presses, and more
    const RadiationProblem problem = random_radiation_problem(9, 5, 4, 30, wanted, 5);
    const Eigen::VectorXcd q = 0.5 * random_start(30, 6);
    const double level = best_level(problem, q);
    EXPECT_LE(level, 2.0);
    for (const double other : {0.0, 0.99 * level, std::min(1.01 * level, 2.0)}) {
      EXPECT_LE(radiation_cost(problem, level * q), radiation_cost(problem, other * q));
    }
  }
}

TEST(Radiation, FromSilenceThereAreNoNumbersThatAreNone) {
  for (const bool level : {false, true}) {
    for (const bool all : {false, true}) {
      RadiationProblem problem = sheet_problem(0.05);
      problem.rows.topRows(all ? problem.rows.rows() : problem.skin.face_count()).setZero();
      const PhaseSolution found = solve_radiation(problem, radiation_starts(problem), {.free_level = level});
      EXPECT_TRUE(found.phases.allFinite());
      EXPECT_TRUE(found.amplitudes.allFinite());
      EXPECT_TRUE(std::isfinite(found.cost_history.back()));
      EXPECT_GE(found.cost_history.back(), silent_cost(problem.skin) * (1 - 1e-6));
    }
  }
}

}  // namespace touchfield::radiation_test
