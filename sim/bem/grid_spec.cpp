#include "sim/bem/grid_spec.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numbers>

#include "sim/bem/polynomials.h"

namespace touchfield {

namespace {

/// sin(kappa s) / kappa, s at kappa = 0.
Complex sine_over(const Complex& kappa, double s) {
  return std::abs(kappa * s) < 1e-4 ? s * (1.0 - kappa * kappa * s * s / 6.0) : std::sin(kappa * s) / kappa;
}

constexpr double kOversampling = 1.25;  // pi / h over k_c
constexpr double kWindowShape = 2.15;   // of the window, a point of its width
constexpr double kContinuation = 0.5;   // of the band left between k and pi / h
constexpr double kCoarseGrid = 1e-5;    // tolerances from here on allow the coarsest step: nothing else ends there
// Seconds of one thread, measured: a point of the grid and halving of it, a pair within reach, a point of a window.
constexpr double kPointSeconds = 0.55e-9;
constexpr double kPairSeconds = 6e-9;
constexpr double kWindowSeconds = 10e-9;

GridSpec spec_at(double step, double k, double gamma, double tolerance) {
  const double ratio = k * step / std::numbers::pi;  // k over the grid's largest wavenumber
  const double within = kOversampling * ratio;
  const double strength = 0.018 * std::max(1.0, gamma * k) / (within * within);
  GridSpec spec;
  spec.step = step;
  spec.shape = std::log(strength / (0.5 * tolerance)) / 0.93 / std::sqrt(1.0 - within * within);
  spec.reach = kOversampling * spec.shape * step / std::numbers::pi;
  spec.width =
      std::clamp(static_cast<int>(std::ceil(std::log(4.6 / (ratio * 0.25 * tolerance)) / 2.03)), 4, kWidestWindow);
  spec.window_shape = kWindowShape * spec.width;
  spec.bend_shape = kContinuation * std::numbers::pi * (1.0 - ratio);
  spec.margin = std::max(2, static_cast<int>(std::ceil(std::log(0.05 / (0.25 * tolerance)) / spec.bend_shape)));
  spec.single = tolerance >= kFinestSingleGrid;
  return spec;
}

}  // namespace

KernelSplit::KernelSplit(const Complex& kappa, double reach, double shape)
    : kappa_(kappa), reach_(reach), shape_(shape) {
  scale_ = 1.0 / radial(0.0).v;
}

Complex KernelSplit::mollifier(double r) const {
  const double rest = 1.0 - (r / reach_) * (r / reach_);
  return scale_ * std::cyl_bessel_i(0.0, shape_ * std::sqrt(std::max(0.0, rest)));
}

KernelSplit::Radial KernelSplit::radial(double r) const {
  constexpr int kPanels = 4;  // of 16 points
  const double half = 0.5 * (reach_ - r) / kPanels;
  Complex v = 0;
  Complex slope = 0;
  for (int panel = 0; panel < kPanels; ++panel) {
    for (std::size_t q = 0; q < kGaussNode.size(); ++q) {
      for (const double side : {-1.0, 1.0}) {
        const double s = r + half * (2 * panel + 1 + side * kGaussNode[q]);
        const Complex weight = half * kGaussWeight[q] * 4.0 * std::numbers::pi * s * mollifier(s);
        v += weight * sine_over(kappa_, s - r);
        slope -= weight * std::cos(kappa_ * (s - r));
      }
    }
  }
  return {v, slope, 4.0 * std::numbers::pi * r * mollifier(r) - kappa_ * kappa_ * v};
}

Complex KernelSplit::smooth(double r) const {
  const Complex ik = Complex(0, 1) * kappa_;
  if (r >= reach_) {
    return std::exp(ik * r) / (4.0 * std::numbers::pi * r);
  }
  if (r == 0.0) {
    return (ik - radial(0.0).slope) / (4.0 * std::numbers::pi);
  }
  return (std::exp(ik * r) - radial(r).v) / (4.0 * std::numbers::pi * r);
}

template <typename Real>
LocalKernel<Real> KernelSplit::local(double gamma) const {
  constexpr std::size_t kCount = kLocalDegree<Real> + 1;
  LocalKernel<Real> kernel{};
  const auto fit = [&](const auto& part, Real* re, Real* im) {
    const std::array<Complex, kCount> c = powers<kCount, Complex>([&](double t) {
      const double r = 0.5 * reach_ * (t + 1.0);
      return part(r, radial(r));
    });
    for (std::size_t i = 0; i < kCount; ++i) {
      re[i] = static_cast<Real>(c[i].real());
      im[i] = static_cast<Real>(c[i].imag());
    }
  };
  using Part = typename LocalKernel<Real>::Part;
  Part& re = kernel.re;
  Part& im = kernel.im;
  fit([](double /*r*/, const Radial& f) { return f.v; }, re.v, im.v);
  fit([](double r, const Radial& f) { return f.v - r * f.slope; }, re.a, im.a);
  fit([](double r, const Radial& f) { return r * r * f.bend - 3.0 * r * f.slope + 3.0 * f.v; }, re.b, im.b);
  // 4 pi chi * g = f(r) / r with f = exp(i kappa r) - v = f' r + f"' r^3 / 6 + .., derivatives at 0.
  const Complex ik = Complex(0, 1) * kappa_;
  const Complex slope = radial(0.0).slope;
  const Complex third = ik * ik * ik - (4.0 * std::numbers::pi * mollifier(0.0) - kappa_ * kappa_ * slope);
  const Complex s0 = -reach_ * (ik - slope);
  const Complex w0 = std::pow(reach_, 3) * third / 3.0;
  re.s0 = static_cast<Real>(s0.real());
  im.s0 = static_cast<Real>(s0.imag());
  re.w0 = static_cast<Real>(w0.real());
  im.w0 = static_cast<Real>(w0.imag());
  kernel.damped = kappa_.imag() != 0.0;
  kernel.gamma = static_cast<Real>(gamma / reach_);
  return kernel;
}

template LocalKernel<float> KernelSplit::local(double) const;
template LocalKernel<double> KernelSplit::local(double) const;

int transform_size(int least) {
  for (int n = least + least % 2;; n += 2) {
    int rest = n;
    for (const int factor : {2, 3, 5}) {
      while (rest % factor == 0) {
        rest /= factor;
      }
    }
    if (rest == 1) {
      return n;
    }
  }
}

GridBody grid_body(const TriangleMesh& mesh) {
  return {mesh.centroids().rowwise().maxCoeff() - mesh.centroids().rowwise().minCoeff(), mesh.total_area(),
          static_cast<double>(mesh.face_count())};
}

GridChoice choose_grid(const GridBody& body, const Complex& wavenumber, double gamma, double tolerance) {
  const double k = wavenumber.real();
  const double number = tolerance >= kFinestSingleGrid ? 1.0 : 2.0;  // how much more double precision takes
  GridChoice best;
  best.seconds = std::numeric_limits<double>::infinity();
  constexpr double kFiner = 0.94;
  const double coarsest = (tolerance < kCoarseGrid ? 0.2 : 0.25) * 2.0 * std::numbers::pi / k;
  for (double step = coarsest; step > 1e-3 * coarsest; step *= kFiner) {
    const GridSpec spec = spec_at(step, k, gamma, tolerance);
    double points = 1.0;
    for (int a = 0; a < 3; ++a) {
      points *= transform_size(std::max(2 * (static_cast<int>(body.extent(a) / step) + 1 + spec.margin), spec.width));
    }
    const double pairs = body.faces * body.faces * std::numbers::pi * spec.reach * spec.reach / body.area;
    const double seconds = number * (kPointSeconds * points * std::log2(points) + kPairSeconds * pairs +
                                     kWindowSeconds * body.faces * spec.width * spec.width);
    if (seconds < best.seconds) {
      best = {spec, seconds, number * 8.0 * points};
    }
    if (points > 1e10) {
      break;
    }
  }
  return best;
}

}  // namespace touchfield
