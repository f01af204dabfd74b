#pragma once

#include <array>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "sim/core/rigid_motion.h"
#include "sim/hand/perturb.h"
#include "sim/scene/body_spec.h"
#include "sim/scene/listen_address.h"

namespace touchfield {

/// value(t) = about + amplitude sin(2 pi hz t + phase), in the unit of the number that changes.
struct SineLaw {
  double amplitude = 0;
  double hz = 0;
  double phase = 0;             // [rad]
  std::optional<double> about;  // absent: the scene's own value
};
/// Through (t [s], value) by monotone cubics; constant before the first and after the last.
struct KeysLaw {
  std::vector<std::array<double, 2>> keys;
};
/// value(t) = the scene's own value + rate t.
struct RateLaw {
  double rate = 0;  // per second
};
using MotionLaw = std::variant<SineLaw, KeysLaw, RateLaw>;

/// A number of the scene that varies; its law is in the unit of the path.
struct MotionChange {
  std::string path;  // as VaryingNumber has it: body.place.at_mm[2]
  MotionLaw law;
};

/// A depth camera that is simulated. What its model is made of: sim/cameras/simulated_camera.h.
struct CameraSpec {
  std::string model = "d415";
  Vector3 at = Vector3::Zero();       // its eye [m]
  Vector3 look_at = Vector3::Zero();  // [m]
  double roll = 0;                    // about where it looks [rad]; 0: the image's right is level
  std::array<int, 2> resolution{640, 360};
  double disparity_noise = 0.08;  // [pixels], rms
  double depth_unit = 1e-3;       // of the image's numbers [m]
  double shift_error = 0;         // of its place as the fit is told it [m], in a direction that is drawn
  double turn_error = 0;          // likewise [rad]
};

/// Images of real cameras, or of `touchfield see`: docs/cameras.md.
struct RecordedSpec {
  std::string folder;
};

/// Joints of a hand tracker: sim/cameras/hand_tables.h.
struct JointsSpec {
  std::variant<std::string, ListenAddress> from;  // a table of them; or where they come while the motion plays
  RigidMotion pose;                               // from the tracker's frame to the world's
};

/// The loop of sensor, solver and array while the scene moves.
struct MotionSpec {
  enum class Target { kOnSkin, kInWorld };
  enum class Start { kPrevious, kZero };
  enum class Prediction { kNone, kLinear, kKalman };
  struct Sensor {
    double hz = 30;
    double latency = 0;  // from when a sample is taken until it is known [s]
    /// The solver's knowledge of the skin. First: its exact place. Second: that place with noise of its own in every
    /// sample. Others: a fit to images of simulated or recorded cameras, or to tracked joints.
    std::variant<std::monostate, SensingNoise, std::vector<CameraSpec>, RecordedSpec, JointsSpec> sight;
    unsigned seed = 1;              // of what cameras get wrong
    std::optional<HandShape> hand;  // that is fitted; absent: the scene's pose, of images in mean size
    std::array<Vector3, 2> workspace{Vector3{-0.3, -0.3, 0.05},  // the corners of the box that hands are looked for in,
                                     Vector3{0.3, 0.3, 0.6}};    // the world's frame [m]
  };

  /// What a frame may take; the mesh, the scheme and the steps are then chosen for it.
  struct Frame {
    double budget = 0;  // [s]
  };

  double seconds = 0;
  std::vector<MotionChange> changes;
  Target target = Target::kOnSkin;
  double frames_hz = 20;
  int iterations = 5;
  Start start = Start::kPrevious;
  bool steer = true;
  std::optional<Frame> frame;
  Sensor sensor;
  std::optional<double> solve;  // what a frame takes [s]; absent: what it is measured to take
  double array_delay = 1e-3;    // from a frame's phases until they sound [s]
  Prediction predict = Prediction::kKalman;
  double score_hz = 61;
  double stale = 0.15;  // of a sample: older ones are not felt, `live` is silent [s]
};

}  // namespace touchfield
