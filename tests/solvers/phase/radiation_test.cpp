#include "solvers/phase/radiation.h"

#include <cmath>

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

}  // namespace touchfield::radiation_test
