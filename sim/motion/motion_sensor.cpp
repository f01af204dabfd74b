#include "sim/motion/motion_sensor.h"

#include <algorithm>
#include <stdexcept>
#include <utility>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/mesh/query/surface_fit.h"

namespace touchfield {

namespace {

constexpr std::uint64_t kDraws = 5;             // of noise until the skin that is seen is one
constexpr std::uint64_t kNextDraw = 1'000'000;  // seeds on: beyond those of a motion's other samples

}  // namespace

std::vector<TriangleMesh> ExactSensor::places(int count) const {
  std::vector<TriangleMesh> meshes;
  const double seconds = truth_.first().fixed->scene.motion->seconds;
  for (int i = 0; i < count; ++i) {
    meshes.push_back(truth_.at(truth_.state(evenly(seconds, i, count))).body.mesh);
  }
  return meshes;
}

NoisySensor::Skin NoisySensor::seen(std::int64_t number, double seconds) const {
  const Model truth = truth_.at(truth_.state(seconds));
  for (std::uint64_t draw = 0;; ++draw) {
    SensingNoise noise = noise_;
    noise.seed = static_cast<unsigned>(noise.seed + static_cast<std::uint64_t>(number) + draw * kNextDraw);
    try {
      return {perturbed(truth.body.mesh, noise).mesh, perturbed(truth.beyond, noise)};
    } catch (const InputError& error) {
      if (draw + 1 == kDraws) {
        throw InputError(fmt::format("motion.sensor: sample {} at {:.3f} s: {}", number, seconds, error.what()));
      }
    }
  }
}

Seen NoisySensor::sample(std::int64_t number, double seconds) {
  Seen sample{seconds, truth_.state(seconds)};
  Skin skin = seen(number, seconds);
  sample.state.skin = skin.mesh.vertices();
  sample.state.patches = std::move(skin.beyond.corners);
  return sample;
}

std::vector<TriangleMesh> NoisySensor::places(int count) const {
  const MotionSpec& motion = *truth_.first().fixed->scene.motion;
  std::vector<TriangleMesh> meshes;
  for (int i = 0; i < count; ++i) {
    const double seconds = evenly(motion.seconds, i, count);
    meshes.push_back(seen(last_instant(to_ticks(seconds), motion.sensor.hz), seconds).mesh);
  }
  return meshes;
}

const Seen& SampleStore::at(std::int64_t number) {
  if (const auto found = taken_.find(number); found != taken_.end()) {
    return found->second;
  }
  if (sensor_.remembers() && number < next_) {
    throw std::logic_error("this sample is forgotten");
  }
  for (std::int64_t k = sensor_.remembers() ? next_ : number; k <= number; ++k) {
    taken_.emplace(k, sensor_.sample(k, to_seconds(instant(k, hz_))));
  }
  next_ = number + 1;
  return taken_.at(number);
}

void SampleStore::forget(double seconds) {
  taken_.erase(taken_.begin(), taken_.lower_bound(last_instant(to_ticks(std::max(0.0, seconds)), hz_)));
}

std::string sensor_text(const MotionSpec::Sensor& sensor) {
  std::string sight = "the true skin";
  if (const auto* noise = std::get_if<SensingNoise>(&sensor.sight)) {
    sight = fmt::format("the skin with noise of {:.3g} mm rms over {:.3g} mm", noise->rms / kMillimetre,
                        noise->correlation / kMillimetre);
  } else if (const auto* cameras = std::get_if<std::vector<CameraSpec>>(&sensor.sight)) {
    sight = fmt::format("a hand fitted to images of {} simulated camera{}", cameras->size(),
                        cameras->size() == 1 ? "" : "s");
  } else if (const auto* recorded = std::get_if<RecordedSpec>(&sensor.sight)) {
    sight = fmt::format("a hand fitted to the images in {}", recorded->folder);
  } else if (const auto* joints = std::get_if<JointsSpec>(&sensor.sight)) {
    const auto* address = std::get_if<ListenAddress>(&joints->from);
    sight = address != nullptr ? fmt::format("a hand fitted to the joints that come to UDP {}", address->text())
                               : fmt::format("a hand fitted to the joints in {}", std::get<std::string>(joints->from));
  }
  return fmt::format("{}, {:g} samples per second, known {:g} ms later", sight, sensor.hz, 1e3 * sensor.latency);
}

std::vector<std::string> sensor_warnings(const MotionSensor& sensor, double hz) {
  std::vector<std::string> warnings = sensor.warnings();
  if (const RecordedTimes* recorded = sensor.recording()) {
    if (std::string text = step_warning(*recorded, hz); !text.empty()) {
      warnings.push_back(std::move(text));
    }
  }
  return warnings;
}

namespace {

constexpr double kSkinRound = 25e-3;  // [m]
constexpr double kPatchRound = 5e-3;  // [m]

}  // namespace

SkinOff seen_error(const Model& truth, const Model& seen) {
  const TriangleMesh& mesh = truth.body.mesh;
  Eigen::VectorXd away = Eigen::VectorXd::Constant(mesh.face_count(), std::numeric_limits<double>::infinity());
  for (const TargetBox& box : truth.boxes) {
    away = away.cwiseMin((mesh.centroids().colwise() - box.centre).colwise().norm().transpose());
  }
  const Eigen::VectorXd distances = signed_distances(mesh, seen.body.mesh);
  const auto rms_within = [&](double reach) {
    std::vector<bool> keep(static_cast<std::size_t>(away.size()));
    for (std::size_t f = 0; f < keep.size(); ++f) {
      keep[f] = away(static_cast<Eigen::Index>(f)) <= reach;
    }
    const SkinDistance distance = skin_distance(mesh, distances, keep);
    return distance.area > 0 ? distance.rms : kNotComputed;
  };
  return {rms_within(kSkinRound), rms_within(kPatchRound)};
}

double target_off(const MovingModel& truth, const MotionFrame& frame) {
  if (!frame.target.allFinite()) {
    return kNotComputed;
  }
  return (truth.patch(truth.at(truth.state(frame.pose_time))) - frame.target).norm();
}

}  // namespace touchfield
