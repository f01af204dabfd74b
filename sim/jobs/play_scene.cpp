#include "sim/jobs/play_scene.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <functional>

#include <fmt/format.h>

#include "sim/jobs/run_model.h"
#include "sim/jobs/sensed_motion.h"
#include "sim/model/stages.h"
#include "sim/pictures/motion_picture.h"
#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "sim/run/vtk_files.h"

namespace touchfield {

namespace {

constexpr double kSeriesHz = 20;  // at most, about
constexpr int kStripPictures = 6;

int scores_of(const MotionSpec& motion) { return static_cast<int>(std::ceil(motion.seconds * motion.score_hz)); }

/// Every how many scores the skin is written.
int series_step(const MotionSpec& motion) {
  return std::max(1, static_cast<int>(std::ceil(motion.score_hz / kSeriesHz)));
}

bool is_evaluated(const SensedMotion& sensed) {
  return sensed.truth && sensed.scene.evaluation.kind != EvaluationSpec::Kind::kNone;
}

/// Of its pictures: none without scores.
std::optional<PictureFormat> format_of(const SensedMotion& sensed, std::optional<PictureFormat> asked) {
  return sensed.truth ? picture_format(sensed.truth->first().fixed->scene, asked) : std::nullopt;
}

/// The scores whose skin is drawn, evenly over the motion.
std::vector<int> strip_scores(const MotionSpec& motion) {
  std::vector<int> numbers;
  const int count = scores_of(motion);
  for (int i = 0; i < kStripPictures; ++i) {
    const int number = static_cast<int>((i + 0.5) * count / kStripPictures);
    if (numbers.empty() || numbers.back() < number) {
      numbers.push_back(number);
    }
  }
  return numbers;
}

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

}  // namespace

std::vector<std::string> motion_files(const SensedMotion& sensed, std::optional<PictureFormat> asked) {
  const Scene& scene = sensed.scene;
  std::vector<std::string> files = {"play.log", "failed.json", "motion.csv", "frames.csv"};
  if (scene.write.h5) {
    files.emplace_back("motion.h5");
  }
  if (scene.write.vtp && is_evaluated(sensed)) {
    files.insert(files.end(), {"array.vtp", "evaluation.pvd"});
    for (int i = 0; i * series_step(*scene.motion) < scores_of(*scene.motion); ++i) {
      files.push_back(fmt::format("evaluation_{:04d}.vtp", i + 1));
    }
  }
  if (const auto format = format_of(sensed, asked)) {
    files.insert(files.end(), {"motion." + to_string(*format), "strip." + to_string(*format)});
  }
  return files;
}

Motion play_scene(const SensedMotion& sensed, MotionOptions options, RunDirectory& directory, Progress& progress,
                  std::optional<PictureFormat> pictures) {
  const Scene& scene = sensed.scene;
  const std::vector<int> drawn = strip_scores(*scene.motion);
  const auto format = format_of(sensed, pictures);
  std::vector<MotionInstant> strip;
  std::vector<MotionInstant> waiting;  // for the next second, when the motion that they are of is there too
  std::vector<SeriesStep> series;
  int number = 0;
  options.scored = [&](const MotionInstant& instant) {
    if (format && std::ranges::binary_search(drawn, number)) {
      strip.push_back(instant);
    }
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
  for (const MethodSpec& method : scene.solve.methods) {
    methods.push_back(method.name);
  }
  directory.plan(methods);
  Motion motion = play_motion(sensed, options, progress);
  for (const std::string& method : methods) {
    directory.finished(method);
  }
  if (format) {
    timed(progress, motion.timings, "pictures", "draw pictures", [&] {
      const std::string ending = to_string(*format);
      draw_motion(directory.file("motion." + ending), motion, *format);
      if (!strip.empty()) {
        draw_motion_strip(directory.file("strip." + ending), motion, strip, *format);
      }
    });
  }
  return motion;
}

}  // namespace touchfield
