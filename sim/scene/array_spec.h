#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/acoustics/directivity.h"
#include "sim/acoustics/transducer_array.h"
#include "sim/scene/placement.h"

namespace touchfield {

struct GridArray {
  std::array<int, 2> count{44, 34};
  double pitch = kAutd3Pitch;  // [m]
};
struct Autd3Array {
  std::optional<std::array<int, 2>> layout;  // tiles edge to edge; or else
  std::vector<Placement> units;              // each unit's own place (transducer 0 on `at`)
  double pitch = kAutd3Pitch;
};
struct SonicsurfaceArray {};
struct PositionsArray {
  Points points;                     // [m]
  Points axes;                       // unit vectors
  std::vector<Eigen::Index> dead{};  // what a file says of channels, until the scene's calibration has it
};
struct PlaneWaveArray {
  Vector3 direction = Vector3::UnitZ();
  double amplitude = 1;  // [Pa]
};

/// Which of the two arrays a response belongs to: the one that the solver reckons with, the one that sounds.
enum class ResponseOf { kBoth, kSolver, kTruth };

/// Measured responses of the channels.
struct CalibrationSpec {
  std::vector<double> gain;   // one per channel; 0: dead
  std::vector<double> phase;  // [rad]
  std::string file;           // that they are read from; empty in a scene that is read
  ResponseOf in = ResponseOf::kBoth;
};

/// Responses drawn at random.
struct ToleranceSpec : ChannelTolerances {
  unsigned seed = 1;
  ResponseOf in = ResponseOf::kTruth;
};

struct ArraySpec {
  std::variant<GridArray, Autd3Array, SonicsurfaceArray, PositionsArray, PlaneWaveArray> layout;
  Vector3 at = Vector3::Zero();
  Vector3 angles = Vector3::Zero();
  Directivity::Kind directivity = Directivity::Kind::kT4010a1;
  double piston_radius = 4.5e-3;                  // [m]
  double level = 1.0;                             // 0 < level <= 1
  double source_strength = kAutd3SourceStrength;  // [Pa m]
  std::optional<CalibrationSpec> calibration;
  std::optional<ToleranceSpec> tolerances;
  std::optional<int> phase_levels;  // phase levels to which the true array rounds solved phases
};

/// How many channels an array will have.
Eigen::Index channel_count(const ArraySpec& spec);

/// Responses that a scene gives its channels: calibration times tolerances, of those that belong to the array.
struct ChannelResponses {
  ChannelResponse solver;  // what the solver reckons with
  ChannelResponse truth;   // what sounds
};
ChannelResponses channel_responses(const ArraySpec& spec);

/// Whether the solver reckons with other channels than those that sound, as far as the keys say.
bool solver_mistakes_channels(const ArraySpec& spec);

}  // namespace touchfield
