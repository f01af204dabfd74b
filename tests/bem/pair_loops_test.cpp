#include "sim/bem/pair_loops.h"

#include <cmath>
#include <limits>
#include <numbers>
#include <random>
#include <vector>

#include <gtest/gtest.h>

#include "solvers/linear/instruction_level.h"
#include "tests/support/reference_kernels.h"

namespace touchfield::pair_loops_test {

using std::numbers::pi;

constexpr Layer kLayers[] = {Layer::kSingle,       Layer::kDouble,        Layer::kAdjoint,
                             Layer::kBurtonMiller, Layer::kAdjointMiller, Layer::kSingleAdjoint};

/// Random sources in a cube of the given half side [half wavelengths] with unit normals.
template <typename Real>
struct Cloud {
  std::vector<Real> x, y, z, nx, ny, nz;

  Cloud(int count, double half, unsigned seed) {
    std::mt19937_64 generator(seed);
    std::uniform_real_distribution<double> place(-half, half);
    std::normal_distribution<double> direction;
    for (int i = 0; i < count; ++i) {
      const Vector3 n = Vector3(direction(generator), direction(generator), direction(generator)).normalized();
      x.push_back(static_cast<Real>(place(generator)));
      y.push_back(static_cast<Real>(place(generator)));
      z.push_back(static_cast<Real>(place(generator)));
      nx.push_back(static_cast<Real>(n.x()));
      ny.push_back(static_cast<Real>(n.y()));
      nz.push_back(static_cast<Real>(n.z()));
    }
  }

  int size() const { return static_cast<int>(x.size()); }
  PairSources<Real> sources() const { return {x.data(), y.data(), z.data(), nx.data(), ny.data(), nz.data()}; }
  Vector3 position(int i) const {
    const auto f = static_cast<std::size_t>(i);
    return {x[f], y[f], z[f]};
  }
  Vector3 normal(int i) const {
    const auto f = static_cast<std::size_t>(i);
    return {nx[f], ny[f], nz[f]};
  }
};

template <typename Real>
Vector3 position(const PairPoint<Real>& p) {
  return {p.x, p.y, p.z};
}

template <typename Real>
Vector3 normal(const PairPoint<Real>& p) {
  return {p.nx, p.ny, p.nz};
}

/// Largest deviation of a value from 4 pi times the formula, in units of (1 + k r) times the size that the terms of
/// the formula have: |g| / r^2 and the like, for a value itself can vanish with n.d.
template <typename Real>
double worst_deviation(const PairLoopTableOf<Real>& loops, Layer layer, const PairConstants<Real>& constants,
                       const PairPoint<Real>& point, const Cloud<Real>& cloud) {
  const auto count = static_cast<std::size_t>(cloud.size());
  std::vector<Real> re(count, std::numeric_limits<Real>::quiet_NaN());
  std::vector<Real> im(re);
  loops.values(layer, constants, point, cloud.sources(), cloud.size(), re.data(), im.data());
  const Complex wavenumber(pi, constants.damping);
  const double gamma = constants.gamma;
  double worst = 0;
  for (int i = 0; i < cloud.size(); ++i) {
    const auto f = static_cast<std::size_t>(i);
    const Complex expected =
        4.0 * pi *
        reference_value(
            layer, reference_kernels(position(point), normal(point), cloud.position(i), cloud.normal(i), wavenumber),
            gamma);
    const double r = (position(point) - cloud.position(i)).norm();
    const double kr = std::abs(wavenumber) * r;
    const double g = std::exp(-static_cast<double>(constants.damping) * r) / r;
    const double first = (1.0 + kr) * g / r;
    const double second = (3.0 + 3.0 * kr + kr * kr) * g / (r * r);
    double size = g;
    if (layer == Layer::kSingleAdjoint) {
      size += gamma * first;
    } else if (layer != Layer::kSingle) {
      size = first + (layer == Layer::kDouble || layer == Layer::kAdjoint ? 0.0 : gamma * second);
    }
    const double deviation = std::abs(Complex(re[f], im[f]) - expected) / (size * (1.0 + kr));
    EXPECT_TRUE(std::isfinite(deviation));
    worst = std::max(worst, deviation);
  }
  return worst;
}

template <typename Real>
const PairLoopTableOf<Real>& loops_of(InstructionLevel level) {
  if constexpr (std::is_same_v<Real, float>) {
    return pair_loops(level).of_float;
  } else {
    return pair_loops(level).of_double;
  }
}

template <typename Real>
class PairLoops : public ::testing::Test {};

using Reals = ::testing::Types<float, double>;
TYPED_TEST_SUITE(PairLoops, Reals);

TYPED_TEST(PairLoops, EveryLayerIsTheTextbookFormula) {
  using Real = TypeParam;
  const double promised = std::is_same_v<Real, float> ? 3e-7 : 1e-15;
  const PairPoint<Real> point{Real(0.3), Real(-0.2), Real(0.1), Real(0.48), Real(-0.6), Real(0.64)};
  for (const double half : {0.02, 0.5, 10.0, 50.0}) {  // 100 half wavelengths across: the largest body
    const Cloud<Real> cloud(997, half, 1);
    for (const Layer layer : kLayers) {
      for (const double damping : {0.0, 0.05}) {
        const PairConstants<Real> constants{static_cast<Real>(damping), Real(0.7)};
        for (const InstructionLevel level : processor_levels()) {
          EXPECT_LT(worst_deviation(loops_of<Real>(level), layer, constants, point, cloud), promised)
              << to_string(level) << ", layer " << static_cast<int>(layer) << ", cube " << half << ", damping "
              << damping;
        }
      }
    }
  }
}

TYPED_TEST(PairLoops, CoincidingPointsAddNothing) {
  using Real = TypeParam;
  Cloud<Real> cloud(37, 1.0, 3);
  const PairPoint<Real> point{cloud.x[20], cloud.y[20], cloud.z[20], 0, 0, 1};
  for (const Layer layer : kLayers) {
    for (const Real damping : {Real(0), Real(0.1)}) {
      std::vector<Real> re(37, Real(5));
      std::vector<Real> im(37, Real(5));
      pair_loops_of<Real>().values(layer, {damping, Real(0.5)}, point, cloud.sources(), 37, re.data(), im.data());
      EXPECT_EQ(re[20], Real(0)) << static_cast<int>(layer);
      EXPECT_EQ(im[20], Real(0)) << static_cast<int>(layer);
      EXPECT_NE(re[19], Real(0));
    }
  }
}

// Of a plate of equal squares many distances are the reach itself, 3^2 + 3^2 = 18; rounding must not let the levels
// differ.
TEST(NearSources, AreTheSameInEveryLevel) {
  constexpr int kSide = 23;
  const double step = 0.1 + 1e-3 / 3.0;  // no number that arithmetic keeps exact
  std::vector<double> x;
  std::vector<double> y;
  for (int i = 0; i < kSide * kSide; ++i) {
    x.push_back(step * (i % kSide));
    y.push_back(step * (i / kSide));  // NOLINT(bugprone-integer-division): the row
  }
  const std::vector<double> zero(x.size(), 0.0);
  const std::vector<double> reach(x.size(), 18.0 * step * step);
  const PairSources<double> sources{x.data(), y.data(), zero.data(), zero.data(), zero.data(), zero.data()};
  const auto near_of = [&](InstructionLevel level, std::size_t i) {
    std::vector<int> near(x.size());
    near.resize(static_cast<std::size_t>(pair_loops(level).near_sources({x[i], y[i], 0, 0, 0, 1}, sources, reach.data(),
                                                                        static_cast<int>(x.size()), near.data())));
    return near;
  };
  for (std::size_t i = 0; i < x.size(); ++i) {
    const std::vector<int> expected = near_of(InstructionLevel::kGeneric, i);
    EXPECT_FALSE(expected.empty());
    for (const InstructionLevel level : processor_levels()) {
      ASSERT_EQ(near_of(level, i), expected) << to_string(level) << ", point " << i;
    }
  }
}

}  // namespace touchfield::pair_loops_test
