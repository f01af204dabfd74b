// The formulas that the card computes with, on the host: they need no card.
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/bem/layer_sum.h"
#include "sim/gpu/cuda/face_integral.cuh"
#include "tests/gpu/channel_support.h"
#include "tests/gpu/surface_support.h"

namespace touchfield {
namespace gpu_formulas_test {

Vector3 random_vector(std::mt19937& generator, double size) {
  std::uniform_real_distribution<double> uniform(-size, size);
  const double x = uniform(generator);
  const double y = uniform(generator);
  return {x, y, uniform(generator)};
}

/// The largest error of the card's kernel over the CPU's one in double, of the value's magnitude, for pairs up to
/// `reach` half wavelengths apart.
template <Layer kLayer, bool kDamped, typename Real>
double pair_error(double reach) {
  std::mt19937 generator(7);
  const cuda::SurfaceWave wave = gpu_wave(kDamped ? kGpuDamped : kGpuWavenumber);
  const auto exact = pair_constants<double>(kDamped ? kGpuDamped : kGpuWavenumber, kGpuGamma);
  EXPECT_EQ(wave.constants<double>().damping, exact.damping);
  EXPECT_EQ(wave.constants<double>().gamma, exact.gamma);
  double worst = 0.0;
  for (int trial = 0; trial < 3000; ++trial) {
    const Vector3 x = random_vector(generator, reach);
    const Vector3 y = trial % 3 == 0 ? Vector3(x + random_vector(generator, 0.1)) : random_vector(generator, reach);
    const Vector3 m = random_vector(generator, 1.0).normalized().cast<float>().cast<double>();
    const Vector3 n = random_vector(generator, 1.0).normalized().cast<float>().cast<double>();
    double re = 0.0;
    double im = 0.0;
    pair_loops_of<double>().values(kLayer, exact, {x.x(), x.y(), x.z(), m.x(), m.y(), m.z()},
                                   {&y.x(), &y.y(), &y.z(), &n.x(), &n.y(), &n.z()}, 1, &re, &im);
    Real found_re = 0;
    Real found_im = 0;
    const Vector3 d = x - y;
    const auto real = [](const Vector3& v) { return v.cast<Real>().eval(); };
    cuda::pair_kernel<kLayer, kDamped>(wave.constants<Real>(), cuda::pair_distance<Real>(gpu_vector(d)), real(m).x(),
                                       real(m).y(), real(m).z(), real(n).x(), real(n).y(), real(n).z(), found_re,
                                       found_im);
    // What the parts of a kernel are at most: sums of them may cancel.
    const double r = d.norm();
    const double kr = std::numbers::pi * r;
    const double decay = std::exp(-exact.damping * r);
    double size = decay / r;
    if (kLayer != Layer::kSingle) size = decay * (1.0 + kr) / (r * r);
    if (kLayer == Layer::kBurtonMiller || kLayer == Layer::kAdjointMiller) {
      size += exact.gamma * decay * (3.0 + 3.0 * kr + kr * kr) / (r * r * r);
    }
    worst = std::max(worst, std::hypot(found_re - re, found_im - im) / size);
  }
  return worst;
}

template <typename Real>
void expect_pairs(double reach, double error) {
  EXPECT_LT((pair_error<Layer::kSingle, false, Real>(reach)), error);
  EXPECT_LT((pair_error<Layer::kDouble, false, Real>(reach)), error);
  EXPECT_LT((pair_error<Layer::kDouble, true, Real>(reach)), error);
  EXPECT_LT((pair_error<Layer::kAdjoint, true, Real>(reach)), error);
  EXPECT_LT((pair_error<Layer::kBurtonMiller, false, Real>(reach)), error);
  EXPECT_LT((pair_error<Layer::kBurtonMiller, true, Real>(reach)), error);
  EXPECT_LT((pair_error<Layer::kAdjointMiller, true, Real>(reach)), error);
}

TEST(GpuFormulas, PairsAreTheCpusInDouble) { expect_pairs<double>(30.0, 1e-13); }

TEST(GpuFormulas, PairsOfDifferencesInDoubleLoseNone) { expect_pairs<float>(100.0, 1.5e-6); }

TEST(GpuFormulas, APointOnItselfAddsNothing) {
  float re = 1.0F;
  float im = 1.0F;
  cuda::pair_kernel<Layer::kBurtonMiller, true>(gpu_wave(kGpuDamped).constants<float>(),
                                                cuda::pair_distance<float>({0.0, 0.0, 0.0}), float3{0.0F, 0.0F, 1.0F},
                                                float3{0.0F, 0.0F, 1.0F}, re, im);
  EXPECT_EQ(re, 0.0F);
  EXPECT_EQ(im, 0.0F);
}

cuda::Triangle triangle_of(const Face& face) {
  return {gpu_vector(face.a), gpu_vector(face.b), gpu_vector(face.c), gpu_vector(face.normal), face.area};
}

/// The largest error of a face's integral over FaceQuadrature's, of the row's largest, for all pairs within reach; how
/// many pairs there were of each kind.
template <bool kDamped>
double face_error(const TriangleMesh& mesh, std::array<int, 4>& kinds) {
  const Complex wavenumber = kDamped ? kGpuDamped : kGpuWavenumber;
  const cuda::NearRule rule;
  FaceQuadrature quadrature(wavenumber, kGpuGamma, {});
  double worst = 0.0;
  for (Eigen::Index i = 0; i < mesh.face_count(); i += 7) {
    const Vector3 x = mesh.centroids().col(i);
    quadrature.begin(x, mesh.normals().col(i));
    std::vector<Complex> found;
    for (Eigen::Index j = 0; j < mesh.face_count(); ++j) {
      if (i == j || (x - mesh.centroids().col(j)).norm() > 9.0 * std::sqrt(mesh.areas()(j))) continue;
      const Face face = face_of(mesh, j);
      quadrature.add(face);
      cuda::FaceSum<kDamped> sum(gpu_wave(wavenumber), gpu_vector(x), gpu_vector(mesh.normals().col(i)));
      const cuda::Vector centroid = gpu_vector(mesh.centroids().col(j));
      const cuda::FaceKind kind = cuda::face_kind(rule, cuda::squared_norm(gpu_vector(x) - centroid), face.area);
      ++kinds[static_cast<std::size_t>(kind)];
      if (kind == cuda::FaceKind::kSplit) {
        for (unsigned quarter = 0; quarter < 4; ++quarter) {
          sum.add_quarter(triangle_of(face), rule.split2(), quarter);
        }
        sum.add_exact_static(triangle_of(face));
      } else if (kind == cuda::FaceKind::kSevenPoints) {
        sum.add_exact_static(triangle_of(face));
        sum.add_seven(triangle_of(face));
      } else if (kind == cuda::FaceKind::kThreePoints) {
        sum.add_three(triangle_of(face));
      } else {
        sum.template add_point<false>(centroid, gpu_vector(face.normal), face.area);
      }
      found.emplace_back(sum.re, sum.im);
    }
    const std::vector<Complex>& expected = quadrature.integrals(Layer::kBurtonMiller);
    double largest = 0.0;
    for (const Complex& value : expected) largest = std::max(largest, std::abs(value));
    for (std::size_t q = 0; q < expected.size(); ++q) {
      worst = std::max(worst, std::abs(found[q] - expected[q]) / largest);
    }
  }
  return worst;
}

TEST(GpuFormulas, IntegralsOverFacesAreTheCpus) {
  for (const auto& [name, mesh] : gpu_surfaces()) {
    std::array<int, 4> kinds{};
    EXPECT_LT(face_error<false>(mesh, kinds), 1e-11) << name;
    EXPECT_LT(face_error<true>(mesh, kinds), 1e-11) << name;
    for (const int count : kinds) EXPECT_GT(count, 100) << name;
  }
}

TEST(GpuFormulas, AFaceOverItselfIsTheCpus) {
  for (const Complex& wavenumber : {kGpuWavenumber, kGpuDamped}) {
    for (const auto& [name, mesh] : gpu_surfaces()) {
      for (Eigen::Index f = 0; f < mesh.face_count(); f += 11) {
        const Face face = face_of(mesh, f);
        const Complex expected = self_integrals(face, wavenumber).hypersingular;
        const double2 found = cuda::self_hypersingular(triangle_of(face), wavenumber.real(), wavenumber.imag());
        ASSERT_LT(std::abs(Complex(found.x, found.y) - expected), 1e-12 * std::abs(expected)) << name << f;
      }
    }
  }
}

TEST(GpuFormulas, ChannelsAreTheCpus) {
  std::mt19937 generator(3);
  Points points(3, 60);
  Points directions(3, 60);
  for (Eigen::Index j = 0; j < points.cols(); ++j) {
    points.col(j) = random_vector(generator, 0.04) + Vector3(0, 0, j % 4 == 0 ? -0.1 : 0.1);  // behind the array too
    directions.col(j) = random_vector(generator, 1.0).normalized();
  }
  points.col(0) << 0.0, 0.0, 0.12;  // on an axis
  for (const GpuChannelCase& given : gpu_channel_cases()) {
    const Eigen::MatrixXcd pressure = incident_matrix(given.array, given.wave, points);
    const Eigen::MatrixXcd slope = incident_derivative_matrix(given.array, given.wave, points, directions);
    const std::vector<cuda::Channel> channels = gpu_channels(given.array);
    const cuda::ChannelWave wave = gpu_channel_wave(given.array, given.wave);
    for (Eigen::Index j = 0; j < points.cols(); ++j) {
      for (Eigen::Index n = 0; n < given.array.size(); ++n) {
        const cuda::Channel& channel = channels[static_cast<std::size_t>(n)];
        const cuda::Vector x = gpu_vector(points.col(j));
        const cuda::Vector u = gpu_vector(directions.col(j));
        const double2 p = cuda::channel_value<false>(wave, channel, x, u);
        const double2 s = cuda::channel_value<true>(wave, channel, x, u);
        const double largest = pressure.row(j).cwiseAbs().maxCoeff();
        const double steepest = slope.row(j).cwiseAbs().maxCoeff();
        ASSERT_LT(std::abs(Complex(p.x, p.y) - pressure(j, n)), 1e-7 * largest) << given.name << j << "," << n;
        ASSERT_LT(std::abs(Complex(s.x, s.y) - slope(j, n)), 1e-7 * steepest) << given.name << j << "," << n;
      }
    }
  }
}

}  // namespace gpu_formulas_test
}  // namespace touchfield
