// Layered skin under a pressure of one wavenumber: known limits and the equations of motion.
#include "sim/felt/skin_response.h"

#include <cmath>
#include <numbers>

#include "sim/core/errors.h"
#include "sim/core/types.h"
#include "tests/support/testing.h"

namespace touchfield::skin_response_test {

constexpr double kPi = std::numbers::pi;
constexpr Complex kI(0.0, 1.0);
constexpr double kOmega = 2.0 * kPi * 200.0;

LayeredSkin half_space(double tan_delta) { return {.layers = {{.shear = 20e3}}, .tan_delta = tan_delta}; }

Eigen::ArrayXd list(std::initializer_list<double> values) {
  return Eigen::Map<const Eigen::ArrayXd>(values.begin(), static_cast<Eigen::Index>(values.size()));
}

/// Largest difference of two answers, relative to the largest of each component over depths.
double difference(const std::vector<SkinWaves>& found, const std::vector<SkinWaves>& wanted) {
  double largest = 0.0;
  for (const auto component :
       {&SkinWaves::along, &SkinWaves::inwards, &SkinWaves::e_xx, &SkinWaves::e_zz, &SkinWaves::e_xz}) {
    Eigen::ArrayXd error = Eigen::ArrayXd::Zero((found[0].*component).size());
    Eigen::ArrayXd scale = error;
    for (std::size_t n = 0; n < found.size(); ++n) {
      error = error.max((found[n].*component - wanted[n].*component).abs());
      scale = scale.max((wanted[n].*component).abs());
    }
    largest = std::max(largest, (error / scale).maxCoeff());
  }
  return largest;
}

/// By Hooke's law.
struct Stress {
  Stress(const LayeredSkin& skin, const SkinWaves& at) {
    mu = std::polar(at.modulus, -std::atan(skin.tan_delta));
    const Eigen::ArrayXcd mean = (skin.density * skin.speed * skin.speed - 2.0 * mu) * (at.e_xx + at.e_zz);
    xx = mean + 2.0 * mu * at.e_xx;
    zz = mean + 2.0 * mu * at.e_zz;
    xz = 2.0 * mu * at.e_xz;
  }
  Complex mu;
  Eigen::ArrayXcd xx, zz, xz;
};

TEST(SkinWaves, OfSlowPressureAreThoseOfBoussinesq) {
  const Eigen::ArrayXd k = list({50.0, 500.0, 5000.0});
  const std::vector<SkinWaves> waves = skin_waves(half_space(0.0), kPi, k, {0.0, 0.002});
  const double top = (2.0 * waves[0].modulus * k * waves[0].inwards - 1.0).abs().maxCoeff();
  const Eigen::ArrayXd kz = 0.002 * k;
  const double deep = (waves[1].inwards / waves[0].inwards - (1.0 + kz) * (-kz).exp()).abs().maxCoeff();
  std::printf("2 mu k u / P - 1: %.1e; at 2 mm: %.1e\n", top, deep);
  EXPECT_LT(top, 2e-4);
  EXPECT_LT(deep, 2e-4);
}

TEST(SkinWaves, OfASlowPressureOnALayerOnBoneAreThoseOfAnIncompressibleLayer) {
  // u = P / (2 mu k) (sinh K cosh K - K) / (cosh^2 K + K^2), K = k h; P k^2 h^3 / (3 mu) where K is small.
  const double h = 0.004;
  LayeredSkin skin = {.layers = {{.thickness = h, .shear = 20e3}}, .on_bone = true, .tan_delta = 0.0};
  const Eigen::ArrayXd kh = list({0.08, 0.3, 1.0, 3.0, 10.0});
  const Eigen::ArrayXd k = kh / h;
  const SkinWaves compressible = skin_waves(skin, kPi, k, {0.0}).front();
  const double thin = std::abs(compressible.inwards(0)) * 3.0 * compressible.modulus / (k(0) * k(0) * h * h * h);
  skin.speed = 1e5;
  const Eigen::ArrayXcd found = 2.0 * compressible.modulus * k * skin_waves(skin, kPi, k, {0.0}).front().inwards;
  const Eigen::ArrayXd wanted = (kh.sinh() * kh.cosh() - kh) / (kh.cosh().square() + kh.square());
  const double error = (found / wanted - 1.0).abs().maxCoeff();
  std::printf("bonded layer: %.1e off; thin, at k h = 0.08: %.4f of P k^2 h^3 / (3 mu)\n", error, thin);
  EXPECT_LT(error, 1e-5);
  EXPECT_NEAR(thin, 0.992, 0.001);  // 0.4 % of it by the sound in the layer
}

TEST(SkinWaves, OfAUniformPressureAreSoundAlone) {
  // exp(i kp z) i / (density speed w), and standing waves above bone; at 100 kHz a layer of 4 mm is 0.26 wavelengths.
  const double omega = 2.0 * kPi * 1e5;
  const Eigen::ArrayXd k = list({0.0, 1e-6});
  LayeredSkin skin = {.layers = {{.thickness = 0.001, .shear = 60e3}, {.thickness = 0.003, .shear = 20e3}}};
  const double kp = omega / skin.speed;
  const double unit = 1.0 / (skin.density * skin.speed * omega);
  for (const bool on_bone : {false, true}) {
    skin.on_bone = on_bone;
    const std::vector<double> depths = {0.0, 0.0005, 0.002};
    const std::vector<SkinWaves> waves = skin_waves(skin, omega, k, depths);
    for (std::size_t n = 0; n < depths.size(); ++n) {
      const Complex wanted = on_bone ? Complex(std::sin(kp * (0.004 - depths[n])) / std::cos(kp * 0.004))
                                     : kI * std::exp(kI * kp * depths[n]);
      EXPECT_LT((waves[n].inwards / (unit * wanted) - 1.0).abs().maxCoeff(), 1e-9) << on_bone << n;
      EXPECT_LT(waves[n].along.abs().maxCoeff(), 1e-6 * unit);
    }
  }
}

TEST(SkinWaves, DoNotFeelBoneFarBelow) {
  const Eigen::ArrayXd k = list({500.0, 2000.0, 5000.0});
  const std::vector<double> depths = {0.0, 0.0005, 0.003};
  const auto with = [](std::vector<SkinLayer> layers, bool on_bone) {
    return LayeredSkin{.layers = std::move(layers), .on_bone = on_bone};
  };
  // At 1 m, where e^(k h) overflows.
  EXPECT_LT(difference(skin_waves(with({{1.0, 2e4}}, true), kOmega, k, depths),
                       skin_waves(with({{0, 2e4}}, false), kOmega, k, depths)),
            1e-11);
}

TEST(SkinWaves, ObeyTheEquationsOfMotionAndMeetWhereLayersMeet) {
  LayeredSkin skin = {.layers = {{0.001, 60e3}, {0.003, 10e3}}, .on_bone = true, .speed = 20.0};
  const Eigen::ArrayXd k = list({0.0, 20.0, 300.0, 1000.0, 3000.0});
  const double step = 2e-6;
  for (const bool on_bone : {true, false}) {
    skin.on_bone = on_bone;
    const double inertia = skin.density * kOmega * kOmega;
    for (const double z : {0.0004, 0.0021}) {
      const std::vector<SkinWaves> at =
          skin_waves(skin, kOmega, k, {z - 2.0 * step, z - step, z, z + step, z + 2.0 * step});
      const auto slope = [&](const auto& value) -> Eigen::ArrayXcd {
        return (value(at[0]) - 8.0 * value(at[1]) + 8.0 * value(at[3]) - value(at[4])) / (12.0 * step);
      };
      const auto stress = [&](Eigen::ArrayXcd Stress::*part) {
        return [&skin, part](const SkinWaves& w) -> Eigen::ArrayXcd { return Stress(skin, w).*part; };
      };
      const SkinWaves& w = at[2];
      const Stress t(skin, w);
      const auto same = [&](const Eigen::ArrayXcd& one, const Eigen::ArrayXcd& other, const Eigen::ArrayXcd& scale) {
        EXPECT_LT(((one - other).abs() / scale.abs()).maxCoeff(), 1e-7) << on_bone << z;
      };
      const Eigen::ArrayXcd strain = w.e_xx.abs() + w.e_zz.abs();
      same(kI * k * w.along, w.e_xx, strain);
      same(slope([](const SkinWaves& v) { return v.inwards; }), w.e_zz, strain);
      same(slope([](const SkinWaves& v) { return v.along; }) + kI * k * w.inwards, 2.0 * w.e_xz, strain);
      const Eigen::ArrayXcd force = inertia * w.inwards.abs() + k * (t.xx.abs() + t.zz.abs());
      same(slope(stress(&Stress::xz)) + kI * k * t.xx, -inertia * w.along, force);
      same(slope(stress(&Stress::zz)) + kI * k * t.xz, -inertia * w.inwards, force);
    }
    const std::vector<SkinWaves> at = skin_waves(skin, kOmega, k, {0.0, 0.001, 0.001 + 1e-15, 0.004});
    const Stress surface(skin, at[0]), above(skin, at[1]), below(skin, at[2]);
    EXPECT_LT(surface.xz.abs().maxCoeff(), 1e-9);
    EXPECT_LT((surface.zz + 1.0).abs().maxCoeff(), 1e-9);
    EXPECT_NEAR(at[1].modulus / at[2].modulus, 6.0, 1e-12);
    EXPECT_LT((above.xz - below.xz).abs().maxCoeff(), 1e-9);
    EXPECT_LT((above.zz - below.zz).abs().maxCoeff(), 1e-9);
    EXPECT_LT(((at[1].inwards - at[2].inwards) / at[1].inwards).abs().maxCoeff(), 1e-9);
    EXPECT_LT((at[1].along - at[2].along).abs().maxCoeff(), 1e-9 * at[1].inwards.abs().maxCoeff());
    if (on_bone) {
      EXPECT_LT(((at[3].inwards.abs() + at[3].along.abs()) / at[0].inwards.abs()).maxCoeff(), 1e-9);
    }
  }
}

TEST(SkinWaves, RefuseWhatIsNotASkin) {
  const auto refuses = [&](const LayeredSkin& skin, double omega = kOmega, double k = 1.0, double depth = 0.0) {
    EXPECT_THROW(skin_waves(skin, omega, list({k}), {depth}), InputError);
  };
  refuses({.layers = {}});
  refuses({.layers = {{0.001, 60e3}, {0.0, 10e3}}, .on_bone = true});
  refuses({.layers = {{0.001, -60e3}, {0.003, 10e3}}, .on_bone = true});
  const LayeredSkin good = {.layers = {{0.001, 60e3}, {0.003, 10e3}}, .on_bone = true};
  refuses(good, 0.0);
  refuses(good, kOmega, -1.0);
  refuses(good, kOmega, 1.0, -1e-6);
  refuses(good, kOmega, 1.0, 0.00401);
  EXPECT_NO_THROW(skin_waves(good, kOmega, list({1.0}), {0.001 + 0.003}));
}

}  // namespace touchfield::skin_response_test
