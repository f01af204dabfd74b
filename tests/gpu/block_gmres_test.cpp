#include "sim/gpu/cuda/block_gmres.cuh"

#include <numeric>
#include <stdexcept>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "sim/gpu/cuda/products.cuh"
#include "solvers/linear/gmres.h"
#include "tests/gpu/linear_card.h"

namespace touchfield {
namespace {

using GpuGmres = LinearCardTest;

TEST_F(GpuGmres, AgreesWithTheProcessors) {
  for (const int n : {1, 7, 64, 500}) {
    const MatrixXcf a = near_identity(n, 3);
    for (const int columns : {1, 3, 40}) {
      SCOPED_TRACE(testing::Message() << n << " x " << columns);
      MatrixXcf b = random(n, columns, 5);
      for (int s = 0; s < columns; ++s) b.col(s) *= std::pow(10.0F, static_cast<float>(s % 25 - 12));
      const Solved solved = gmres_there(a, b, {1e-5, 100, 60});
      GmresOptions options;
      options.tolerance = 1e-5;
      const GmresResult expected = gmres(product_here(a), in_double(b), options);
      EXPECT_TRUE(solved.report.converged);
      EXPECT_NEAR(solved.report.steps, *std::max_element(expected.steps.begin(), expected.steps.end()), 1);
      const int known = n == 1 ? columns : 0;  // residuals after the only step
      EXPECT_NEAR(std::accumulate(widths_.begin(), widths_.end(), 0), expected.columns - known,
                  0.1 * expected.columns + 2);
      const std::vector<double> reached = residuals(a, b, solved.x);
      for (std::size_t s = 0; s < reached.size(); ++s) {
        EXPECT_LE(reached[s], 1.1e-5) << s;
        EXPECT_NEAR(reached[s], solved.report.residuals[s], 1e-6) << s;
      }
      for (Eigen::Index s = 0; s < columns; ++s) {
        EXPECT_LE((in_double(solved.x).col(s) - expected.x.col(s)).norm(), 5e-5 * expected.x.col(s).norm());
      }
    }
  }
}

TEST_F(GpuGmres, BeginsAnewAfterTheRestart) {
  const MatrixXcf a = near_identity(500, 17);
  const MatrixXcf b = random(500, 3, 19);
  const Solved solved = gmres_there(a, b, {1e-5, 200, 4});
  GmresOptions options;
  options.tolerance = 1e-5;
  options.restart = 4;
  const GmresResult expected = gmres(product_here(a), in_double(b), options);
  EXPECT_TRUE(solved.report.converged);
  EXPECT_GT(solved.report.products, solved.report.steps + 2);
  EXPECT_NEAR(solved.report.steps, *std::max_element(expected.steps.begin(), expected.steps.end()), 4);
  EXPECT_THAT(residuals(a, b, solved.x), testing::Each(testing::Le(1.1e-5)));
  cuda::GmresLimits limits{1e-5, 200, 60};
  limits.enough = [](int steps, double) { return steps == 3; };
  const Solved stopped = gmres_there(a, b, limits);
  EXPECT_FALSE(stopped.report.converged);
  EXPECT_EQ(stopped.report.steps, 3);
}

TEST_F(GpuGmres, AStartThatIsTheSolutionTakesNoStep) {
  const MatrixXcf a = near_identity(64, 23);
  const MatrixXcf b = random(64, 5, 29);
  const cuda::GmresLimits limits{1e-5, 100, 60};
  const Solved first = gmres_there(a, b, limits);
  const cuda::GmresLimits after{1.1e-5, 100, 60};  // products of another width round otherwise
  const Solved again = gmres_there(a, b, after, first.x);
  EXPECT_TRUE(again.report.converged);
  EXPECT_EQ(again.report.steps, 0);
  EXPECT_EQ(again.report.products, 1);
  EXPECT_EQ(again.x, first.x);

  MatrixXcf spoilt = first.x;
  spoilt.col(3) *= 2.0F;
  const Solved mended = gmres_there(a, b, after, spoilt);
  EXPECT_TRUE(mended.report.converged);
  EXPECT_THAT(std::vector<int>(widths_.begin() + 1, widths_.end()), testing::Each(1));
  EXPECT_THAT(residuals(a, b, mended.x), testing::Each(testing::Le(1.2e-5)));
  EXPECT_EQ(mended.x.leftCols(3), first.x.leftCols(3));

  const Solved near = gmres_there(a, b, limits, first.x * 1.001F);
  EXPECT_TRUE(near.report.converged);
  EXPECT_LT(near.report.steps, first.report.steps - 3);
}

// Few columns of so many rows are worked on in parts.
TEST_F(GpuGmres, LongColumnsAreOrthogonalisedToo) {
  constexpr int kRows = 20'011;
  const MatrixXcf values = MatrixXcf::Ones(kRows, 1) + 0.6F * MatrixXcf::Random(kRows, 1);
  for (const int columns : {1, 3}) {
    const MatrixXcf b = random(kRows, columns, 7);
    const Product here = [&](const MatrixXcd& x) { return MatrixXcd(in_double(values).col(0).asDiagonal() * x); };
    const GmresResult expected = gmres(here, in_double(b), {1e-5, 200, 60});
    const Matrix values_there = put(values);
    const Matrix b_there = put(b);
    const cuda::BlockProduct product = [&](const cuComplex* x, cuComplex* y, int count, const double*) {
      cuda::check(
          cublasCdgmm(context().blas(), CUBLAS_SIDE_LEFT, kRows, count, x, kRows, values_there.data(), 1, y, kRows),
          "test");
    };
    MatrixXcf first;
    for (int run = 0; run < 2; ++run) {
      Matrix x(context(), b_there.size());
      cuda::BlockGmres solver(context());
      const cuda::GmresReport report =
          solver.solve(product, kRows, columns, b_there.data(), x.data(), {1e-5, 200, 60}, false);
      EXPECT_TRUE(report.converged);
      EXPECT_NEAR(report.steps, *std::max_element(expected.steps.begin(), expected.steps.end()), 1);
      const MatrixXcf found = get(x, kRows);
      const MatrixXcd rest = in_double(b) - here(in_double(found));
      EXPECT_LT((rest.colwise().norm().array() / in_double(b).colwise().norm().array()).maxCoeff(), 1.1e-5);
      if (run == 0) first = found;
      EXPECT_EQ(found, first);
    }
  }
}

TEST_F(GpuGmres, ZeroColumnsAreSolvedByZero) {
  const MatrixXcf a = near_identity(64, 31);
  MatrixXcf b = random(64, 3, 37);
  b.col(1).setZero();
  for (const MatrixXcf& start : {MatrixXcf{}, MatrixXcf(b.array() + 1.0F)}) {
    const Solved solved = gmres_there(a, b, {1e-5, 100, 60}, start);
    EXPECT_TRUE(solved.report.converged);
    EXPECT_EQ(solved.x.col(1), MatrixXcf::Zero(64, 1));
    EXPECT_EQ(solved.report.residuals[1], 0.0);
    EXPECT_THAT(widths_, testing::Each(testing::Le(2)));
    EXPECT_THAT(residuals(a, b, solved.x), testing::Each(testing::Le(1.1e-5)));
  }
  const Solved none = gmres_there(a, MatrixXcf::Zero(64, 2), {1e-5, 100, 60});
  EXPECT_TRUE(none.report.converged);
  EXPECT_EQ(none.report.products, 0);
}

TEST_F(GpuGmres, GivesUpOnASingularMatrix) {
  std::vector<float> values(64, 2.0F);
  values[5] = 0.0F;
  values[6] = 3.0F;
  MatrixXcf b = MatrixXcf::Zero(64, 3);
  b(5, 0) = 1.0F;              // nothing of it can be reached
  b.col(1).setConstant(1.0F);  // all but one in 64
  b(7, 2) = 1.0F;
  const Solved solved = gmres_there(diagonal(values), b, {1e-5, 100, 60});
  EXPECT_FALSE(solved.report.converged);
  EXPECT_EQ(solved.report.residuals[0], 1.0);
  EXPECT_NEAR(solved.report.residuals[1], 1.0 / 8.0, 1e-5);
  EXPECT_LE(solved.report.residuals[2], 1e-5);
  EXPECT_EQ(solved.report.worst, 1.0);
  EXPECT_LT(solved.report.steps, 20);
}

TEST_F(GpuGmres, RefusesWhatIsNotFinite) {
  MatrixXcf a = near_identity(64, 59);
  MatrixXcf b = random(64, 3, 61);
  const cuda::GmresLimits limits{1e-5, 100, 60};
  EXPECT_THROW(gmres_there(a, b, {0.0, 100, 60}), std::invalid_argument);
  EXPECT_THROW(gmres_there(a, b, {1e-5, -1, 60}), std::invalid_argument);
  EXPECT_THROW(gmres_there(a, b, {1e-5, 100, 0}), std::invalid_argument);
  MatrixXcf start = b;
  start(0, 2) = std::numeric_limits<float>::infinity();
  EXPECT_THROW(gmres_there(a, b, limits, start), std::domain_error);
  a(3, 4) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THROW(gmres_there(a, b, limits), std::domain_error);
  b(63, 2) = std::numeric_limits<float>::quiet_NaN();
  EXPECT_THAT([&] { gmres_there(near_identity(64, 59), b, limits); },
              testing::ThrowsMessage<std::domain_error>(testing::HasSubstr("right-hand side 2")));
}

TEST_F(GpuGmres, FactorsOfANearMatrixSaveSteps) {
  const int n = 64;
  const MatrixXcf a = conditioned(n, 10.0, 89);
  const MatrixXcf b = random(n, 3, 97);
  const Matrix a_there = put(a);
  const Matrix b_there = put(b);
  Matrix factors = put(a + 0.002F * random(n, n, 101));
  cuda::Lu lu(context());
  lu.factorise(n, factors.data());
  const cuda::BlockPreconditioner inverse = [&](const cuComplex* v, cuComplex* z, int columns) {
    cuda::check(cudaMemcpyAsync(z, v, static_cast<std::size_t>(n * columns) * sizeof(cuComplex),
                                cudaMemcpyDeviceToDevice, context().stream()),
                "copy");
    lu.solve(CUBLAS_OP_N, columns, z);
  };
  cuda::BlockGmres solver(context());
  Matrix x(context(), b_there.size());
  const auto solve = [&](const cuda::BlockPreconditioner* precondition, bool x_is_start) {
    return solver.solve(product_there(a_there, n), n, 3, b_there.data(), x.data(), {5e-6, 100, 60}, x_is_start, {},
                        precondition);
  };
  const int plain = solve(nullptr, false).steps;
  const cuda::GmresReport report = solve(&inverse, false);
  EXPECT_TRUE(report.converged);
  EXPECT_GE(report.steps, 2);
  EXPECT_LT(3 * report.steps, plain);
  EXPECT_LE(report.products, report.steps + 1) << "of the first step the residual is known";
  EXPECT_THAT(residuals(a, b, get(x, n)), testing::Each(testing::Le(6e-6)));
  const MatrixXcf first = get(x, n);
  EXPECT_EQ(solve(nullptr, false).steps, plain) << "what was kept of the solve before spoils this one";
  solve(&inverse, false);
  EXPECT_EQ(get(x, n), first) << "not to the last bit";
  bool asked = false;
  const cuda::BlockPreconditioner never = [&](const cuComplex*, cuComplex*, int) { asked = true; };
  solve(&never, true);
  EXPECT_FALSE(asked);
  EXPECT_EQ(get(x, n), first);
}

}  // namespace
}  // namespace touchfield
