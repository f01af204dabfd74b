#include <stdexcept>

#include <gtest/gtest.h>

#include "sim/gpu/cuda/phase_steps.cuh"
#include "solvers/phase/incident_problem.h"
#include "solvers/phase/skin_jacobian.h"
#include "solvers/phase/surface.h"
#include "tests/gpu/card.h"
#include "tests/support/fake_phase_device.h"
#include "tests/support/skin_support.h"

namespace touchfield {
namespace {

using Complex = std::complex<double>;

double relative(const auto& value, const auto& expected) {
  const double size = expected.norm();
  return (value - expected).norm() / (size > 0 ? size : 1.0);
}

class Phase : public CardTest {
 protected:
  std::unique_ptr<GramDevice> on_card(const Eigen::MatrixXcd& q) {
    cuda::Array<cuDoubleComplex> there(context());
    there.upload(reinterpret_cast<const cuDoubleComplex*>(q.data()), static_cast<std::size_t>(q.size()));
    return cuda::make_gram_device(context(), std::move(there), static_cast<int>(q.rows()));
  }
  SkinProblem moved(SkinProblem problem) {
    move_to(gpu(), problem);
    return problem;
  }
  IncidentProblem moved(IncidentProblem problem) {
    problem.device = on_card(problem.gram);
    problem.gram.resize(0, 0);
    return problem;
  }
};

// ---- Each call against its definition

/// K, r, N.
class SkinCalls : public Phase, public ::testing::WithParamInterface<std::tuple<int, int, int>> {
 protected:
  void SetUp() override {
    Phase::SetUp();
    std::tie(faces_, rank_, channels_) = GetParam();
    problem_ = random_problem(faces_, rank_, channels_, 0.3, 10);
    if (::testing::Test::IsSkipped()) return;
    FakePhaseDevice fake;
    for (PhaseDevice* device : {static_cast<PhaseDevice*>(&fake), static_cast<PhaseDevice*>(&gpu())}) {
      move_to(*device, problem_);
      devices_.push_back(problem_.device);
    }
  }

  /// A point with some radial moves and some rows of R left out.
  SkinMoves moves() {
    Uniform uniform(11);
    directions_ = random_matrix(faces_, 1, uniform);
    phasors_ = random_start(channels_, 12);
    for (int n = 0; n < channels_; n += 3) radial_.push_back(n);
    return {directions_.data(), phasors_.data(), radial_.data(), static_cast<int>(radial_.size()), rank_ - rank_ / 5};
  }

  int faces_ = 0;
  int rank_ = 0;
  int channels_ = 0;
  SkinProblem problem_;
  std::vector<std::shared_ptr<SkinDevice>> devices_;
  Eigen::VectorXcd directions_;
  Eigen::VectorXcd phasors_;
  std::vector<std::ptrdiff_t> radial_;
};

TEST_P(SkinCalls, SumsOfRowsAreThose) {
  for (int i = 0; i < faces_ + rank_; ++i) {
    EXPECT_NEAR(devices_[1]->reach()[i], devices_[0]->reach()[i], 1e-12 * devices_[0]->reach()[i]);
    EXPECT_NEAR(devices_[1]->strengths()[i], devices_[0]->strengths()[i], 1e-12 * devices_[0]->strengths()[i]);
  }
}

TEST_P(SkinCalls, ProductsAreThose) {
  const Eigen::VectorXcd q = random_drives(channels_, 13);
  const Eigen::VectorXcd v = random_drives(faces_ + rank_, 14);
  for (const int kept : {rank_, rank_ / 2, 0}) {
    std::vector<Eigen::VectorXcd> sent(2, Eigen::VectorXcd::Zero(faces_ + kept));
    std::vector<Eigen::VectorXcd> back(2, Eigen::VectorXcd::Zero(channels_));
    std::vector<Eigen::VectorXcd> last = back;
    for (std::size_t i = 0; i < 2; ++i) {
      devices_[i]->send(q.data(), faces_ + kept, sent[i].data());
      devices_[i]->send_back(v.data(), 0, faces_ + kept, back[i].data());
      devices_[i]->send_back(v.data(), rank_ - kept, faces_ + kept, last[i].data());
    }
    EXPECT_LT(relative(sent[1], sent[0]), 1e-13);
    EXPECT_LT(relative(back[1], back[0]), 1e-13);
    EXPECT_LT(relative(last[1], last[0]), 1e-13);
  }
}

TEST_P(SkinCalls, ProductsInSinglePrecisionAreThose) {
  const Eigen::VectorXd scale = Eigen::VectorXd::LinSpaced(faces_ + rank_, 0.5, 2.0);
  for (const int width : {1, 2, 5}) {
    Uniform uniform(15);
    const Eigen::MatrixXcf y = random_matrix(channels_, width, uniform).cast<std::complex<float>>();
    const Eigen::MatrixXcf v = random_matrix(faces_ + rank_, width, uniform).cast<std::complex<float>>();
    std::vector<Eigen::MatrixXcf> sent(2, Eigen::MatrixXcf::Zero(faces_ + rank_, width));
    std::vector<Eigen::MatrixXcf> back(2, Eigen::MatrixXcf::Zero(channels_, width));
    for (std::size_t i = 0; i < 2; ++i) {
      devices_[i]->scale_single(scale.data());
      devices_[i]->send_single(width, y.data(), sent[i].data());
      devices_[i]->send_back_single(width, v.data(), back[i].data());
    }
    EXPECT_LT(relative(sent[1], sent[0]), 3e-6);
    EXPECT_LT(relative(back[1], back[0]), 3e-6);
  }
}

TEST_P(SkinCalls, StepsAreThose) {
  const SkinMoves at = moves();
  const double largest = devices_[0]->largest_row(at);
  EXPECT_NEAR(devices_[1]->largest_row(at), largest, 1e-12 * largest);
  const int rows = faces_ + 2 * at.outside_rows;
  const int columns = channels_ + at.radial_count;
  const Eigen::VectorXd scale =
      (0.03 * largest * Eigen::VectorXd::LinSpaced(columns, 1.0, 3.0)).cwiseSqrt().cwiseInverse();
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(rows, -1.0, 2.0);
  Eigen::VectorXd expected(columns);
  ASSERT_TRUE(devices_[0]->factorise(at, scale.data(), true));
  devices_[0]->correct(right.data(), 1.0, expected.data());
  for (const bool in_double : {true, false}) {
    ASSERT_TRUE(devices_[1]->factorise(at, scale.data(), in_double));
    for (int again = 0; again < 2; ++again) {  // with another right-hand side in between
      Eigen::VectorXd found(columns);
      double left = right.norm();
      for (int correction = 0; correction < 4; ++correction) {
        const double after = devices_[1]->correct(correction == 0 ? right.data() : nullptr, left, found.data());
        EXPECT_LE(after, std::max(0.01 * left, 1e-11 * right.norm()));
        left = std::max(after, 1e-300);
      }
      EXPECT_LT(left, 1e-11 * right.norm());
      EXPECT_LT(relative(found, expected), 1e-9);
      const Eigen::VectorXd other = Eigen::VectorXd::Ones(right.size());
      devices_[1]->correct(other.data(), 1.0, found.data());
    }
  }
}

// Each two of three sizes of each number meet.
using Sizes = std::tuple<int, int, int>;
INSTANTIATE_TEST_SUITE_P(Sizes, SkinCalls,
                         ::testing::Values(Sizes{1, 0, 64}, Sizes{1, 30, 640}, Sizes{1, 300, 5}, Sizes{20, 0, 640},
                                           Sizes{20, 30, 5}, Sizes{20, 300, 64}, Sizes{170, 0, 5}, Sizes{170, 30, 64},
                                           Sizes{170, 300, 640}));

// ---- The methods

void expect_same(const PhaseSolution& found, const PhaseSolution& expected) {
  EXPECT_NEAR(found.cost_history.back(), expected.cost_history.back(), 1e-6 * expected.cost_history.front());
  EXPECT_LT(relative(drive(found), drive(expected)), 1e-4);
}

TEST_F(Phase, SurfaceEndsWhereTheProcessorDoes) {
  for (const auto& [faces, rank, channels] : {std::tuple{20, 15, 90}, {30, 40, 24}, {12, 0, 64}}) {
    const SkinProblem problem = random_problem(faces, rank, channels, 0.3, 30);
    const SkinProblem there = moved(problem);
    const Eigen::VectorXcd start = random_start(channels, 31);
    for (const bool free : {false, true}) {
      SurfaceOptions options;
      options.iterations = 8;
      options.free_amplitudes = free;
      expect_same(solve_surface(there, start, options), solve_surface(problem, start, options));
    }
  }
}

TEST_F(Phase, TheSearchEndsAsLow) {
  const SkinProblem problem = random_problem(30, 10, 24, 0.3, 34);
  const double found = search_surface(moved(problem), Eigen::MatrixXcd(24, 0), {}).cost_history.back();
  const double expected = search_surface(problem, Eigen::MatrixXcd(24, 0), {}).cost_history.back();
  EXPECT_NEAR(found, expected, 0.05 * expected);  // annealing in single precision may end in another trap as good
}

TEST_F(Phase, ValuesThatAreNotFiniteAreRefusedAndNeverLoopForEver) {
  SkinProblem problem = random_problem(4, 2, 6, 0.3, 37);
  const SkinProblem sound = moved(problem);
  problem.outside(1, 2) = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THROW(solve_surface(moved(problem), random_start(6, 1), {}), std::invalid_argument);
  SkinJacobian jacobian(sound);
  SkinField field;
  const Eigen::VectorXcd q = random_start(6, 2);
  send(sound, q, field);
  jacobian.set(field, q);
  DampedStep step;
  Eigen::VectorXd h;
  EXPECT_FALSE(step.solve(jacobian, Eigen::VectorXd::Constant(6, std::nan("")), h));
}

IncidentProblem incident(Eigen::Index rows, Eigen::Index unknowns, Eigen::Index targets, unsigned seed) {
  Uniform uniform(seed);
  const Eigen::MatrixXcd c = random_matrix(rows, unknowns, uniform);
  return {c.adjoint() * c, targets};
}

TEST_F(Phase, PaperStepsAsTheProcessorDoes) {
  for (const Eigen::Index unknowns : {1, 40, 150}) {
    const IncidentProblem problem = incident(200, unknowns, unknowns / 4, 40);
    LevenbergMarquardtOptions options;
    options.iterations = 6;
    const Eigen::VectorXd start = Eigen::VectorXd::LinSpaced(unknowns, 0.0, 20.0);
    const PhaseSolution expected = solve_incident(problem, start, options);
    const PhaseSolution found = solve_incident(moved(problem), start, options);
    for (std::size_t i = 0; i < expected.cost_history.size(); ++i) {
      EXPECT_NEAR(found.cost_history.at(i), expected.cost_history[i], 1e-9 * expected.cost_history[0]);
    }
  }
}

TEST_F(Phase, PaperStepsOfAlmostSingularMatricesAreInDouble) {
  const IncidentProblem problem = incident(12, 60, 20, 42);
  for (const double tau : {1e-5, 1e-7, 1e-9}) {
    LevenbergMarquardtOptions options;
    options.iterations = 4;
    options.initial_damping = tau;
    const Eigen::VectorXd start = Eigen::VectorXd::LinSpaced(60, 0.0, 9.0);
    const PhaseSolution expected = solve_incident(problem, start, options);
    const PhaseSolution found = solve_incident(moved(problem), start, options);
    for (std::size_t i = 0; i < expected.cost_history.size(); ++i) {
      EXPECT_NEAR(found.cost_history.at(i), expected.cost_history[i], 1e-13 / tau * expected.cost_history[0]) << tau;
    }
  }
}

// ---- What a long run needs

TEST_F(Phase, RunsRepeatBitForBitAndTakeNoMoreMemory) {
  const SkinProblem problem = moved(random_problem(20, 15, 64, 0.3, 50));
  const IncidentProblem paper = moved(incident(90, 70, 10, 51));
  SurfaceOptions options;
  options.iterations = 3;
  options.free_amplitudes = true;
  LevenbergMarquardtOptions steps;
  steps.iterations = 3;
  const Eigen::VectorXcd start = random_start(64, 52);
  const Eigen::VectorXd angles = Eigen::VectorXd::Zero(70);
  const PhaseSolution first = solve_surface(problem, start, options);
  const PhaseSolution first_paper = solve_incident(paper, angles, steps);
  const std::size_t taken = gpu().taken();
  for (int i = 0; i < 200; ++i) {
    const PhaseSolution again = solve_surface(problem, start, options);
    ASSERT_EQ(again.cost_history, first.cost_history);
    ASSERT_EQ(again.phases, first.phases);
    ASSERT_EQ(solve_incident(paper, angles, steps).phases, first_paper.phases);
    ASSERT_EQ(gpu().taken(), taken);
  }
}

TEST_F(Phase, AFailureOfTheCardIsThrown) {
  for (const int calls : {2, 9, 30}) {
    GpuLimits limits;
    limits.fail_after = calls;
    const auto broken = open_gpu(0, limits);
    const auto solve = [&] {
      SkinProblem problem = random_problem(5, 4, 20, 0.3, 53);
      move_to(*broken, problem);
      solve_surface(problem, random_start(20, 54), {});
    };
    EXPECT_THROW(solve(), GpuFailure) << calls;
    EXPECT_EQ(broken->taken(), 0U);
  }
}

}  // namespace
}  // namespace touchfield
