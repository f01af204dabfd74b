#include "sim/jobs/play_scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>
#include <iterator>
#include <utility>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#ifdef TOUCHFIELD_CAMERAS
#include "sim/cameras/fitted_sensor.h"
#include "sim/cameras/joints_sensor.h"
#endif
#include "sim/core/errors.h"
#include "sim/jobs/motion_pictures.h"
#include "sim/jobs/run_model.h"
#include "sim/model/stages.h"
#include "sim/motion/loop_clock.h"
#include "sim/pictures/figures.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/vtk_files.h"

namespace touchfield {

#ifdef TOUCHFIELD_CAMERAS

namespace {

void require_covered(const Scene& scene, double seconds, const std::string& recording) {
  if (to_ticks(scene.motion->seconds) > to_ticks(seconds) + 1) {  // times of a recording are rounded to a tick
    throw InputError(fmt::format("motion.seconds = {:g} must be <= {:g}, the length of the recording in {}",
                                 scene.motion->seconds, seconds, recording));
  }
}

/// Sets what cameras or joints see; of simulated cameras, the truth too.
void see_by_cameras(KeptBodies* kept, Progress* progress, MotionClock clock, SensedMotion& motion) {
  const Scene& scene = motion.scene;
  const auto& sight = scene.motion->sensor.sight;
  if (const auto* recorded = std::get_if<RecordedSpec>(&sight)) {
    HandImages images = recorded_images(recorded->folder, progress);
    require_covered(scene, images.seconds, recorded->folder);
    motion.sensor = std::make_unique<FittedSensor>(scene, std::move(images), nullptr, kept);
  } else if (const auto* joints = std::get_if<JointsSpec>(&sight)) {
    if (const auto* address = std::get_if<ListenAddress>(&joints->from)) {
      if (clock == MotionClock::kSimulated) {
        throw InputError(
            fmt::format("motion.sensor.joints.listen = {}: joints come by a port only while `touchfield live` "
                        "plays; give the file of a table here",
                        address->text()));
      }
      motion.sensor = std::make_unique<LiveJointsSensor>(scene, *address, joints->pose, kept);
      return;
    }
    const auto& file = std::get<std::string>(joints->from);
    const JointRecording recording = read_joints(file, joints->pose);
    require_covered(scene, RecordedTimes(recording.seconds).covered(), file);
    motion.sensor = std::make_unique<JointsSensor>(scene, recording, file, kept);
  } else {
    fitted_scene(scene);  // what is wrong with it is said before the true hand is meshed
    motion.truth = std::make_unique<const MovingModel>(scene, kept, progress);
    motion.sensor =
        std::make_unique<FittedSensor>(scene, simulated_images(*motion.truth, kept), motion.truth.get(), kept);
  }
}

}  // namespace

#endif

SensedMotion sensed_motion(const Scene& scene, KeptBodies* kept, Progress* progress,
                           [[maybe_unused]] MotionClock clock) {
  const auto& sight = scene.motion->sensor.sight;
  SensedMotion motion{scene, nullptr, nullptr};
  const auto* noise = std::get_if<SensingNoise>(&sight);
  if (noise == nullptr && !std::holds_alternative<std::monostate>(sight)) {
#ifdef TOUCHFIELD_CAMERAS
    see_by_cameras(kept, progress, clock, motion);
    return motion;
#else
    throw NotBuiltError(
        "motion.sensor: this program was built without depth cameras and tracked joints: configure with "
        "-DTOUCHFIELD_CAMERAS=ON, or give motion.sensor.noise");
#endif
  }
  motion.truth = std::make_unique<const MovingModel>(scene, kept, progress);
  if (noise != nullptr) {
    motion.sensor = std::make_unique<NoisySensor>(*motion.truth, *noise);
    motion.sensor->sample(0, 0.0);  // what it cannot be is found before anything is written
  } else {
    motion.sensor = std::make_unique<ExactSensor>(*motion.truth);
  }
  return motion;
}

namespace {

constexpr double kSeriesHz = 20;  // at most, about

int scores_of(const MotionSpec& motion) { return static_cast<int>(std::ceil(motion.seconds * motion.score_hz)); }

/// Every how many scores the skin is written.
int series_step(const MotionSpec& motion) {
  return std::max(1, static_cast<int>(std::ceil(motion.score_hz / kSeriesHz)));
}

/// Without scores there are no pictures.
bool is_drawn(const SensedMotion& sensed) { return sensed.truth && sensed.scene.write.png; }

/// Keeps work that takes longer each time to a tenth of the time.
class Rest {
 public:
  bool over() const { return Clock::now() >= next_; }
  void work(const std::function<void()>& work) {
    const auto begun = Clock::now();
    work();
    next_ = Clock::now() + 10 * (Clock::now() - begun);
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point next_;
};

std::vector<std::string> motion_files(const SensedMotion& sensed) {
  const Scene& scene = sensed.scene;
  std::vector<std::string> files = {"play.log", "failed.json", "motion.csv", "frames.csv"};
  if (scene.write.h5) {
    files.emplace_back("motion.h5");
  }
  if (scene.write.vtp && sensed.truth && sensed.scene.evaluation.kind != EvaluationSpec::Kind::kNone) {
    files.insert(files.end(), {"array.vtp", "evaluation.pvd"});
    for (int i = 0; i * series_step(*scene.motion) < scores_of(*scene.motion); ++i) {
      files.push_back(fmt::format("evaluation_{:04d}.vtp", i + 1));
    }
  }
  if (is_drawn(sensed)) {
    files.insert(files.end(), {"report.html", "motion.png", "strip.png"});
  }
  return files;
}

Motion play_scene(const SensedMotion& sensed, MotionOptions options, RunDirectory& directory, Progress& progress) {
  const Scene& scene = sensed.scene;
  std::vector<MotionInstant> waiting;  // for the next second, when the motion that they are of is there too
  std::vector<SeriesStep> series;
  int number = 0;
  options.scored = [&](const MotionInstant& instant) {
    if (scene.write.vtp && number % series_step(*scene.motion) == 0) {
      waiting.push_back(instant);
    }
    ++number;
  };
  Rest rest;
  options.second = [&](const Motion& motion) {
    if (rest.over() || motion.complete) {
      rest.work([&] {
        if (scene.write.h5) {
          write_motion_file(directory.file("motion.h5"), motion);
        }
        write_motion_csv(directory.file("motion.csv"), motion);
        write_frames_csv(directory.file("frames.csv"), motion);
      });
    }
    if (!waiting.empty() && series.empty()) {
      write_array_vtp(directory.file("array.vtp"), motion);
    }
    for (const MotionInstant& instant : waiting) {
      add_to_series(directory.path(), motion, instant, series);
    }
    waiting.clear();
  };
  std::vector<std::string> methods;
  std::ranges::transform(scene.solve.methods, std::back_inserter(methods), &MethodSpec::name);
  directory.plan(methods);
  Motion motion = play_motion(sensed, options, progress);
  for (const std::string& method : methods) {
    directory.finished(method);
  }
  if (is_drawn(sensed)) {
    timed(progress, motion.timings, "pictures", "draw pictures", [&] {
      draw_motion(directory.file("motion.png"), motion);
      draw_motion_page(motion, directory);
    });
  }
  return motion;
}

}  // namespace

Job<Motion> play_job(const SensedMotion& sensed, const MotionOptions& options) {
  return {sensed.scene.name, motion_files(sensed),
          [&sensed, options](RunDirectory& directory, Progress& progress) {
            return play_scene(sensed, options, directory, progress);
          },
          [](const Motion& motion, const std::string& directory) {
            return Json{{"name", motion.name},         {"directory", directory},
                        {"seconds", motion.seconds},   {"methods", method_values(motion)},
                        {"warnings", motion.warnings}, {"notes", motion.notes}};
          },
          [](const Motion& motion, const Json& value, bool terse) {
            return motion_table(motion) + (terse ? value["directory"].get<std::string>() + "\n" : "");
          }};
}

}  // namespace touchfield
