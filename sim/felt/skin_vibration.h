#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "sim/felt/skin_patch.h"
#include "sim/felt/skin_response.h"
#include "sim/felt/thresholds.h"

namespace touchfield {

/// A pressure on the faces of a patch that repeats: P(t) = mean + Re sum_l pressure_l exp(-2 pi i hz_l t).
struct PressureLines {
  std::vector<double> hz;     // ascending, > 0, L
  Eigen::MatrixXcd pressure;  // peak, K x L [Pa]

  /// The mean of P^2 over time, without that of the mean of P, K [Pa2].
  Eigen::VectorXd mean_square() const { return 0.5 * pressure.cwiseAbs2().rowwise().sum(); }
};

/// Of the radiation pressure of sound whose amplitude is (1 + cos(2 pi hz t)) / 2 of the whole: P / 2 at hz, P / 8 at
/// twice that.
///
/// radiation   P at full amplitude, K [Pa]
PressureLines modulated_lines(const Eigen::VectorXd& radiation, double hz);

/// The Fourier series of signals that hold each of F values for the same time and then repeat: peak amplitudes
///
///   c_m = 2 sinc(m/F) exp(i pi m/F) / F sum_k x_k exp(2 pi i m k/F),   x(t) = mean + Re sum_m c_m exp(-2 pi i m t/T)
///
/// values   x, K x F
/// rate     values per second
/// returns  c_1, c_2, ... up to `highest` [Hz]; line m is at m rate / F
Eigen::MatrixXcd held_lines(const Eigen::MatrixXd& values, double rate, double highest);

/// Those of frames, up to `highest` [Hz]. Lines with less than 1e-8 of the strongest one's sum of squares are left out,
/// and those that are rounding alone.
///
/// radiation   P of each frame, K x F [Pa]
/// rate        frames per second
PressureLines frame_lines(const Eigen::MatrixXd& radiation, double rate, double highest);

/// Receptors that maps of the strain energy are made for: Merkel cells, Meissner and Pacinian corpuscles [m].
///
/// source   Saal et al., PNAS 114 (2017) E5693, doi 10.1073/pnas.1704856114
inline constexpr std::array<double, 3> kReceptorDepths = {0.3e-3, 1.6e-3, 2.0e-3};

inline constexpr std::array<TouchChannel, 2> kTouchChannels = {TouchChannel::kPacinian, TouchChannel::kRapidlyAdapting};

/// A skin by its name; without layers the pressure stands for what the skin does ("none").
struct TissueModel {
  std::string name;
  std::optional<LayeredSkin> layers;
};

/// What lines of pressure do to a skin. Maps are on a square grid of the flat patch, from -kReach to kReach. Rows are
/// along its x axis, columns along y. They are NaN farther from the middle than kReach.
struct SkinVibration {
  static constexpr int kSide = 49;                                        // of the maps
  static constexpr double kStep = 2.0 * SkinPatch::kReach / (kSide - 1);  // [m]

  std::string skin;
  bool has_mechanics = true;
  Eigen::MatrixXd displacement;  // inwards at the surface, rms [m]; without mechanics of P [Pa]
  Eigen::MatrixXd velocity;      // likewise, rms [m/s]; of P [Pa/s]
  std::array<Eigen::MatrixXd, kReceptorDepths.size()> energy{};   // mean strain energy density [J/m3]; or empty
  std::array<Eigen::MatrixXd, kTouchChannels.size()> weighted{};  // displacement, lines weighted by thresholds, rms
  Eigen::MatrixXcd at_points;  // peak displacement of each line, L x points [m]; of P [Pa]
};

/// Flat skins under lines of pressure:
///
///   u_z(x) = 1 / (2 pi)^2 int K(k) P(k) e^(i k x) dk,   W = 1/2 sum_l |mu| sum_ij |e_ij|^2
///
/// K and the strains e_ij by skin_waves; without layers K = 1. P(k) = sum_f A_f P_f e^(-i k x_f) keeps the force of a
/// face. K is cut off in space at 30 mm, beyond the patch's diameter, so that no repetition of the patch is seen.
///
/// finest     the largest wavenumber that P has [rad/m]: twice that of the sound, and more
/// points     places on the flat patch
/// accuracy   1e-3 of the largest for pressures without finer parts on a fine mesh. P is sampled at centroids: with
///            edges of 1.4 mm u is 3 % off, W 8 % (a spot of 5.9 mm), with 0.7 mm 0.4 % and 0.5 %
/// throws     InputError as skin_waves
/// source     the cut kernel: Vico, Greengard, Ferrando, J. Comput. Phys. 323 (2016) 191
std::vector<SkinVibration> skin_vibrations(const SkinPatch& patch, const PressureLines& lines,
                                           const std::vector<TissueModel>& skins, double finest,
                                           const std::vector<Eigen::Vector2d>& points = {});

double largest(const Eigen::MatrixXd& map);

/// The area where a map is at least half of its largest value, -6 dB [m2]; NaN if it reaches the rim of the patch.
double half_area(const Eigen::MatrixXd& map);

/// A map at a place of the flat patch, by linear interpolation; NaN off the patch.
double map_at(const Eigen::MatrixXd& map, const Eigen::Vector2d& place);

/// The least of a map on the straight line between two places over the lesser of both ends, at most 1; NaN off the
/// patch.
double dip_between(const Eigen::MatrixXd& map, const Eigen::Vector2d& from, const Eigen::Vector2d& to);

}  // namespace touchfield
