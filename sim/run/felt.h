#pragma once

#include <string>
#include <vector>

#include "sim/felt/skin_vibration.h"
#include "sim/run/motion_data.h"
#include "sim/run/run_data.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// A place whose spectra are wanted.
struct FeltPoint {
  std::string name;
  Vector3 at;             // on the skin [m]
  Eigen::Vector2d place;  // on the flat patch [m]
};

/// What one method does to the skin.
struct FeltMethod {
  std::string name;
  PressureLines lines;
  double flattening = 0;               // flattening_error of the root mean square of the pressure
  std::vector<SkinVibration> skins{};  // soft, middle, stiff, none
};

/// The vibration of flat skins under the radiation pressure of a result.
struct Felt {
  std::string name;     // of the scene
  std::string scene{};  // resolved YAML text of the result, with this spec
  FeltSpec spec{};
  TriangleMesh mesh;  // the evaluated skin, in the world's frame
  SkinPatch patch;
  std::vector<FeltPoint> points{};  // the middle, then others
  std::vector<FeltMethod> methods{};
  std::vector<std::string> warnings{};
  Provenance provenance{};
};

inline constexpr double kOffSkin = 5e-3;  // that a place of the skin may be [m]

/// The face at felt.at_mm.
/// throws   InputError if it is farther than kOffSkin from the skin
Eigen::Index felt_face(const TriangleMesh& mesh, const Vector3& at);

/// Figures of a map, in the unit of its name; NaN where not computed.
struct FeltFigures {
  double displacement_um;  // largest rms; without mechanics NaN, as all that has a length
  double velocity_mm_s;
  double pressure_pa;  // largest rms, without mechanics alone
  double spread_mm2;   // half_area of the displacement
  std::array<double, kReceptorDepths.size()> energy_j_m3;
  std::array<double, kTouchChannels.size()> weighted;  // largest; comparable for one skin
  double dip_db;                                       // between the first two points that the spec names
};

/// A map at the middle of every face of the skin, and the rms of the radiation pressure; NaN off the patch.
Eigen::VectorXd map_on_skin(const Felt& felt, const Eigen::MatrixXd& map);
Eigen::VectorXd radiation_on_skin(const Felt& felt, const FeltMethod& method);

FeltFigures felt_figures(const Felt& felt, const SkinVibration& skin);

/// The skins that are always computed: soft, middle, stiff, and none, by which the pressure stands for what skin does.
std::vector<TissueModel> felt_skins(const FeltSpec& spec);

/// The method that others are compared with.
/// throws   InputError if spec.reference is none of them
const FeltMethod& reference_of(const Felt& felt);

/// Of a run: the sound of every method that was evaluated, modulated. Of a pattern: its frames.
///
/// Warnings:
///   flattened   the skin is so bent that lengths where the pressure is change by more than 10 % (rms)
///   beyond      more than a tenth of the target's area is off the patch, or a point of the pattern is
///   steps       more than a tenth of the squares of the rate of change of P is in lines above half of the frame rate
///
/// throws   InputError if there is no target and no place, no method with metrics, or a place that is not on the patch;
///          of a pattern of an earlier version, without a line or with more than 10,000 up to spec.highest_hz, or if
///          spec.at is not that of its patch
Felt felt_of(const Run& run, const Scene& scene, const FeltSpec& spec);
Felt felt_of(const Motion& motion, const Scene& scene, const FeltSpec& spec);

}  // namespace touchfield
