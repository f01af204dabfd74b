#include "sim/cameras/fitted_sensor.h"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "sim/cameras/camera_folder.h"
#include "sim/cameras/simulated_camera.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/core/version.h"
#include "sim/model/stages.h"
#include "sim/motion/loop_clock.h"
#include "sim/motion/moving_model.h"

namespace touchfield {

namespace {

std::string key_of(const MotionSpec::Sensor& sensor) {
  return std::holds_alternative<JointsSpec>(sensor.sight)     ? "motion.sensor.joints"
         : std::holds_alternative<RecordedSpec>(sensor.sight) ? "motion.sensor.recorded"
                                                              : "motion.sensor.cameras";
}

/// The hand that is fitted, before its shape is learnt.
HandShape fitted_hand(const Scene& scene) {
  const MotionSpec::Sensor& sensor = scene.motion->sensor;
  const std::string key = key_of(sensor);
  require(scene.bodies.size() == 1, "{}: a hand is fitted, but the scene has {} bodies, must have 1", key,
          scene.bodies.size());
  const auto* own = std::get_if<HandShape>(&scene.bodies.front().shape);
  require(own != nullptr || (sensor.hand && !is_recording(sensor)),
          "{}: a hand is fitted, but the scene's body is not a hand; must be body.hand{}", key,
          is_recording(sensor) ? "" : ", or motion.sensor.hand must say which hand is to be fitted to it");
  if (sensor.hand) {
    return *sensor.hand;
  }
  HandShape hand = *own;
  if (!std::holds_alternative<JointsSpec>(sensor.sight)) {
    hand.length = HandShape{}.length;
    hand.breadth = HandShape{}.breadth;
  }
  return hand;
}

}  // namespace

bool is_recording(const MotionSpec::Sensor& sensor) {
  return std::holds_alternative<RecordedSpec>(sensor.sight) || std::holds_alternative<JointsSpec>(sensor.sight);
}

Scene fitted_scene(const Scene& scene) {
  Scene solved = scene;
  BodySpec& body = solved.bodies.front();
  body.shape = fitted_hand(scene);
  if (!body.edge) {
    body.edge.emplace().far = WholeSkin::kFar;
  }
  solved.evaluation.kind = EvaluationSpec::Kind::kNone;
  std::erase_if(solved.motion->changes, [](const MotionChange& change) { return change.path.rfind("target", 0) != 0; });
  const MotionSpec::Sensor& sensor = scene.motion->sensor;
  require(!is_recording(sensor) || solved.motion->changes.size() == scene.motion->changes.size(),
          "motion.change: {} {} determine how the hand moves; only the target can change as well",
          std::holds_alternative<JointsSpec>(sensor.sight) ? "the joints of" : "the images of", key_of(sensor));
  return solved;
}

FittedSkin::FittedSkin(const Scene& scene, KeptBodies* kept)
    : solved_(fitted_scene(scene), kept),
      hand_([&] {
        HandShape hand = std::get<HandShape>(solved_.first().posture.bodies.front().shape);
        hand.forearm = 0;
        return HandTemplate(hand, HandTemplate::kUsualEdge);
      }()),
      carrier_(hand_.carrier(solved_.first().own_frame(solved_.first().body.mesh.vertices()))) {
  if (const SkinPatches& beyond = solved_.first().beyond; !beyond.empty()) {
    beyond_ = hand_.carrier(solved_.first().own_frame(beyond.corners));
  }
}

Seen FittedSkin::seen(double seconds, const std::function<void(const HandTemplate::Carrier&, Points&)>& carry) const {
  Seen seen{seconds, solved_.state(seconds), false};
  carry(carrier_, seen.state.skin.emplace());
  if (beyond_) {
    carry(*beyond_, seen.state.patches.emplace());
  }
  try {
    TriangleMesh(*seen.state.skin, solved_.first().body.mesh.triangles());
  } catch (const InputError&) {
    seen.lost = true;
  }
  return seen;
}

namespace {

constexpr double kScan = 1.0;                    // of images that the shape is learnt from [s]
constexpr double kScanHz = 30;                   // at most
constexpr std::int64_t kScanFrames = 1'000'000;  // their numbers begin there: the noise of other images
constexpr int kFirstLooks = 40;                  // at the first images, until the hand is found
constexpr int kMostKept = 65;                    // that are kept of a rehearsal

}  // namespace

HandImages simulated_images(const MovingModel& truth, KeptBodies* kept) {
  const MotionSpec& motion = *truth.first().fixed->scene.motion;
  const auto cameras =
      std::make_shared<SimulatedCameras>(std::get<std::vector<CameraSpec>>(motion.sensor.sight), motion.sensor.seed);
  const auto skin = std::make_shared<WholeSkin>(truth.first(), kept);
  return {cameras->told(),
          [&truth, cameras, skin](std::int64_t number, double seconds) {
            const MotionState state = truth.state(seconds);
            return cameras->sees(skin->at(truth.at(state), state), seconds, static_cast<std::uint64_t>(number));
          },
          motion.seconds};
}

HandImages recorded_images(const std::string& folder, Progress* progress) {
  const auto images = std::make_shared<CameraFolder>(folder, progress);
  const RecordedTimes times(images->times());
  const auto last = std::make_shared<std::pair<std::size_t, DepthFrame>>(images->size(), DepthFrame());
  return {images->cameras(),
          [images, times, last](std::int64_t /*number*/, double at) {
            const std::size_t newest = times.newest(at);
            if (last->first != newest) {
              *last = {newest, images->frame(newest)};
              last->second.seconds = times.seconds(newest);
            }
            return last->second;
          },
          times.covered(), images->warnings(), times};
}

FittedSensor::FittedSensor(const Scene& scene, HandImages images, const MovingModel* truth, KeptBodies* kept)
    : skin_(scene, kept),
      images_(std::move(images)),
      truth_(truth),
      workspace_(scene.motion->sensor.workspace),
      hz_(scene.motion->sensor.hz),
      seconds_(scene.motion->seconds) {}

void FittedSensor::start(Progress& progress) {
  tracker_.emplace(skin_.hand(), images_.cameras, Box(workspace_[0], workspace_[1]));
  last_.reset();
  notes_ = images_.warnings;
  const bool learnt = learn(progress);
  if (truth_ == nullptr && rehearsed_.empty()) {
    std::vector<std::pair<std::string, double>> seconds;
    timed(progress, seconds, "", "fit the hand to all images", [&] { rehearse(progress); });
  }
  if (const std::string why = find(); !learnt && !why.empty()) {
    notes_.push_back("lost: the hand is not found in the first images: " + why);
  }
}

std::optional<std::pair<std::size_t, double>> FittedSensor::scan(HandTracker& tracker, Progress& progress) const {
  const auto step = static_cast<std::int64_t>(std::ceil(hz_ / kScanHz));
  for (std::int64_t first = 0; time_of(first) < seconds_;) {  // the hand may come into the images later
    const double begin = time_of(first);
    std::size_t count = 0;
    while (time_of(first + static_cast<std::int64_t>(count) * step) < std::min(begin + kScan, seconds_)) {
      ++count;
    }
    const auto image = [&](std::size_t k) {
      const std::int64_t number = first + static_cast<std::int64_t>(k) * step;
      progress.advance(time_of(number) / seconds_);
      return images_.at(kScanFrames + number, time_of(number));
    };
    if (tracker.learn(count, image)) {
      return std::pair(count, begin);
    }
    first += static_cast<std::int64_t>(count) * step;
  }
  return std::nullopt;
}

bool FittedSensor::learn(Progress& progress) {
  const double length = skin_.hand().hand().length;
  const auto from = scan(*tracker_, progress);
  if (from) {
    const HandProportions& by = tracker_->shape().proportions;
    notes_.push_back(
        fmt::format("scan: before the clock starts the hand's shape was learnt from {} images of the second from {:g} "
                    "s on; its length is {:.1f} mm, its breadth {:.1f} mm",
                    from->first, from->second, length * std::exp(by(kLengthRatio)) / kMillimetre,
                    skin_.hand().hand().breadth * std::exp(by(kBreadthRatio)) / kMillimetre));
  } else {
    notes_.push_back(
        fmt::format("scan: in no second of the motion was the hand found in three images; its shape is not learnt, its "
                    "length is assumed to be {:.1f} mm",
                    length / kMillimetre));
    HandShape other = skin_.hand().hand();
    other.side = other_side(other.side);
    HandTracker tracker(HandTemplate(other, HandTemplate::kUsualEdge), images_.cameras,
                        Box(workspace_[0], workspace_[1]));
    if (scan(tracker, progress)) {
      const char* side = side_name(other.side);
      notes_.push_back(
          fmt::format("scan: the images show a {0} hand: the hand that is fitted must have side: {0}", side));
    }
  }
  return from.has_value();
}

void FittedSensor::rehearse(Progress& progress) {
  find();
  const std::int64_t count = last_instant(to_ticks(seconds_), hz_) + 1;
  const std::int64_t step = std::max<std::int64_t>(1, count / kMostKept);
  for (std::int64_t k = 0; k < count; ++k) {
    const Seen seen = sample(k, time_of(k));
    if (k % step == 0 && !seen.lost) {
      rehearsed_.emplace_back(*seen.state.skin, solved().first().body.mesh.triangles());
    }
    progress.advance(static_cast<double>(k + 1) / static_cast<double>(count));
  }
}

std::string FittedSensor::find() {
  tracker_->forget();
  last_.reset();
  const DepthFrame first = images_.at(0, 0.0);
  HandFit fit;
  for (int look = 0; look < kFirstLooks && fit.lost; ++look) {
    fit = tracker_->track(first);
  }
  return lost_text(fit);
}

Seen FittedSensor::seen(const DepthFrame& frame) {
  const HandFit fit = tracker_->track(frame);
  if (fit.lost) {
    return skin_.lost(frame.seconds);
  }
  return skin_.seen(frame.seconds,
                    [&](const HandTemplate::Carrier& carrier, Points& world) { tracker_->skin(fit, carrier, world); });
}

Seen FittedSensor::sample(std::int64_t number, double seconds) {
  const double begin = steady_now();
  const DepthFrame frame = images_.at(number, seconds);
  if (!last_ || frame.seconds > last_->seconds) {
    const double taken = steady_now();
    last_ = seen(frame);
    last_->stages = {{"images", taken - begin}, {"fit", steady_now() - taken}};
  }
  return *last_;
}

std::vector<TriangleMesh> FittedSensor::places(int count) const {
  if (truth_ != nullptr) {
    return ExactSensor(*truth_).places(count);
  }
  if (rehearsed_.empty()) {
    return {solved().first().body.mesh};
  }
  std::vector<TriangleMesh> chosen;
  const auto last = static_cast<double>(rehearsed_.size() - 1);
  for (int i = 0; i < count; ++i) {
    chosen.push_back(rehearsed_[static_cast<std::size_t>(std::lround(evenly(last, i, count)))]);
  }
  return chosen;
}

}  // namespace touchfield
