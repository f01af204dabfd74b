#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/acoustics/medium.h"
#include "sim/scene/array_spec.h"
#include "sim/scene/body_spec.h"
#include "sim/scene/motion_spec.h"
#include "sim/scene/pattern_spec.h"
#include "sim/scene/solve_spec.h"

namespace touchfield {

struct MediumSpec {
  double temperature = kRoomTemperature;  // [K]
  double humidity = 0.5;                  // 0..1
  bool absorption = false;
  std::optional<double> sound_speed;  // [m/s], instead of the temperature's
  std::optional<double> density;      // [kg/m3], likewise
};

struct FieldSpec {
  std::string name;
  std::string plane;                 // xy, xz, yz; empty: a box of points, or one point
  Vector3 centre = Vector3::Zero();  // of the plane or box, or the point [m]
  Vector3 size = Vector3::Zero();    // extents along x, y, z [m], 0 across a plane and of one point
  double spacing = 1e-3;             // [m]
};

struct WriteSpec {
  bool h5 = true;
  bool vtp = true;
  bool vti = true;
  bool png = true;
  bool transfer = false;  // the transfer matrix, in run.h5: never without h5
};

/// Frequencies of a scene [Hz].
inline constexpr double kLeastFrequency = 1e3;
inline constexpr double kMostFrequency = 200e3;

/// What a motion may change of a scene: where its bodies are, and what is wanted on them.
struct Posture {
  std::vector<BodySpec> bodies;  // 1 or more
  std::optional<TargetSpec> target;
};

/// A scene as read and checked, in SI units, every default filled in.
struct Scene : Posture {
  std::string name;
  MediumSpec medium;
  double frequency = 40e3;  // [Hz]
  ArraySpec array;
  std::optional<SensingNoise> sensing;  // what the solver sees of the bodies; the evaluation sees them as they are
  SolveSpec solve;
  EvaluationSpec evaluation;
  std::vector<FieldSpec> fields;
  WriteSpec write;
  std::optional<MotionSpec> motion;    // the rest of the scene is the still that it starts from
  std::optional<PatternSpec> pattern;  // likewise of the still
};

}  // namespace touchfield
