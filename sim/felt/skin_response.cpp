#include "sim/felt/skin_response.h"

#include <cmath>
#include <cstddef>
#include <limits>
#include <numbers>

#include <Eigen/LU>

#include "sim/core/require.h"
#include "sim/core/types.h"

namespace touchfield {
namespace {

using Eigen::Matrix2cd;
using Eigen::Vector2cd;

/// A layer at one frequency.
struct LayerMaterial {
  double thickness;  // infinite for a half-space
  Complex mu;
  Complex ks2;
};

/// A depth, from the top of its layer.
struct Place {
  std::size_t layer;
  double depth;
};

/// The root of k^2 - wave2 of which e^(-root z) decays, or runs inwards where it does not decay. Im wave2 >= 0.
Complex decay_rate(double k, Complex wave2) {
  const Complex root = std::sqrt(wave2 - k * k);
  return {root.imag(), -root.real()};
}

/// e^z - 1 without cancellation.
Complex exp_minus_one(Complex z) {
  const double growth = std::expm1(z.real());
  const double sine = std::sin(0.5 * z.imag());
  const double cosine = std::cos(0.5 * z.imag());
  return {growth - 2.0 * (1.0 + growth) * sine * sine, 2.0 * (1.0 + growth) * sine * cosine};
}

/// Turns (u_x, u_z) of waves that run down into that of the same waves running up; minus it, (t_xz, t_zz).
template <class Matrix>
Matrix flipped(Matrix m) {
  m.row(1) *= -1.0;
  return m;
}

/// Displacement (u_x, u_z) and traction (t_xz, t_zz).
struct Motion {
  Vector2cd displacement;
  Vector2cd traction;
};

/// Waves of one wavenumber in one layer: the pressure wave P and (S - P) / ks^2. S is the shear wave that approaches P
/// at large k. No difference of P and S is ever computed, so nothing cancels there.
class LayerWaves {
 public:
  /// below   displacement per traction that the next layer or the bone (0) offers; not read for a half-space
  /// The same of this layer is compliance().
  void set(const LayerMaterial& material, double k, double kp, const Matrix2cd& below) {
    const Complex i(0.0, 1.0);
    const Complex ks2 = material.ks2;
    thickness_ = material.thickness;
    ks2_ = ks2;
    q_ = decay_rate(k, kp * kp);
    s_ = decay_rate(k, ks2);
    difference_ = (ks2 - kp * kp) / (q_ + s_);
    const Complex a = 1.0 / (k + s_);
    const Complex b = kp * kp / (ks2 * (k + q_));
    displacement_ << i * k, -i * a, -q_, -b;
    traction_ << -2.0 * i * k * q_, i * (1.0 - 2.0 * k * b), 2.0 * k * k - ks2, -ks2 * a * a;
    traction_ *= material.mu;
    Matrix2cd top_displacement = displacement_;
    Matrix2cd top_traction = traction_;
    if (std::isfinite(thickness_)) {
      const Matrix2cd across = decay(thickness_);
      const Matrix2cd up_displacement = flipped(displacement_);
      const Matrix2cd up_traction = -flipped(traction_);
      reflected_ = (below * up_traction - up_displacement).inverse() * ((displacement_ - below * traction_) * across);
      const Matrix2cd returned = across * reflected_;
      top_displacement += up_displacement * returned;
      top_traction += up_traction * returned;
    }
    amplitudes_ = top_traction.inverse();
    compliance_ = top_displacement * amplitudes_;
  }

  const Matrix2cd& compliance() const { return compliance_; }

  /// Under a traction at the layer's top.
  Motion at(const Vector2cd& top_traction, double depth) const {
    const Vector2cd amplitudes = amplitudes_ * top_traction;
    const Vector2cd down = decay(depth) * amplitudes;
    Motion motion{displacement_ * down, traction_ * down};
    if (std::isfinite(thickness_)) {
      const Vector2cd up = decay(thickness_ - depth) * (reflected_ * amplitudes);
      motion.displacement += flipped(Vector2cd(displacement_ * up));
      motion.traction -= flipped(Vector2cd(traction_ * up));
    }
    return motion;
  }

 private:
  /// What becomes of the two waves over a distance.
  Matrix2cd decay(double distance) const {
    const bool shear_lasts = difference_.real() >= 0.0;  // the slower decay first: no exponential overflows
    const Complex longer = std::exp(-distance * (shear_lasts ? s_ : q_));
    const Complex change = longer * exp_minus_one(distance * (shear_lasts ? -difference_ : difference_));
    const Complex shorter = longer + change;
    Matrix2cd result;
    result << (shear_lasts ? shorter : longer), (shear_lasts ? -change : change) / ks2_, 0.0,
        (shear_lasts ? longer : shorter);
    return result;
  }

  double thickness_ = 0.0;
  Complex ks2_;
  Complex q_;
  Complex s_;
  Complex difference_;      // q - s
  Matrix2cd displacement_;  // of the waves down, at the top
  Matrix2cd traction_;
  Matrix2cd reflected_;   // amplitudes up, at the bottom, per amplitude down, at the top
  Matrix2cd amplitudes_;  // down, per traction at the top
  Matrix2cd compliance_;
};

void check(const LayeredSkin& skin, double omega, const Eigen::ArrayXd& wavenumbers,
           const std::vector<double>& depths) {
  require(!skin.layers.empty(), "skin: at least one layer is needed");
  double bone = 0.0;
  for (std::size_t n = 0; n < skin.layers.size(); ++n) {
    const SkinLayer& layer = skin.layers[n];
    const bool ends = skin.on_bone || n + 1 < skin.layers.size();
    require(layer.shear > 0.0 && (layer.thickness > 0.0 || !ends),
            "skin: thickness and shear modulus of layer {} must be positive, not {:g} m and {:g} Pa", n + 1,
            layer.thickness, layer.shear);
    bone += layer.thickness;
  }
  require(skin.tan_delta >= 0.0, "skin: the loss must not be negative, not {:g}", skin.tan_delta);
  require(skin.density > 0.0 && skin.speed > 0.0,
          "skin: density and speed of sound must be positive, not {:g} kg/m3 and {:g} m/s", skin.density, skin.speed);
  require(omega > 0.0, "skin: the frequency must be positive, not {:g} rad/s", omega);
  require((wavenumbers >= 0.0).all(), "skin: wavenumbers must not be negative");
  for (const double depth : depths) {
    require(depth >= 0.0 && (!skin.on_bone || depth <= bone * (1.0 + 1e-12)),
            "skin: the depth of {:g} mm must be from 0 to the bone at {:g} mm", 1e3 * depth, 1e3 * bone);
  }
}

}  // namespace

std::vector<SkinWaves> skin_waves(const LayeredSkin& skin, double omega, const Eigen::ArrayXd& wavenumbers,
                                  const std::vector<double>& depths) {
  check(skin, omega, wavenumbers, depths);
  const std::size_t count = skin.layers.size();
  const double exponent = 2.0 / std::numbers::pi * std::atan(skin.tan_delta);
  const double kp = omega / skin.speed;
  const double pressure_modulus = skin.density * skin.speed * skin.speed;
  const Complex i(0.0, 1.0);

  std::vector<LayerMaterial> materials;
  for (const SkinLayer& layer : skin.layers) {
    const double modulus = layer.shear * std::pow(omega / (2.0 * std::numbers::pi * 200.0), exponent);
    const double lag = 0.5 * std::numbers::pi * exponent;
    materials.push_back({.thickness = layer.thickness,
                         .mu = std::polar(modulus, -lag),
                         .ks2 = std::polar(skin.density * omega * omega / modulus, lag)});
  }
  if (!skin.on_bone) {
    materials.back().thickness = std::numeric_limits<double>::infinity();
  }

  std::vector<Place> places;
  std::vector<SkinWaves> result;
  for (double depth : depths) {
    std::size_t layer = 0;
    for (; layer + 1 < count && depth > materials[layer].thickness; ++layer) {
      depth -= materials[layer].thickness;
    }
    const Eigen::ArrayXcd empty(wavenumbers.size());
    places.push_back({layer, depth});
    result.push_back({empty, empty, empty, empty, empty, std::abs(materials[layer].mu)});
  }

  std::vector<LayerWaves> waves(count);
  for (Eigen::Index w = 0; w < wavenumbers.size(); ++w) {
    const double k = wavenumbers(w);
    Matrix2cd below = Matrix2cd::Zero();
    for (std::size_t layer = count; layer-- > 0;) {
      waves[layer].set(materials[layer], k, kp, below);
      below = waves[layer].compliance();
    }
    Vector2cd traction(0.0, -1.0);
    for (std::size_t layer = 0; layer < count; ++layer) {
      const Complex mu = materials[layer].mu;
      for (std::size_t n = 0; n < places.size(); ++n) {
        if (places[n].layer == layer) {
          const Motion motion = waves[layer].at(traction, places[n].depth);
          const Complex e_xx = i * k * motion.displacement(0);
          result[n].along(w) = motion.displacement(0);
          result[n].inwards(w) = motion.displacement(1);
          result[n].e_xx(w) = e_xx;
          result[n].e_zz(w) = (motion.traction(1) + 2.0 * mu * e_xx) / pressure_modulus - e_xx;
          result[n].e_xz(w) = motion.traction(0) / (2.0 * mu);
        }
      }
      if (layer + 1 < count) {
        traction = waves[layer].at(traction, materials[layer].thickness).traction;
      }
    }
  }
  return result;
}

}  // namespace touchfield
