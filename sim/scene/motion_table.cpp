#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/varying_number.h"

namespace touchfield::schema {

namespace {

constexpr double kLongest = 3600;  // of a motion [s]

Codec<std::string> path_codec() {
  return kept_as<std::string, std::string>(
      text(1),
      [](const Input& in, const std::string& path) -> std::optional<std::string> {
        try {
          return varying_number(path).path;
        } catch (const InputError& error) {
          in.problem(fmt::format("{} {}", quoted_for_message(path), error.what()));
          return std::nullopt;
        }
      },
      [](const std::string& path) { return path; });
}

Codec<SineLaw> sine_codec() {
  return Map<SineLaw>()
      .required("amplitude", &SineLaw::amplitude, number(kPlain, {}), "10", "Amplitude, in the unit of the path.")
      .required("hz", &SineLaw::hz, number(kPlain, kRate), "1", "Frequency [Hz].")
      .key("phase_deg", &SineLaw::phase, number(kDegrees, {}), "Phase at the start; 90: from the highest point [deg].")
      .maybe("about", &SineLaw::about, number(kPlain, {}), "200",
             "Mean value, in the unit of the path; default: the scene's own.")
      .codec();
}

Codec<KeysLaw> keys_codec() {
  const auto key = tuple_of<double, 2>(number(kPlain, {}));
  return kept_as<KeysLaw, std::vector<std::array<double, 2>>>(
      list_of(key, 1, kMostListed),
      [](const Input& in, const std::vector<std::array<double, 2>>& keys) -> std::optional<KeysLaw> {
        bool good = true;
        for (std::size_t i = 0; i < keys.size(); ++i) {
          if (keys[i][0] < 0.0) {
            good = in.at(i).at(0).must_be(">= 0");
          } else if (i > 0 && keys[i][0] <= keys[i - 1][0]) {
            good = in.at(i).at(0).must_be(fmt::format("after {:.15g}, the time of the key before it", keys[i - 1][0]));
          }
        }
        return good ? std::optional(KeysLaw{keys}) : std::nullopt;
      },
      [](const KeysLaw& law) { return law.keys; });
}

Codec<MotionChange> change_codec() {
  return Map<MotionChange>()
      .required("path", &MotionChange::path, path_codec(), "body.place.at_mm.2",
                fmt::format("The number that changes, with its name in sweeps: {}. A path with brackets, at_mm[2], "
                            "must be quoted between braces.",
                            varying_paths()))
      .maybe("sine", &MotionChange::law, sine_codec(), "", "A sine about a mean value.")
      .maybe("keys", &MotionChange::law, keys_codec(), "[[0, 190], [0.5, 210], [1, 190]]",
             "A curve through points [time in s, value in the unit of the path], monotone in between (piecewise "
             "cubic). It is constant before the first and after the last point.")
      .maybe("rate", &MotionChange::law, kept_in(&RateLaw::rate, number(kPlain, {})), "50",
             "Growth per second from the scene's own value, in the unit of the path.")
      .exactly_one({"sine", "keys", "rate"})
      .codec();
}

Codec<MotionSpec::Frame> frame_codec() {
  return Map<MotionSpec::Frame>()
      .required("budget_ms", &MotionSpec::Frame::budget, number(kMilliseconds, above_to(0, 60'000)), "50",
                "Longest time of a frame on this machine [ms].")
      .codec();
}

bool check_key_times(const Input& in, const MotionSpec& motion) {
  bool good = true;
  for (std::size_t i = 0; i < motion.changes.size(); ++i) {
    const auto* through = std::get_if<KeysLaw>(&motion.changes[i].law);
    if (through == nullptr || through->keys.back()[0] <= motion.seconds) {
      continue;
    }
    const Input change = in.key("change").at(i);
    const Input keys = change.key("keys");
    good = keys.at(through->keys.size() - 1)
               .at(0)
               .must_be(fmt::format("at most motion.seconds = {:.15g}", motion.seconds));
  }
  return good;
}

}  // namespace

Codec<MotionSpec> motion_codec() {
  using Target = MotionSpec::Target;
  using Start = MotionSpec::Start;
  using Prediction = MotionSpec::Prediction;
  return Map<MotionSpec>()
      .required("seconds", &MotionSpec::seconds, number(kPlain, above_to(0, kLongest)), "2",
                "Duration of the motion [s].")
      .key("change", &MotionSpec::changes,
           list_of<MotionChange>(change_codec(), 0, kMostItems,
                                 {.name = [](const MotionChange& change) { return change.path; }, .advice = ""}),
           "Numbers of the scene that vary, each by its own law.")
      .key("target", &MotionSpec::target,
           choice<Target>({{"on_skin", Target::kOnSkin}, {"in_world", Target::kInWorld}}),
           "Whether a target box on a landmark moves with it, or stays at its first place while the skin moves through "
           "it. A box with centre_mm stays.")
      .key("frames_hz", &MotionSpec::frames_hz, number(kPlain, kRate),
           "Frames per second, as far as the solver keeps up.")
      .key("iterations", &MotionSpec::iterations, integer(between(1, 100'000)),
           "Iterations per frame of an iterative method, instead of solve.iterations.")
      .key("start", &MotionSpec::start, choice<Start>({{"previous", Start::kPrevious}, {"zero", Start::kZero}}),
           "First phases of a frame: those of the previous frame, or zero.")
      .key("steer", &MotionSpec::steer, flag(),
           "Whether the phases of the previous frame are first steered to the new place of the target.")
      .maybe(
          "frame", &MotionSpec::frame, frame_codec(), "",
          "Chooses body.edge_mm, solve.scheme and iterations for the longest time of a frame, by trials at the start.")
      .key("sensor", &MotionSpec::sensor, sensor_codec(), "The sensor: how the solver sees the motion.")
      .key("solve_ms", &MotionSpec::solve, number_or("measured", number(kMilliseconds, kDelay)),
           "Time to solve a frame [ms]. measured: the time of this machine; results are then not reproducible.")
      .key("array_ms", &MotionSpec::array_delay, number(kMilliseconds, kDelay),
           "Delay from the phases of a frame until the array emits them [ms].")
      .key("predict", &MotionSpec::predict,
           choice<Prediction>(
               {{"none", Prediction::kNone}, {"linear", Prediction::kLinear}, {"kalman", Prediction::kKalman}}),
           "Pose for which a frame is solved. none: the last known pose. linear, kalman: the pose predicted for the "
           "middle of the time in which the frame is emitted. linear uses a straight line through the last two "
           "samples, kalman uses Kalman filters, which suit sensors with noise.")
      .key("score_hz", &MotionSpec::score_hz, number(kPlain, kRate),
           "Scores per second: the emitted phases are evaluated on the true pose.")
      .key("stale_ms", &MotionSpec::stale, number(kMilliseconds, above_to(0, 60'000)),
           "For `touchfield live`: the array is silent while the sample of its phases is older than this [ms].")
      .check([](const Input& in, MotionSpec& motion, bool good) { return good && check_key_times(in, motion); })
      .codec();
}

bool check_motion(const Input& in, const Scene& scene) {
  if (!scene.motion) {
    return true;
  }
  const Input motion = in.key("motion");
  Scene still = scene;
  bool good = true;
  for (std::size_t i = 0; i < scene.motion->changes.size(); ++i) {
    const MotionChange& change = scene.motion->changes[i];
    try {
      motion_curve(varying_number(change.path), change.law, scene.motion->seconds, still);
    } catch (const InputError& error) {
      good = motion.key("change").at(i).problem(error.what());
    }
  }
  return good;
}

}  // namespace touchfield::schema
