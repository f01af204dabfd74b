#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <string>
#include <variant>
#include <vector>

#include "sim/core/progress.h"
#include "sim/motion/loop_clock.h"
#include "sim/motion/moving_model.h"
#include "sim/run/motion_data.h"

namespace touchfield {

/// Whether the solver knows the motion as it is.
inline bool is_exact(const MotionSpec::Sensor& sensor) { return std::holds_alternative<std::monostate>(sensor.sight); }

/// Number i of so many, evenly from 0 to `last`, both among them; of one 0.
inline double evenly(double last, int i, int count) { return count > 1 ? last * i / (count - 1) : 0.0; }

/// What a sensor saw of what moves.
struct Seen {
  double seconds = 0;     // when it was so, from the beginning of the motion
  MotionState state{};    // of the model that is solved; of no meaning if lost
  bool lost = false;      // it does not know where the body is
  StageSeconds stages{};  // what it took
  std::vector<Vector3>
      joints{};  // that a hand tracker gave, of tracked_joints(), in the world's frame; NaN of no hand [m]
};

/// What the solver knows of a motion: nothing but the samples of its sensor.
class MotionSensor {
 public:
  MotionSensor() = default;
  MotionSensor(const MotionSensor&) = delete;
  MotionSensor& operator=(const MotionSensor&) = delete;
  virtual ~MotionSensor() = default;

  /// The model that is solved: the true one, or what is fitted to it.
  virtual const MovingModel& solved() const = 0;

  /// Learns what has to be known before the first sample, and forgets all samples. Called before anything below.
  virtual void start(Progress& /*progress*/) {}

  /// What is to be said of a result because of that, a line each, once it has started.
  virtual std::vector<std::string> notes() const { return {}; }

  /// What makes its samples doubtful, so far; once it has started.
  virtual std::vector<std::string> warnings() const { return {}; }

  /// Whether a sample depends on those before it, so that none should be left out.
  virtual bool remembers() const { return false; }

  /// When what it sees was recorded; null where it sees at any time.
  virtual const RecordedTimes* recording() const { return nullptr; }

  /// One sample, in a sensor that remembers with a number beyond those before it.
  ///
  /// number    counted from 0
  /// seconds   when it is taken, from the beginning of the motion
  /// throws    InputError where what it sees is no skin
  virtual Seen sample(std::int64_t number, double seconds) = 0;

  /// The solving mesh at about so many places, at least one, of those where samples may have it: evenly over the
  /// motion.
  virtual std::vector<TriangleMesh> places(int count) const = 0;
};

/// Sees everything as it is.
class ExactSensor final : public MotionSensor {
 public:
  /// truth   has to outlive the sensor
  explicit ExactSensor(const MovingModel& truth) : truth_(truth) {}
  ExactSensor(MovingModel&&) = delete;

  const MovingModel& solved() const override { return truth_; }
  Seen sample(std::int64_t /*number*/, double seconds) override { return {seconds, truth_.state(seconds)}; }
  std::vector<TriangleMesh> places(int count) const override;

 private:
  const MovingModel& truth_;
};

/// Sees the true skin displaced by noise, as `sensing` does for a still (perturbed): the solving mesh with its caps,
/// and the skin beyond. The seed is noise.seed + the number of the sample, so the noise of two samples has nothing in
/// common. Where the skin would cut itself (perturbed throws) it is drawn again from a seed 1,000,000 on, up to four
/// times. Boxes on landmarks stand where the displaced skin has them.
class NoisySensor final : public MotionSensor {
 public:
  /// truth   has to outlive the sensor
  NoisySensor(const MovingModel& truth, const SensingNoise& noise) : truth_(truth), noise_(noise) {}
  NoisySensor(MovingModel&&, const SensingNoise&) = delete;

  const MovingModel& solved() const override { return truth_; }
  /// throws   InputError as perturbed, with the time
  Seen sample(std::int64_t number, double seconds) override;
  std::vector<TriangleMesh> places(int count) const override;

 private:
  struct Skin {
    TriangleMesh mesh;
    SkinPatches beyond;
  };
  Skin seen(std::int64_t number, double seconds) const;

  const MovingModel& truth_;
  SensingNoise noise_;
};

/// Samples by their numbers, each taken once however often it is asked for.
class SampleStore {
 public:
  SampleStore(MotionSensor& sensor, double hz) : sensor_(sensor), hz_(hz) {}

  const Seen& at(std::int64_t number);
  /// Lets go of the samples taken before that time [s]. Of a sensor that remembers they cannot be had again.
  void forget(double seconds);

 private:
  MotionSensor& sensor_;
  double hz_;
  std::map<std::int64_t, Seen> taken_;
  std::int64_t next_ = 0;  // of a sensor that remembers
};

/// "noise of 0.5 mm rms over 5 mm, 30 samples per second": what a scene's sensor is, for a person.
std::string sensor_text(const MotionSpec::Sensor& sensor);

/// The sensor's warnings, and of a recording step_warning.
std::vector<std::string> sensor_warnings(const MotionSensor& sensor, double hz);

/// A motion as it is, and what sees it.
struct SensedMotion {
  Scene scene;                               // as it is written
  std::unique_ptr<const MovingModel> truth;  // what is scored; null where nobody knows it
  std::unique_ptr<MotionSensor> sensor;

  const MovingModel& solved() const { return sensor->solved(); }
};

/// Whether time is simulated, or the wall's, when a sensor may see what happens now.
enum class MotionClock { kSimulated, kWall };

/// Error of the skin that a sensor saw: rms over the area of the true faces, along their normals to the seen skin
/// (signed_distances) [m]. It counts the faces whose middle is within 25 mm (skin) or 5 mm (patch) of the middle of a
/// target box. Nothing without a box, or where no face is that near.
///
/// truth, seen   models at the same instant
SkinOff seen_error(const Model& truth, const Model& seen);

/// How far the middle of the patch that a frame was solved for is from its true place at the frame's pose_time [m]. It
/// contains the errors of the sensor and of the prediction, along the skin too, which the distances of SkinOff do not
/// see. NaN for a frame without a target.
double target_off(const MovingModel& truth, const MotionFrame& frame);

}  // namespace touchfield
