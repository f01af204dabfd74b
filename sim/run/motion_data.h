#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/felt/skin_patch.h"
#include "sim/field/metrics.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// Stages of some work and the seconds that this machine took for each.
using StageSeconds = std::vector<std::pair<std::string, double>>;

/// How far what a sensor made of the skin was from the true one, rms about the target (seen_error) [m].
struct SkinOff {
  double skin = kNotComputed;
  double patch = kNotComputed;
};

/// Phases that a method found for one sample of a moving hand. Times are from the beginning of the motion [s].
struct MotionFrame {
  double sampled = 0;    // when the hand was where the sensor says
  double started = 0;    // when the solver began
  double late = 0;       // how long after its turn that was
  double shown = 0;      // when the array had the phases
  double pose_time = 0;  // the instant whose hand was solved for: `sampled`, or later if predicted
  SkinOff off{};         // of its sample
  Vector3 target = Vector3::Constant(kNotComputed);  // middle of the patch that it was solved for [m]; NaN if silent
  double target_off = kNotComputed;  // from where that patch really was at pose_time [m], along the skin or off it
  bool silent = false;               // all drives are 0: the target held no skin, or
  bool lost = false;                 // the sensor did not know where the hand was
  PhaseSolution solution{};          // of a silent frame: N zeros
  StageSeconds seconds{};
  std::vector<Vector3>
      joints{};  // of its sample, of tracked_joints(), in the world's frame; NaN of no hand; none where
                 // no hand tracker is the sensor [m]
};

/// What is on the array at an instant, on the true hand as it is then.
struct MotionScore {
  double time = 0;                         // [s]
  int frame = -1;                          // that the array shows; -1: none yet
  double age = kNotComputed;               // of the sample that the frame is of [s]
  Vector3 displacement = Vector3::Zero();  // of the target's patch since that sample [m]
  Metrics metrics{};                       // those that need a target are NaN where it holds no skin
};

/// The evaluated skin at an instant, for pictures, the page and ParaView.
struct MotionInstant {
  double time = 0;  // [s]
  TriangleMesh mesh;
  std::optional<TriangleMesh> sensed{};  // the solved skin in the sample of the frame that the first method shows; none
                                         // of an exact sensor, a lost sample, or before the first frame
  std::optional<Target> target{};        // on this mesh
  std::vector<std::pair<std::string, Eigen::VectorXcd>> pressure{};  // method's name -> on its faces [Pa]
};

/// The radiation pressure about a place of a still hand, in every frame of a pattern.
struct MotionPatch {
  SkinPatch skin;                                       // of the evaluated mesh
  Eigen::MatrixXd radiation;                            // P, K x F [Pa]
  double rate = 0;                                      // frames per second
  std::vector<std::pair<std::string, Vector3>> points;  // the pattern's own, on the skin [m]
};

struct MotionMethod {
  std::string name;    // unique in a motion
  std::string method;  // paper, unscattered, focus, ...
  std::string scheme;
  std::vector<MotionFrame> frames{};
  std::vector<MotionScore> scores{};
  std::vector<std::pair<std::string, Eigen::VectorXd>> watched{};  // place -> |p| there at each score [Pa]
  int dropped = 0;                                                 // turns at which the solver was still busy
};

/// Everything that `play` computed; grows as the motion continues.
struct Motion {
  std::string name;
  std::string scene;  // resolved YAML text
  double seconds = 0;
  TransducerArray array{};
  double radiation_per_square = kNotComputed;   // of its air (metrics.h) [1/Pa]; not known of older files
  TriangleMesh mesh;                            // the solver's, at the motion's beginning, in the world's frame
  std::optional<TriangleMesh> evaluation{};     // the evaluation's, likewise
  SkinExtent solved_skin = SkinExtent::kWhole;  // which `mesh` is of
  std::vector<MotionMethod> methods{};
  std::vector<std::pair<std::string, double>> timings{};  // stage of the whole -> seconds
  std::vector<std::string> warnings{};
  std::vector<std::string> notes{};
  Provenance provenance{};
  bool complete = false;
  std::vector<MotionInstant> instants{};  // some, each with a score: of all methods, in their order
  std::optional<MotionPatch> patch{};     // of a pattern
};

/// The skin that the scores of a motion are of, at its beginning. The instants have its triangles.
inline const TriangleMesh& evaluated_mesh(const Motion& motion) {
  return motion.evaluation ? *motion.evaluation : motion.mesh;
}

}  // namespace touchfield
