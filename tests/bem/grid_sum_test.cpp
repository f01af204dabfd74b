#include "sim/bem/grid_sum.h"

#include <cmath>
#include <complex>
#include <numbers>
#include <numeric>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "sim/bem/grid_convolution.h"
#include "sim/bem/grid_spec.h"
#include "sim/bem/layer_sum.h"
#include "sim/hand/shapes.h"
#include "tests/support/linear_support.h"
#include "tests/support/mesh_support.h"
#include "tests/support/threads_support.h"

namespace touchfield::grid_sum_test {

constexpr double kWavenumber = 732.28;  // 40 kHz
constexpr double kGamma = 1.0 / kWavenumber;
constexpr Layer kLayers[] = {Layer::kSingle,       Layer::kDouble,        Layer::kAdjoint,
                             Layer::kBurtonMiller, Layer::kAdjointMiller, Layer::kSingleAdjoint};

GridSpec spec_for(const TriangleMesh& mesh, const Complex& wavenumber, double tolerance) {
  return choose_grid(grid_body(mesh), wavenumber, kGamma, tolerance).spec;
}

std::unique_ptr<const FaceSums> by_grid(const TriangleMesh& mesh, const Complex& wavenumber, double tolerance) {
  return make_grid_sums(mesh, wavenumber, kGamma, spec_for(mesh, wavenumber, tolerance));
}

TriangleMesh stretched(const TriangleMesh& mesh, const Vector3& factors) {
  return {factors.asDiagonal() * mesh.vertices(), mesh.triangles()};
}

/// |difference to direct sums| / |x| of D + i gamma W.
double product_error(const TriangleMesh& mesh, const Complex& wavenumber, double tolerance) {
  const Eigen::MatrixXcd x = random_matrix(mesh.face_count(), 1, 7);
  const LayerSum<double> direct(mesh, wavenumber, kGamma);
  return (by_grid(mesh, wavenumber, tolerance)->apply(Layer::kBurtonMiller, x) - direct.apply(Layer::kBurtonMiller, x))
             .norm() /
         x.norm();
}

/// Bodies that a grid could get wrong: a ball away from the origin, two with a narrow gap between them, two far apart,
/// a plate and a rod.
std::vector<TriangleMesh> bodies() {
  const TriangleMesh ball = icosphere(9e-3, 4);
  const auto moved = [&](const Vector3& by) { return shifted(ball, by); };
  return {moved({0.1, -0.2, 0.3}), together(ball, moved({0.0, 18.3e-3, 0.0})), together(ball, moved({0.0, 0.05, 0.06})),
          stretched(ball, {1.0, 0.05, 2.0}), stretched(ball, {0.4, 0.4, 8.0})};
}

TEST(GridSum, EveryLayerIsTheDirectSum) {
  for (const TriangleMesh& mesh : bodies()) {
    const Eigen::MatrixXcd x = random_matrix(mesh.face_count(), 2, 7);
    for (const double alpha : {0.0, 20.0}) {
      const Complex wavenumber(kWavenumber, alpha);
      const LayerSum<double> direct(mesh, wavenumber, kGamma);
      for (const double tolerance : {1e-4, 1e-6}) {  // single and double precision
        const auto grid = by_grid(mesh, wavenumber, tolerance);
        for (const Layer layer : kLayers) {
          const double unit = layer == Layer::kSingle || layer == Layer::kSingleAdjoint ? kGamma : 1.0;
          const Eigen::MatrixXcd expected = direct.apply(layer, x);
          EXPECT_LT((grid->apply(layer, x) - expected).norm(), tolerance * std::max(unit * x.norm(), expected.norm()))
              << static_cast<int>(layer) << ' ' << alpha << ' ' << tolerance << ' ' << mesh.face_count();
        }
        for (const Layer layer : {Layer::kDouble, Layer::kBurtonMiller}) {
          const Eigen::MatrixXcd expected = direct.apply_transpose(layer, x);
          EXPECT_LT((grid->apply_transpose(layer, x) - expected).norm(),
                    tolerance * std::max(x.norm(), expected.norm()));
        }
      }
    }
  }
}

// No more accurate than asked for either: a factor of 20 is a fifth of the time.
TEST(GridSum, ErrorsFollowTheTolerance) {
  const TriangleMesh mesh = icosphere(25e-3, 16);  // 5,120 faces, 2.8 edges a wavelength
  for (const double tolerance : {1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8}) {
    const double error = product_error(mesh, kWavenumber, tolerance);
    EXPECT_LT(error, tolerance);
    EXPECT_GT(error, tolerance / 30.0);
  }
}

// The transpose shares spreading and reading with the product: equal to rounding, whatever the error of both.
TEST(GridSum, TransposeIsTheAdjointOfTheBilinearForm) {
  const TriangleMesh mesh = icosphere(12e-3, 8);
  const Eigen::MatrixXcd x = random_matrix(mesh.face_count(), 2, 7);
  for (const auto& [tolerance, rounding] : {std::pair(1e-3, 1e-6), std::pair(1e-6, 1e-13)}) {
    const auto grid = by_grid(mesh, {kWavenumber, 5.0}, tolerance);
    for (const Layer layer : {Layer::kDouble, Layer::kBurtonMiller}) {
      const Complex left = (x.col(0).transpose() * grid->apply(layer, x.col(1)))(0, 0);
      const Complex right = (x.col(1).transpose() * grid->apply_transpose(layer, x.col(0)))(0, 0);
      EXPECT_LT(std::abs(left - right), rounding * x.norm() * x.norm());
    }
  }
  EXPECT_THROW(by_grid(mesh, kWavenumber, 1e-3)->apply_transpose(Layer::kSingle, x), std::invalid_argument);
  EXPECT_THROW(by_grid(mesh, kWavenumber, 1e-3)->apply(Layer::kSingle, x.topRows(3)), std::invalid_argument);
}

TEST(GridSum, StaticKernels) {
  const TriangleMesh mesh = icosphere(12e-3, 8);
  const auto grid = make_grid_sums(mesh, 0.0, 0.0, spec_for(mesh, kWavenumber, 1e-6));
  const Eigen::MatrixXcd ones = Eigen::MatrixXcd::Ones(mesh.face_count(), 1);
  // Seen from a centroid the body fills half of the full angle, but for what one point a face leaves out.
  EXPECT_LT((grid->apply(Layer::kDouble, ones).array() + 0.5).abs().maxCoeff(), 0.05);
  const LayerSum<double> direct(mesh, 1e-3, 0.0);  // k r = 2e-5
  EXPECT_LT((grid->apply(Layer::kDouble, ones) - direct.apply(Layer::kDouble, ones)).cwiseAbs().maxCoeff(), 1e-6);
}

TEST(GridSum, DoesNotDependOnThreadsOrOnTheOrderOfFaces) {
  const TriangleMesh mesh = icosphere(12e-3, 8);
  const Eigen::Index count = mesh.face_count();
  const Eigen::MatrixXcd x = random_matrix(count, 1, 7);
  const GridSpec spec = spec_for(mesh, kWavenumber, 1e-4);
  const auto grid = make_grid_sums(mesh, kWavenumber, kGamma, spec);
  const Eigen::MatrixXcd alone = with_threads(1, [&] { return grid->apply(Layer::kBurtonMiller, x); });
  const Eigen::MatrixXcd three = with_threads(3, [&] { return grid->apply(Layer::kBurtonMiller, x); });
  EXPECT_EQ(alone, three);
  std::vector<Eigen::Index> order(static_cast<std::size_t>(count));
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::shuffle(order.begin(), order.end(), std::mt19937(3));
  const TriangleMesh shuffled(mesh.vertices(), mesh.triangles()(Eigen::all, order));
  const Eigen::MatrixXcd other =
      make_grid_sums(shuffled, kWavenumber, kGamma, spec)->apply(Layer::kBurtonMiller, x(order, Eigen::all));
  EXPECT_LT((other - alone(order, Eigen::all)).norm(), 1e-6 * alone.norm());
}

template <typename Real>
class LineTransforms : public ::testing::Test {
 public:
  static constexpr double kTolerance = std::is_same_v<Real, float> ? 1e-6 : 1e-14;
};

using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(LineTransforms, Reals);

TYPED_TEST(LineTransforms, AreTheSumsTheyStandFor) {
  constexpr int kLanes = kGridLanes<TypeParam>;
  for (const int n : {2, 4, 6, 8, 10, 24, 30, 32, 36, 50, 90, 128, 150}) {  // each radix alone and after others
    const LineTransform<TypeParam> line(n);
    std::vector<TypeParam> re(static_cast<std::size_t>(n * kLanes));
    std::vector<TypeParam> im(re.size());
    std::vector<TypeParam> work(2 * re.size());
    for (std::size_t i = 0; i < re.size(); ++i) {
      re[i] = static_cast<TypeParam>(static_cast<double>(i * 37 % 101) / 101.0 - 0.5);
      im[i] = static_cast<TypeParam>(static_cast<double>(i * 53 % 97) / 97.0 - 0.5);
    }
    const std::vector<TypeParam> x_re = re;
    const std::vector<TypeParam> x_im = im;
    line.forward(re.data(), im.data(), work.data());
    for (const int l : {0, kLanes - 1}) {
      for (int m = 0; m < n; ++m) {
        std::complex<double> sum = 0;
        for (int j = 0; j < n; ++j) {
          const auto at = static_cast<std::size_t>(j * kLanes + l);
          sum += std::complex<double>(x_re[at], x_im[at]) * std::polar(1.0, -2.0 * std::numbers::pi * j * m / n);
        }
        const auto at = static_cast<std::size_t>(m * kLanes + l);
        EXPECT_LT(std::abs(std::complex<double>(re[at], im[at]) - sum), TestFixture::kTolerance * n) << n << ' ' << m;
      }
    }
    line.backward(re.data(), im.data(), work.data());
    for (std::size_t i = 0; i < re.size(); ++i) {
      EXPECT_NEAR(re[i] / static_cast<TypeParam>(n), x_re[i], TestFixture::kTolerance);
      EXPECT_NEAR(im[i] / static_cast<TypeParam>(n), x_im[i], TestFixture::kTolerance);
    }
  }
}

}  // namespace touchfield::grid_sum_test
