#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "sim/cameras/hand_template.h"
#include "sim/cameras/hand_tracker.h"
#include "sim/motion/motion_sensor.h"

namespace touchfield {

/// The scene that is solved where a hand is fitted to images or joints. Its body is the hand that is fitted:
/// motion.sensor.hand, or else the scene's own hand, for images in the mean size. It has the scene's place, edges, cut
/// and target. A body without edges gets WholeSkin::kFar. Only its target moves by itself, and it has no evaluation.
///
/// throws   InputError unless it is one body, a hand. With motion.sensor.hand the body may be another shape, except for
///          a recording. Also if motion.change of a recording names anything but the target
Scene fitted_scene(const Scene& scene);

/// Whether the sensor's hand is somebody's recording, so that nobody knows the true one.
bool is_recording(const MotionSpec::Sensor& sensor);

/// The solving mesh of fitted_scene, carried by the hand that is fitted vertex by vertex.
class FittedSkin {
 public:
  /// throws   InputError as fitted_scene, MovingModel and HandTemplate
  FittedSkin(const Scene& scene, KeptBodies* kept);

  const MovingModel& solved() const { return solved_; }
  /// The hand alone: what tracks it need not see as much of a forearm as the scene has, whose end says nothing of the
  /// hand.
  const HandTemplate& hand() const { return hand_; }

  Seen lost(double seconds) const { return {seconds, solved_.state(seconds), true}; }
  /// carry   places what a carrier of the template holds in the world
  /// returns the skin, or lost where it is no surface
  Seen seen(double seconds, const std::function<void(const HandTemplate::Carrier&, Points&)>& carry) const;

 private:
  MovingModel solved_;
  HandTemplate hand_;
  HandTemplate::Carrier carrier_;
  std::optional<HandTemplate::Carrier> beyond_;  // of the skin that is not solved
};

/// Where the images of a hand come from.
struct HandImages {
  std::vector<DepthCamera> cameras;  // as they are told to stand
  /// The images of sample `number`, taken at most at `seconds`; its own time is that of the motion.
  std::function<DepthFrame(std::int64_t number, double seconds)> at;
  double seconds = 0;                       // that there are images for
  std::vector<std::string> warnings{};      // CameraFolder's
  std::optional<RecordedTimes> recorded{};  // when, unless at any time
};

/// Simulated cameras that look at the true skin, whole.
///
/// truth   with motion.sensor.cameras; kept by reference: it must outlive the images
HandImages simulated_images(const MovingModel& truth, KeptBodies* kept = nullptr);
HandImages simulated_images(MovingModel&&, KeptBodies* kept = nullptr) = delete;

/// A folder of images (CameraFolder), whose first image is the motion's beginning. At each time the newest image by
/// then, until as long after the last one as the median of the times between the last 32.
///
/// progress   hears of the check of its images; may be null
HandImages recorded_images(const std::string& folder, Progress* progress = nullptr);

/// Sees the hand that HandTracker fits to images. It never knows the true one.
///
/// The shape is learnt before the clock starts, as from a scan: from the first second of images in which the hand is
/// found. Simulated cameras have separate noise for these images. The loop then begins with the hand found, if it is in
/// the first images. A sample is the solving mesh of fitted_scene, carried vertex by vertex by the fit. It is lost
/// where the fit is lost, or where the fit makes no surface.
class FittedSensor final : public MotionSensor {
 public:
  /// truth    where the hand really goes, only to know which drives are needed (places); null: that is told by a fit to
  ///          all images, before the clock starts. It must outlive the sensor
  /// throws   InputError as fitted_scene, MovingModel and HandTracker
  FittedSensor(const Scene& scene, HandImages images, const MovingModel* truth, KeptBodies* kept = nullptr);

  const MovingModel& solved() const override { return skin_.solved(); }
  void start(Progress& progress) override;
  bool remembers() const override { return true; }
  const RecordedTimes* recording() const override { return images_.recorded ? &*images_.recorded : nullptr; }
  Seen sample(std::int64_t number, double seconds) override;
  std::vector<TriangleMesh> places(int count) const override;
  std::vector<std::string> notes() const override { return notes_; }

 private:
  /// How many images the shape was learnt from, and when they begin [s]; none if it was not.
  std::optional<std::pair<std::size_t, double>> scan(HandTracker& tracker, Progress& progress) const;
  bool learn(Progress& progress);
  void rehearse(Progress& progress);
  /// Why the hand is not found in the first image; empty if it is.
  std::string find();
  Seen seen(const DepthFrame& frame);
  double time_of(std::int64_t number) const { return to_seconds(instant(number, hz_)); }

  FittedSkin skin_;
  HandImages images_;
  const MovingModel* truth_;
  std::array<Vector3, 2> workspace_;
  double hz_;
  double seconds_;  // of the motion
  std::optional<HandTracker> tracker_;
  std::optional<Seen> last_;
  std::vector<TriangleMesh> rehearsed_;
  std::vector<std::string> notes_;
};

}  // namespace touchfield
