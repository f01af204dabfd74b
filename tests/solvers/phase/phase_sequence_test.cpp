#include "solvers/phase/phase_sequence.h"

#include <numbers>

#include <gtest/gtest.h>

#include "solvers/phase/phase_methods.h"
#include "solvers/phase/skin_problem.h"
#include "tests/support/skin_support.h"

namespace touchfield {
namespace {

/// Sound of 16 x 16 sources on a plane 100 mm above them, where a spot moves along a circle of 8 mm: 4 faces of 2 mm
/// are wanted in each frame, the other faces of the ring and points around it silent.
PhaseSequence ring(int frames) {
  constexpr int kFaces = 48;
  constexpr double kWaveNumber = 732.3;
  const auto row = [](const Eigen::Vector3d& x) {
    Eigen::RowVectorXcd h(256);
    for (int n = 0; n < 256; ++n) {
      const Eigen::Vector3d source((n % 16 - 7.5) * 0.01, (n / 16 - 7.5) * 0.01, 0.0);
      const double distance = (x - source).norm();
      h(n) = std::polar(1.0 / distance, kWaveNumber * distance);
    }
    return h;
  };
  PhaseSequence sequence;
  sequence.rows.resize(kFaces, 256);
  sequence.outside.resize(24, 256);
  for (int j = 0; j < kFaces; ++j) {
    const double angle = 2.0 * std::numbers::pi * j / kFaces;
    sequence.rows.row(j) = row({8e-3 * std::cos(angle), 8e-3 * std::sin(angle), 0.1});
  }
  for (int i = 0; i < 24; ++i) {
    const double angle = 2.0 * std::numbers::pi * i / 24;
    sequence.outside.row(i) = row({0.02 * std::cos(angle), 0.02 * std::sin(angle), 0.1});
  }
  sequence.amplitudes = Eigen::MatrixXd::Zero(kFaces, frames);
  sequence.weights = Eigen::MatrixXd::Ones(kFaces, frames);
  for (int k = 0; k < frames; ++k) {
    const int first = kFaces * k / frames;
    for (int i = 0; i < 4; ++i) sequence.amplitudes((first + i) % kFaces, k) = 300.0;
    sequence.middle.push_back((first + 1) % kFaces);
  }
  return sequence;
}

double error_of(const PhaseSequence& sequence, Eigen::Index frame, const PhaseSolution& solution) {
  const SkinProblem problem = problem_of(sequence, frame);
  return std::sqrt(skin_cost(problem, drive(solution)) / silent_cost(problem));
}

// The spot jumps by 2 mm, a quarter of the wavelength: far for a descent.
TEST(PhaseSequence, EachFrameComesAsNearAsOneLikesToWhatItIsAlone) {
  const PhaseSequence sequence = ring(24);
  constexpr Eigen::Index kFirst = 3;  // every sixth frame from here is compared
  double alone = 0.0;
  for (Eigen::Index k = kFirst; k < 24; k += 6) {
    const MethodSettings settings{.iterations = 100, .search = true};
    const PhaseSolution solution =
        phase_method("surface").solve(problem_of(sequence, k), Eigen::MatrixXcd(256, 0), settings, {});
    alone += error_of(sequence, k, solution) / 4;
  }
  double before = HUGE_VAL;
  for (const int iterations : {12, 30, 100}) {
    const std::vector<PhaseSolution> solutions = solve_sequence(sequence, {.iterations = iterations});
    ASSERT_EQ(solutions.size(), 24U);
    double mean = 0.0;
    for (Eigen::Index k = 3; k < 24; k += 6) {
      mean += error_of(sequence, k, solutions[static_cast<std::size_t>(k)]) / 4;
    }
    EXPECT_LT(mean, before);
    before = mean;
  }
  EXPECT_LT(before, alone + 0.01);
}

// The spot goes to the other side of the ring, where nothing of the frame before is of use.
TEST(PhaseSequence, ASpotThatJumpsTakesMoreSteps) {
  PhaseSequence sequence = ring(2);
  for (const int iterations : {3, 24, 130}) {
    const std::vector<PhaseSolution> solutions = solve_sequence(sequence, {.iterations = iterations});
    EXPECT_EQ(solutions[1].iterations, std::max(iterations, SequenceOptions{}.first_iterations));
  }
  sequence = ring(48);
  EXPECT_EQ(solve_sequence(sequence, {.iterations = 3})[1].iterations, 3);
}

TEST(PhaseSequence, SaysItsOwnCost) {
  const PhaseSequence sequence = ring(8);
  const std::vector<PhaseSolution> solutions = solve_sequence(sequence, {});
  for (Eigen::Index k = 0; k < 8; ++k) {
    const PhaseSolution& solution = solutions[static_cast<std::size_t>(k)];
    const double cost = skin_cost(problem_of(sequence, k), drive(solution));
    EXPECT_NEAR(solution.cost_history.back(), cost, 1e-4 * cost) << k;  // the descent multiplies in single precision
  }
}

TEST(PhaseSequence, AClosedOneKeepsTheLimitFromItsLastFrameToItsFirst) {
  const PhaseSequence sequence = ring(48);
  const auto last_turn = [](const std::vector<PhaseSolution>& solutions) {
    double largest = 0.0;
    for (Eigen::Index n = 0; n < 256; ++n) {
      const double turn = solutions.front().phases(n) - solutions.back().phases(n);
      largest = std::max(largest, std::abs(std::remainder(turn, 2.0 * std::numbers::pi)));
    }
    return largest;
  };
  constexpr double kMost = 0.4;
  EXPECT_GT(last_turn(solve_sequence(sequence, {.most_turn = kMost})), kMost);
  const std::vector<PhaseSolution> closed = solve_sequence(sequence, {.most_turn = kMost, .closed = true});
  EXPECT_LE(last_turn(closed), kMost + 1e-12);
  for (std::size_t k = 1; k < closed.size(); ++k) {
    EXPECT_LE(last_turn({closed[k - 1], closed[k]}), kMost + 1e-12) << k;
  }
}

}  // namespace
}  // namespace touchfield
