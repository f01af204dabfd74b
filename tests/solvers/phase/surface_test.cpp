#include "solvers/phase/surface.h"

#include <numbers>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <Eigen/QR>
#include <gtest/gtest.h>

#include "solvers/phase/skin_jacobian.h"
#include "solvers/phase/skin_problem.h"
#include "tests/support/skin_support.h"
#include "tests/support/threads_support.h"

namespace touchfield::surface_test {

using Complex = std::complex<double>;
constexpr double kPi = std::numbers::pi;

SurfaceOptions options_of(int iterations, bool free_amplitudes = false) {
  const SurfaceOptions options{.iterations = iterations, .free_amplitudes = free_amplitudes};
  return options;
}

// ---- The linear model

/// f as written in surface.h, the outside rows' parts in turn.
Eigen::VectorXd direct_residual(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  Eigen::VectorXd f(problem.target_count() + 2 * problem.outside.rows());
  f.head(problem.target_count()) =
      problem.weights.array().sqrt() * ((problem.target * q).array().abs() - problem.amplitudes.array());
  const Eigen::VectorXcd t = problem.outside * q;
  for (Eigen::Index i = 0; i < t.size(); ++i) {
    f(problem.target_count() + 2 * i) = t(i).real();
    f(problem.target_count() + 2 * i + 1) = t(i).imag();
  }
  return f;
}

struct Linearised {
  SkinProblem problem;
  Eigen::VectorXcd q;
  Eigen::VectorXcd phasors;
  std::vector<Eigen::Index> radial;
  SkinJacobian jacobian;

  Linearised(Eigen::Index faces, Eigen::Index rank, Eigen::Index channels, std::vector<Eigen::Index> moving,
             unsigned seed)
      : Linearised(random_problem(faces, rank, channels, 0.4, seed), std::move(moving), seed) {}

  Linearised(SkinProblem of, std::vector<Eigen::Index> moving, unsigned seed)
      : problem(std::move(of)),
        q(random_drives(problem.channel_count(), seed + 1)),
        phasors(q.array() / q.array().abs()),
        radial(std::move(moving)),
        jacobian(problem) {
    SkinField field;
    send(problem, q, field);
    jacobian.set(field, phasors);
    jacobian.set_radial(radial);
  }
  Linearised(const Linearised&) = delete;  // the Jacobian refers to the problem

  Eigen::MatrixXd dense() const {
    Eigen::MatrixXd j(jacobian.rows(), jacobian.columns());
    Eigen::VectorXd column;
    for (Eigen::Index i = 0; i < j.cols(); ++i) {
      jacobian.apply(Eigen::VectorXd::Unit(j.cols(), i), column);
      j.col(i) = column;
    }
    return j;
  }
};

TEST(SkinJacobian, EqualsCentralDifferencesOfTheResidual) {
  const Linearised at(5, 4, 8, {1, 6}, 100);
  EXPECT_LT((at.jacobian.residual() - direct_residual(at.problem, at.q)).norm(), 1e-13 * at.q.norm());
  const Eigen::MatrixXd j = at.dense();
  ASSERT_EQ(j.cols(), 10);
  constexpr double kStep = 1e-5;  // truncation 1e-10 and rounding eps / 1e-5 are both far below the tolerance
  for (Eigen::Index c = 0; c < j.cols(); ++c) {
    const Eigen::Index n = c < 8 ? c : at.radial[static_cast<std::size_t>(c - 8)];
    const Complex move = at.phasors(n) * (c < 8 ? Complex(0, kStep) : Complex(kStep, 0));
    Eigen::VectorXcd up = at.q;
    Eigen::VectorXcd down = at.q;
    up(n) += move;
    down(n) -= move;
    const Eigen::VectorXd difference =
        (direct_residual(at.problem, up) - direct_residual(at.problem, down)) / (2.0 * kStep);
    EXPECT_LT((j.col(c) - difference).norm(), 1e-6 * j.col(c).norm()) << "column " << c;
  }
}

TEST(SkinJacobian, SecondDerivativeEqualsDifferencesAlongTheTurns) {
  const Linearised at(random_problem(5, 4, 8, 0.02, 105), {}, 105);  // no face near silence, where it is another one
  Uniform uniform(106);
  Eigen::VectorXd turns(8);
  for (double& turn : turns) turn = uniform(-1.0, 1.0);
  Eigen::VectorXd y;
  at.jacobian.second_derivative(at.q.cwiseAbs(), turns, y);
  constexpr double kStep = 1e-3;  // truncation 1e-6 of it, rounding 1e-10
  const auto residual = [&](double s) {
    const Eigen::VectorXcd turned = at.q.array() * (Complex(0, s) * turns.cast<Complex>()).array().exp();
    return direct_residual(at.problem, turned);
  };
  const Eigen::VectorXd difference = (residual(kStep) - 2.0 * residual(0.0) + residual(-kStep)) / (kStep * kStep);
  EXPECT_LT((y - difference).norm(), 1e-4 * difference.norm());
}

TEST(SkinJacobian, TransposeGradientAndFilledMatrixAgree) {
  const Linearised at(5, 4, 37, {0, 3, 17, 36}, 110);  // three blocks of columns
  const Eigen::MatrixXd j = at.dense();
  Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(j.rows(), -1.0, 2.0);
  Eigen::VectorXd x;
  at.jacobian.apply_transpose(y, x);
  EXPECT_LT((x - j.transpose() * y).norm(), 1e-14 * j.norm() * y.norm());
  at.jacobian.gradient(x);
  EXPECT_LT((x - j.transpose() * at.jacobian.residual()).norm(), 1e-14 * j.norm() * at.jacobian.residual().norm());
  EXPECT_LT((x.head(37).array() * at.q.array().abs() - skin_half_gradient(at.problem, at.q).array()).matrix().norm(),
            1e-13 * x.norm());
  EXPECT_NEAR(at.jacobian.largest_row(), (j * j.transpose()).diagonal().maxCoeff(), 1e-13 * j.squaredNorm());

  const Eigen::VectorXd scale = Eigen::VectorXd::LinSpaced(j.cols(), 0.5, 2.0);
  const Eigen::MatrixXd scaled = j * scale.asDiagonal();
  Eigen::VectorXd outer;
  at.jacobian.apply_gram(scale, y, x, outer);
  EXPECT_LT((x - scaled.transpose() * y).norm(), 1e-14 * scaled.norm() * y.norm());
  EXPECT_LT((outer - scaled * scaled.transpose() * y).norm(), 1e-14 * scaled.squaredNorm() * y.norm());
  Eigen::MatrixXd filled(j.rows(), j.cols());
  at.jacobian.fill(scale, filled.data());
  EXPECT_LT((filled - scaled).norm(), 1e-14 * scaled.norm());
  Eigen::MatrixXf single(j.rows(), j.cols());
  at.jacobian.fill(scale, single.data());
  EXPECT_LT((single.cast<double>() - scaled).norm(), 1e-7 * scaled.norm());
}

TEST(SkinJacobian, RowsLeftOutAreMissingFromItButNotFromTheGradient) {
  SkinProblem problem = random_problem(5, 6, 37, 0.4, 140);
  problem.outside.rowwise().normalize();
  problem.outside.row(2) *= 0.1;  // weak, but not at the end
  problem.outside.bottomRows(2) *= 0.1;
  Linearised at(problem, {0, 3, 17, 36}, 140);
  SkinJacobian& jacobian = at.jacobian;
  Eigen::VectorXd left_out;
  EXPECT_FALSE(jacobian.gradient_left_out(left_out));
  const Eigen::MatrixXd whole = at.dense();
  const Eigen::VectorXd residual = jacobian.residual();
  ASSERT_EQ(whole.rows(), 17);
  const double largest = jacobian.largest_row();

  jacobian.leave_out_up_to(0.5);
  ASSERT_EQ(jacobian.rows(), 13);
  const Eigen::MatrixXd kept = at.dense();
  EXPECT_LT((kept - whole.topRows(13)).norm(), 1e-14 * whole.norm());
  EXPECT_EQ(Eigen::VectorXd(jacobian.residual()), residual.head(13));
  EXPECT_EQ(jacobian.largest_row(), largest);
  Eigen::VectorXd gradient;
  jacobian.gradient(gradient);
  EXPECT_LT((gradient - whole.transpose() * residual).norm(), 1e-14 * whole.norm() * residual.norm());
  ASSERT_TRUE(jacobian.gradient_left_out(left_out));
  EXPECT_LT((left_out - whole.bottomRows(4).transpose() * residual.tail(4)).norm(), 1e-14 * residual.norm());

  const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(13, -1.0, 2.0);
  const Eigen::VectorXd scale = Eigen::VectorXd::LinSpaced(kept.cols(), 0.5, 2.0);
  const Eigen::MatrixXd scaled = kept * scale.asDiagonal();
  Eigen::VectorXd x;
  Eigen::VectorXd outer;
  jacobian.apply_gram(scale, y, x, outer);
  EXPECT_LT((outer - scaled * scaled.transpose() * y).norm(), 1e-14 * scaled.squaredNorm() * y.norm());
  jacobian.apply_transpose(y, x);
  EXPECT_LT((x - kept.transpose() * y).norm(), 1e-14 * kept.norm() * y.norm());
  Eigen::MatrixXd filled(kept.rows(), kept.cols());
  jacobian.fill(scale, filled.data());
  EXPECT_LT((filled - scaled).norm(), 1e-14 * scaled.norm());

  jacobian.leave_out_up_to(0.0);
  EXPECT_EQ(jacobian.rows(), 17);
}

TEST(DampedStep, SolvesTheNormalEquationsOnEitherSide) {
  // 13 rows against 20, 12 and 13 + 5 columns.
  for (const auto& [channels, radial] :
       std::vector<std::pair<Eigen::Index, std::vector<Eigen::Index>>>{{20, {}}, {12, {}}, {13, {0, 2, 4, 6, 8}}}) {
    const Linearised at(5, 4, channels, radial, 120);
    const Eigen::MatrixXd j = at.dense();
    Eigen::VectorXd d(j.cols());
    for (Eigen::Index i = 0; i < d.size(); ++i) {
      d(i) = 1e-3 * at.jacobian.largest_row() * static_cast<double>(1 + i % 7);
    }
    Eigen::MatrixXd normal = j.transpose() * j;
    normal.diagonal() += d;
    const Eigen::VectorXd expected = normal.ldlt().solve(-j.transpose() * at.jacobian.residual());
    DampedStep solver;
    Eigen::VectorXd h;
    ASSERT_TRUE(solver.solve(at.jacobian, d, h));
    EXPECT_EQ(solver.double_count(), 0);
    // Residual 1e-8, condition about 1e3.
    EXPECT_LT((h - expected).norm(), 1e-6 * expected.norm()) << channels << " channels";
    const Eigen::VectorXd y = Eigen::VectorXd::LinSpaced(j.rows(), -1.0, 2.0);
    const Eigen::VectorXd again = normal.ldlt().solve(-j.transpose() * y);
    ASSERT_TRUE(solver.solve_again(at.jacobian, y, h));
    EXPECT_LT((h - again).norm(), 1e-6 * again.norm()) << channels << " channels";
  }
}

TEST(DampedStep, RowsLeftOutStayInTheGradient) {
  for (const Eigen::Index channels : {20, 7}) {  // and a radial move: on either side of 5 + 2 x 2 rows
    SkinProblem problem = random_problem(5, 4, channels, 0.4, 150);
    problem.outside.bottomRows(2) *= 0.01;
    Linearised at(problem, {1}, 150);
    Eigen::VectorXd gradient;
    at.jacobian.gradient(gradient);
    at.jacobian.leave_out_up_to(0.5 * at.problem.outside.row(1).squaredNorm());
    ASSERT_EQ(at.jacobian.rows(), 9);
    ASSERT_EQ(at.jacobian.rows() <= at.jacobian.columns(), channels == 20);
    const Eigen::MatrixXd j = at.dense();
    const Eigen::VectorXd d = 1e-3 * at.jacobian.largest_row() * Eigen::VectorXd::LinSpaced(j.cols(), 1.0, 7.0);
    Eigen::MatrixXd normal = j.transpose() * j;
    normal.diagonal() += d;
    const Eigen::VectorXd expected = normal.ldlt().solve(-gradient);
    DampedStep solver;
    Eigen::VectorXd h;
    ASSERT_TRUE(solver.solve(at.jacobian, d, h));
    EXPECT_LT((h - expected).norm(), 1e-6 * expected.norm()) << channels << " channels";  // as above
  }
}

// ---- What the minimiser promises

void expect_sound(const SkinProblem& problem, const PhaseSolution& solution) {
  EXPECT_TRUE(std::ranges::is_sorted(solution.cost_history, std::greater<>()));
  ASSERT_EQ(solution.phases.size(), problem.channel_count());
  EXPECT_TRUE((solution.phases.array() >= 0.0).all() && (solution.phases.array() < 2.0 * kPi).all());
  EXPECT_TRUE((solution.amplitudes.array() >= 0.0).all() && (solution.amplitudes.array() <= 1.0).all());
  EXPECT_EQ(solution.cost_history.size(), static_cast<std::size_t>(solution.iterations) + 1);
  EXPECT_NEAR(solution.cost_history.back(), skin_cost(problem, drive(solution)), 1e-12 * solution.cost_history.front());
}

TEST(Surface, TheCostNeverRisesAndIsThatOfTheDrives) {
  for (unsigned seed = 200; seed < 230; ++seed) {
    const Eigen::Index faces = 1 + seed % 9;
    const Eigen::Index rank = seed % 4;
    const Eigen::Index channels = 2 + seed % 13;
    const SkinProblem problem = random_problem(faces, rank, channels, 0.1 + 0.1 * (seed % 7), seed);
    for (const bool free_amplitudes : {false, true}) {
      SurfaceOptions options = options_of(40, free_amplitudes);
      options.initial_damping = std::pow(10.0, -static_cast<double>(seed % 5));
      const PhaseSolution solution = solve_surface(problem, random_start(channels, seed), options);
      expect_sound(problem, solution);
      if (!free_amplitudes) {
        EXPECT_EQ(solution.amplitudes, Eigen::VectorXd::Ones(channels));
      }
    }
  }
}

TEST(Surface, WeakOutsideRowsChangeTheStepsAndNotWhatIsReached) {
  // Forty rows that fall by four orders of magnitude, against the same in rising order, which leaves none out.
  SkinProblem falling = random_problem(12, 40, 60, 0.4, 160);
  const Eigen::HouseholderQR<Eigen::MatrixXcd> qr(falling.outside.adjoint());
  const Eigen::MatrixXcd basis = qr.householderQ() * Eigen::MatrixXcd::Identity(60, 40);
  const Eigen::VectorXd strengths =
      Eigen::VectorXd::LinSpaced(40, 1.0, -3.0).unaryExpr([](double x) { return std::pow(10.0, x); });
  falling.outside = strengths.asDiagonal() * basis.adjoint();
  SkinProblem rising = falling;
  rising.outside = falling.outside.colwise().reverse().eval();
  const Eigen::VectorXcd start = random_start(60, 160);
  const PhaseSolution with_all = solve_surface(rising, start, options_of(2000, false));
  const PhaseSolution with_less = solve_surface(falling, start, options_of(2000, false));
  expect_sound(falling, with_less);
  EXPECT_GT(std::abs(with_less.cost_history[1] / with_all.cost_history[1] - 1.0), 1e-4);  // rounding would be 1e-15
  // Both at the minimum, where the cost is flat.
  EXPECT_NEAR(with_less.cost_history.back(), with_all.cost_history.back(), 1e-6 * with_all.cost_history.back());
}

TEST(Surface, ManyWeakRowsThatAddUpAreNotLeftOut) {
  // 400 times one row, each far below the damping, together far above it: the same problem as with their sum.
  SkinProblem sum = random_problem(6, 1, 40, 0.5, 170);
  sum.outside *= 6.0 / sum.outside.norm();
  SkinProblem copies = sum;
  copies.outside = (sum.outside / 20.0).replicate(400, 1).eval();
  const Eigen::VectorXcd start = random_start(40, 170);
  const double expected = solve_surface(sum, start, options_of(30, false)).cost_history.back();
  const double reached = solve_surface(copies, start, options_of(30, false)).cost_history.back();
  // 0.2 of silence apart if they are all left out; a few of them are.
  EXPECT_NEAR(reached, expected, 1e-2 * silent_cost(sum));
}

/// The complex half gradient in the plane of each drive.
Eigen::VectorXcd plane_gradient(const SkinProblem& problem, const Eigen::VectorXcd& q) {
  const Eigen::VectorXcd u = problem.target * q;
  const Eigen::VectorXcd misfit =
      problem.weights.array() * (u.array().abs() - problem.amplitudes.array()) * u.array() / u.array().abs();
  return problem.target.adjoint() * misfit + problem.outside.adjoint() * (problem.outside * q);
}

TEST(Surface, EndsWhereNoAllowedMoveLowersTheCost) {
  int inside = 0;
  for (unsigned seed = 300; seed < 320; ++seed) {
    const SkinProblem problem = random_problem(4, 5, 8, 0.25, seed);
    for (const bool free_amplitudes : {false, true}) {
      SurfaceOptions options = options_of(5000, free_amplitudes);
      options.gradient_tolerance = 1e-9;
      options.step_tolerance = 0.0;
      const PhaseSolution solution = solve_surface(problem, random_start(8, seed), options);
      ASSERT_EQ(solution.status, PhaseStatus::kConverged) << "seed " << seed;
      const Eigen::VectorXcd q = drive(solution);
      const Eigen::VectorXcd x = plane_gradient(problem, q);
      const double zero = 1e-7 * solution.cost_history.front();
      for (Eigen::Index n = 0; n < 8; ++n) {
        const Complex in_frame = std::conj(std::polar(1.0, solution.phases(n))) * x(n);
        EXPECT_NEAR(in_frame.imag(), 0.0, zero);
        if (solution.amplitudes(n) < 1.0 - 1e-6) {
          EXPECT_NEAR(in_frame.real(), 0.0, zero);
          ++inside;
        } else if (free_amplitudes) {
          EXPECT_LT(in_frame.real(), zero);  // the cost pulls outwards
        }
      }
    }
  }
  EXPECT_GT(inside, 5);  // the case of free amplitudes did occur
}

// ---- Symmetries

TEST(Surface, UnitsChangeNothing) {
  const SkinProblem problem = random_problem(5, 3, 40, 0.3, 620);
  const Eigen::VectorXcd start = random_start(40, 3);
  const PhaseSolution expected = solve_surface(problem, start, options_of(8));
  for (const double pressure : {1e-12, 1e9}) {
    for (const double area : {1e-9, 1e6}) {
      SkinProblem scaled = problem;
      scaled.target *= pressure;
      scaled.amplitudes *= pressure;
      scaled.weights *= area;
      scaled.outside *= pressure * std::sqrt(area);
      const PhaseSolution solution = solve_surface(scaled, start, options_of(8));
      EXPECT_LT((drive(solution) - drive(expected)).norm(), 1e-4 * drive(expected).norm()) << pressure << ' ' << area;
    }
  }
}

TEST(Surface, TheNumberOfThreadsChangesNothing) {
  const SkinProblem problem = random_problem(30, 20, 150, 0.2, 630);
  const Eigen::VectorXcd start = random_start(150, 4);
  const auto solve = [&] { return solve_surface(problem, start, options_of(8)); };
  const Eigen::VectorXcd expected = drive(with_threads(1, solve));
  EXPECT_LT((drive(with_threads(3, solve)) - expected).norm(), 1e-4 * expected.norm());
}

// ---- Edges

TEST(Surface, LeavesSilence) {
  // u = 0 from zero phases on both faces: the gradient of |u| does not exist there.
  SkinProblem problem;
  problem.target.resize(2, 4);
  problem.target << 1.0, -1.0, 2.0, -2.0, Complex(0, 1), Complex(0, -1), 1.0, -1.0;
  problem.amplitudes = Eigen::VectorXd::Ones(2);
  problem.weights = Eigen::VectorXd::Ones(2);
  problem.outside.resize(0, 4);
  for (const bool free_amplitudes : {false, true}) {
    const PhaseSolution solution = solve_surface(problem, Eigen::VectorXcd::Ones(4), options_of(100, free_amplitudes));
    expect_sound(problem, solution);
    EXPECT_LT(solution.cost_history.back(), 1e-8 * solution.cost_history.front());
  }
  // From no drive at all.
  const PhaseSolution solution = solve_surface(problem, Eigen::VectorXcd::Zero(4), options_of(100, true));
  EXPECT_DOUBLE_EQ(solution.cost_history.front(), 2.0);
  EXPECT_LT(solution.cost_history.back(), 1e-8);
}

TEST(Surface, ExtremeProblemsAreSolvedOrReported) {
  auto cases = extreme_problems(3000);
  cases.emplace_back("nothing wanted", random_problem(6, 4, 20, 0.3, 706)).second.amplitudes.setZero();
  for (const auto& [name, problem] : cases) {
    for (const bool free_amplitudes : {false, true}) {
      SCOPED_TRACE(name + (free_amplitudes ? ", amplitudes free" : ""));
      const Eigen::Index channels = problem.channel_count();
      const PhaseSolution solution = solve_surface(problem, random_start(channels, 5), options_of(60, free_amplitudes));
      expect_sound(problem, solution);
      if (channels > 1) {
        EXPECT_LT(solution.cost_history.back(), solution.cost_history.front());
      }
    }
  }
}

TEST(Surface, StopsByItsTolerances) {
  const SkinProblem problem = random_problem(5, 3, 12, 0.9, 740);  // more than it can: a cost is left
  const Eigen::VectorXcd start = random_start(12, 7);
  SurfaceOptions options = options_of(1000);
  options.cost_tolerance = 1e-3;
  const PhaseSolution coarse = solve_surface(problem, start, options);
  ASSERT_EQ(coarse.status, PhaseStatus::kConverged);
  const auto& history = coarse.cost_history;
  EXPECT_LT(history[history.size() - 2] - history.back(), 1e-3 * history[history.size() - 2]);
  options = options_of(1000);
  options.gradient_tolerance = 1e-3;
  const PhaseSolution flat = solve_surface(problem, start, options);
  ASSERT_EQ(flat.status, PhaseStatus::kConverged);
  EXPECT_LE(skin_half_gradient(problem, drive(flat)).cwiseAbs().maxCoeff(), 1.001e-3 * flat.cost_history.back());
  EXPECT_LT(flat.iterations, solve_surface(problem, start, options_of(1000)).iterations);
}

// ---- Starts

TEST(SurfaceStarts, AdjointSendsTheWantedFieldBack) {
  const SkinProblem problem = random_problem(4, 2, 9, 0.3, 800);
  const Eigen::VectorXcd start = adjoint_start(problem);
  for (Eigen::Index n = 0; n < 9; ++n) {
    Complex sum = 0.0;
    for (Eigen::Index j = 0; j < 4; ++j) {
      sum += std::conj(problem.target(j, n)) * problem.weights(j) * problem.amplitudes(j);
    }
    EXPECT_LT(std::abs(start(n) - sum / std::abs(sum)), 1e-13);
  }
}

/// The relaxed problem in the space of the drives, where the code works in that of the rows.
struct Relaxed {
  double drive_energy = 0.0;
  Eigen::VectorXcd drives;
};

Relaxed relaxed_answer(const SkinProblem& problem, double epsilon) {
  const Eigen::MatrixXcd h = problem.weights.cwiseSqrt().asDiagonal() * problem.target;
  const Eigen::VectorXcd b = (problem.weights.cwiseSqrt().array() * problem.amplitudes.array()).cast<Complex>();
  Eigen::MatrixXcd normal = h.adjoint() * h + problem.outside.adjoint() * problem.outside;
  normal.diagonal().array() += epsilon;
  const Eigen::MatrixXcd back = normal.inverse() * h.adjoint() * b.asDiagonal();  // q = back y
  const Eigen::MatrixXcd left = Eigen::MatrixXcd(b.cwiseAbs2().asDiagonal()) - b.asDiagonal() * (h * back);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd> eigen(left);
  const Eigen::VectorXcd y = std::sqrt(static_cast<double>(b.size())) * eigen.eigenvectors().col(0);
  Relaxed relaxed;
  relaxed.drives = back * y;
  relaxed.drive_energy = relaxed.drives.squaredNorm();
  return relaxed;
}

TEST(SurfaceStarts, SpectralSolvesTheRelaxedProblem) {
  for (unsigned seed = 820; seed < 850; ++seed) {
    const SkinProblem problem = random_problem(3, 4, 20, 0.5, seed);
    double low = 1e-6;
    double high = 1e6;
    for (int i = 0; i < 60; ++i) {
      const double middle = std::sqrt(low * high);
      (relaxed_answer(problem, middle).drive_energy > 20.0 ? low : high) = middle;
    }
    const Relaxed expected = relaxed_answer(problem, high);
    ASSERT_LE(expected.drive_energy, 20.0 + 1e-6);
    const Eigen::VectorXcd start = spectral_start(problem);
    // Up to the common phase. The price of energy is found to 1 %, within which an answer may turn far: it must be that
    // of a price there.
    double nearest = 0;
    for (int i = 0; i <= 100; ++i) {
      const Relaxed there = relaxed_answer(problem, high * std::exp(1.05e-4 * i));
      const Eigen::VectorXcd phasors = there.drives.array() / there.drives.array().abs();
      nearest = std::max(nearest, std::abs(start.dot(phasors)));
    }
    EXPECT_GT(nearest, 0.999 * 20.0) << seed;  // of a hundred prices
  }
}

TEST(SurfaceStarts, SpectralLeavesOutFacesThatWantSilence) {
  SkinProblem problem = random_problem(4, 3, 12, 0.3, 830);
  problem.amplitudes(2) = 0.0;
  SkinProblem less = problem;
  less.target = problem.target({0, 1, 3}, Eigen::all);
  less.amplitudes = problem.amplitudes({0, 1, 3});
  less.weights = problem.weights({0, 1, 3});
  EXPECT_LT((spectral_start(problem) - spectral_start(less)).norm(), 1e-9);
  problem.amplitudes.setZero();
  EXPECT_EQ(spectral_start(problem), Eigen::VectorXcd::Ones(12));
  EXPECT_EQ(adjoint_start(problem), Eigen::VectorXcd::Ones(12));
}

TEST(SurfaceStarts, FittedSolvesTheLinearProblemOfItsOwnPhases) {
  for (unsigned seed = 850; seed < 856; ++seed) {
    SkinProblem problem = random_problem(4, 6, 30, 0.3, seed);
    problem.amplitudes *= seed % 2 == 0 ? 1e-3 : 1.0;  // what few channels at full drive make, and far less
    const Eigen::MatrixXcd h = problem.weights.cwiseSqrt().asDiagonal() * problem.target;
    const Eigen::VectorXcd b = (problem.weights.cwiseSqrt().array() * problem.amplitudes.array()).cast<Complex>();
    Eigen::MatrixXcd all(h.rows() + problem.outside.rows(), 30);
    all << h, problem.outside;
    const Eigen::MatrixXcd normal = all.adjoint() * all;
    const double largest = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(normal).eigenvalues().maxCoeff();
    Eigen::VectorXcd expected;
    double price = 1e-6;
    do {
      const Eigen::MatrixXcd back =
          (normal + price * largest * Eigen::MatrixXcd::Identity(30, 30)).inverse() * h.adjoint() * b.asDiagonal();
      Eigen::VectorXcd y = Eigen::VectorXcd::Ones(b.size());
      for (int round = 0; round < 30; ++round) {
        expected = back * y;
        y = (h * expected).array() / (h * expected).array().abs();
      }
      price *= 10;
    } while (expected.squaredNorm() > 30.0 && price < 10.0);
    const Eigen::VectorXcd clipped = expected.array() / expected.array().abs().max(1.0);
    const Eigen::VectorXcd start = fitted_start(problem);
    EXPECT_LT((start - clipped).norm(), 1e-6 * clipped.norm()) << seed;  // the normal matrix squares the condition
    EXPECT_LE(start.cwiseAbs().maxCoeff(), 1.0 + 1e-15);
  }
  SkinProblem silent = random_problem(4, 6, 30, 0.3, 857);
  silent.amplitudes.setZero();
  EXPECT_EQ(fitted_start(silent), Eigen::VectorXcd::Zero(30));
}

}  // namespace touchfield::surface_test
