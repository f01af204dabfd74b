#include "sim/motion/fitted_sensor.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/motion/loop_clock.h"
#include "sim/motion/running_median.h"
#include "sim/motion/whole_skin.h"
#include "sim/sensing/camera_folder.h"
#include "sim/sensing/simulated_camera.h"
#include "sim/solve/stages.h"

namespace touchfield {

namespace {

constexpr double kScan = 1.0;                    // of images that the shape is learnt from [s]
constexpr double kScanHz = 30;                   // at most
constexpr std::int64_t kScanFrames = 1'000'000;  // their numbers begin there: the noise of other images
constexpr int kFirstLooks = 40;                  // at the first images, until the hand is found
constexpr int kMostKept = 65;                    // that are kept of a rehearsal

std::string key_of(const Scene& scene) {
  return std::holds_alternative<RecordedSpec>(scene.motion->sensor.sight) ? "motion.sensor.recorded"
                                                                          : "motion.sensor.cameras";
}

/// The hand that is fitted, before its shape is learnt.
HandShape fitted_hand(const Scene& scene) {
  const MotionSpec::Sensor& sensor = scene.motion->sensor;
  if (scene.bodies.size() != 1) {
    throw InputError(fmt::format("{}: a hand is fitted, and the scene has {} bodies, must have 1", key_of(scene),
                                 scene.bodies.size()));
  }
  const auto* own = std::get_if<HandShape>(&scene.bodies.front().shape);
  if (own == nullptr && (!sensor.hand || std::holds_alternative<RecordedSpec>(sensor.sight))) {
    throw InputError(fmt::format("{}: a hand is fitted, and the scene's body is none; must be body.hand{}",
                                 key_of(scene),
                                 std::holds_alternative<RecordedSpec>(sensor.sight)
                                     ? ""
                                     : ", or motion.sensor.hand must say which hand is to be fitted to it"));
  }
  if (sensor.hand) {
    return *sensor.hand;
  }
  HandShape mean = *own;
  mean.length = HandShape{}.length;
  mean.breadth = HandShape{}.breadth;
  return mean;
}

/// The hand alone: the images need not show as much of a forearm as the scene has, and its end says nothing of the hand.
HandShape without_forearm(HandShape hand) {
  hand.forearm = 0;
  return hand;
}

/// Since its first image; the last one holds for as long as one usually does.
double covered_seconds(const CameraFolder& folder) {
  RunningMedian period;  // [ticks]
  for (std::size_t k = 1; k < folder.size(); ++k) {
    period.add(to_ticks(folder.seconds(k)) - to_ticks(folder.seconds(k - 1)));
  }
  return to_seconds(to_ticks(folder.seconds(folder.size() - 1)) - to_ticks(folder.seconds(0)) + period.value());
}

}  // namespace

Scene fitted_scene(const Scene& scene) {
  Scene solved = scene;
  BodySpec& body = solved.bodies.front();
  body.shape = fitted_hand(scene);
  if (!body.edge) {
    body.edge.emplace().far = WholeSkin::kFar;
  }
  solved.judge.kind = JudgeSpec::Kind::kNone;
  std::erase_if(solved.motion->changes, [](const MotionChange& change) { return change.path.rfind("target", 0) != 0; });
  if (std::holds_alternative<RecordedSpec>(scene.motion->sensor.sight) &&
      solved.motion->changes.size() != scene.motion->changes.size()) {
    throw InputError(
        "motion.change: the images of motion.sensor.recorded say how the hand moves; nothing but the target can change "
        "beside them");
  }
  return solved;
}

HandImages simulated_images(const MovingModel& truth, KeptBodies* kept) {
  const MotionSpec& motion = *truth.first().scene.motion;
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
  const double begin = images->seconds(0);
  const auto last = std::make_shared<std::pair<std::size_t, DepthFrame>>(images->size(), DepthFrame());
  return {images->cameras(),
          [images, begin, last](std::int64_t /*number*/, double seconds) {
            std::size_t newest = 0;
            std::size_t after = images->size();
            while (after - newest > 1) {
              const std::size_t middle = newest + (after - newest) / 2;
              (images->seconds(middle) - begin <= seconds + 0.5 / kTicksASecond ? newest : after) = middle;
            }
            if (last->first != newest) {
              *last = {newest, images->frame(newest)};
              last->second.seconds = images->seconds(newest) - begin;
            }
            return last->second;
          },
          covered_seconds(*images), images->warnings()};
}

FittedSensor::FittedSensor(const Scene& scene, HandImages images, const MovingModel* truth, KeptBodies* kept)
    : solved_(fitted_scene(scene), kept),
      images_(std::move(images)),
      truth_(truth),
      hand_(without_forearm(std::get<HandShape>(solved_.first().scene.bodies.front().shape)), HandTemplate::kUsualEdge),
      workspace_(scene.motion->sensor.workspace),
      hz_(scene.motion->sensor.hz),
      seconds_(scene.motion->seconds),
      carrier_(hand_.carrier(solved_.first().own_frame(solved_.first().body.mesh.vertices()))) {
  if (const SkinPatches& beyond = solved_.first().beyond; !beyond.empty()) {
    beyond_ = hand_.carrier(solved_.first().own_frame(beyond.corners));
  }
}

double FittedSensor::time_of(std::int64_t number) const { return to_seconds(instant(number, hz_)); }

void FittedSensor::start(Progress& progress) {
  tracker_.emplace(hand_, images_.cameras, Box(workspace_[0], workspace_[1]));
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

/// The images that the shape was learnt from; none if it was not.
std::optional<FittedSensor::Scan> FittedSensor::scan(HandTracker& tracker, Progress& progress) const {
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
      return Scan{count, begin};
    }
    first += static_cast<std::int64_t>(count) * step;
  }
  return std::nullopt;
}

bool FittedSensor::learn(Progress& progress) {
  const double length = hand_.hand().length;
  const auto from = scan(*tracker_, progress);
  if (from) {
    const HandProportions& by = tracker_->shape().proportions;
    notes_.push_back(fmt::format(
        "scan: before the clock starts the hand's shape was learnt from {} images of the second from {:g} s on; its "
        "length is {:.1f} mm, its breadth {:.1f} mm",
        from->images, from->begin, length * std::exp(by(kLengthRatio)) / kMillimetre,
        hand_.hand().breadth * std::exp(by(kBreadthRatio)) / kMillimetre));
  } else {
    notes_.push_back(fmt::format(
        "scan: within no second of the motion the hand was found in three images; its shape is not learnt, it is "
        "taken to be {:.1f} mm long",
        length / kMillimetre));
    HandShape other = hand_.hand();
    other.side = other_side(other.side);
    HandTracker tracker(HandTemplate(other, HandTemplate::kUsualEdge), images_.cameras,
                        Box(workspace_[0], workspace_[1]));
    if (scan(tracker, progress)) {
      const char* side = other.side == HandSide::kLeft ? "left" : "right";
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
      rehearsed_.emplace_back(*seen.state.skin, solved_.first().body.mesh.triangles());
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
  Seen seen{frame.seconds, solved_.state(frame.seconds), fit.lost};
  if (!fit.lost) {
    seen.state.skin.emplace();
    tracker_->skin(fit, carrier_, *seen.state.skin);
    if (beyond_) {
      tracker_->skin(fit, *beyond_, seen.state.patches.emplace());
    }
    try {
      TriangleMesh(*seen.state.skin, solved_.first().body.mesh.triangles());
    } catch (const InputError&) {
      seen.lost = true;
    }
  }
  return seen;
}

Seen FittedSensor::sample(std::int64_t number, double seconds) {
  const DepthFrame frame = images_.at(number, seconds);
  if (!last_ || frame.seconds > last_->seconds) {
    last_ = seen(frame);
  }
  return *last_;
}

std::vector<TriangleMesh> FittedSensor::places(int count) const {
  if (truth_ != nullptr) {
    return ExactSensor(*truth_).places(count);
  }
  if (rehearsed_.empty()) {
    return {solved_.first().body.mesh};
  }
  std::vector<TriangleMesh> chosen;
  const auto last = static_cast<double>(rehearsed_.size() - 1);
  for (int i = 0; i < count; ++i) {
    const auto place = static_cast<std::size_t>(std::lround(count > 1 ? last * i / (count - 1) : 0.0));
    chosen.push_back(rehearsed_[place]);
  }
  return chosen;
}

}  // namespace touchfield
