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

constexpr const char* kVisits = "Periods per second [Hz].";

Codec<PatternPlace> pattern_place_codec() {
  const auto landmark = kept_as<PatternPlace, std::string>(
      text(1), [](const Input&, const std::string& name) { return std::optional<PatternPlace>(name); },
      [](const PatternPlace& place) { return std::get<std::string>(place); });
  const auto point = kept_as<PatternPlace, Vector3>(
      vector3(kMillimetres, {}), [](const Input&, const Vector3& at) { return std::optional<PatternPlace>(at); },
      [](const PatternPlace& place) { return std::get<Vector3>(place); });
  return either<PatternPlace>(point, landmark,
                              [](const PatternPlace& place) { return std::holds_alternative<Vector3>(place); });
}

Codec<CirclePath> circle_codec() {
  return Map<CirclePath>()
      .required("at", &CirclePath::at, pattern_place_codec(), "index_pad",
                "Centre: a landmark, or a point of the world [mm]. The circle is in the plane that touches the skin "
                "there and starts in the direction of the world's x axis.")
      .key("radius_mm", &CirclePath::radius, number(kMillimetres, above_to(0, 200)), "Radius of the circle [mm].")
      .key("hz", &CirclePath::hz, number(kPlain, kRate), kVisits)
      .codec();
}

Codec<LinePath> line_codec() {
  return Map<LinePath>()
      .required("from", &LinePath::from, pattern_place_codec(), "[-4, 0, 200]", "Start: a landmark, or a point [mm].")
      .required("to", &LinePath::to, pattern_place_codec(), "[4, 0, 200]", "Turning point, likewise.")
      .key("hz", &LinePath::hz, number(kPlain, kRate), kVisits)
      .codec();
}

Codec<PointsPath> points_codec() {
  return Map<PointsPath>()
      .required("at", &PointsPath::at, list_of(pattern_place_codec(), 2, kMostItems), "[index_pad, middle_pad]",
                "Landmarks, or points [mm], in their order.")
      .key("hz", &PointsPath::hz, number(kPlain, kRate), kVisits)
      .codec();
}

Codec<PatternSpec::Amplitude> amplitude_codec() {
  using Amplitude = PatternSpec::Amplitude;
  return Map<Amplitude>()
      .key("hz", &Amplitude::hz, number(kPlain, kRate), "Frequency of the sine [Hz].")
      .key("depth", &Amplitude::depth, number(kPlain, above_to(0, 1)),
           "Depth: the pressure falls to 1 - depth of its largest value.")
      .codec();
}

/// Whether the landmarks of a path are those of the bodies.
bool check_places(const Input& pattern, const PatternSpec& spec, const std::vector<std::string>& names) {
  const auto check = [&](const Input& at, const PatternPlace& place) {
    const auto* name = std::get_if<std::string>(&place);
    return name == nullptr || check_landmark(at, names, *name);
  };
  bool good = true;
  if (const auto* circle = std::get_if<CirclePath>(&spec.path)) {
    good = check(pattern.key("circle").key("at"), circle->at);
  } else if (const auto* line = std::get_if<LinePath>(&spec.path)) {
    good = check(pattern.key("line").key("from"), line->from);
    good = check(pattern.key("line").key("to"), line->to) && good;
  } else if (const auto* points = std::get_if<PointsPath>(&spec.path)) {
    for (std::size_t i = 0; i < points->at.size(); ++i) {
      good = check(pattern.key("points").key("at").at(i), points->at[i]) && good;
    }
  }
  for (std::size_t i = 0; i < spec.watch.size(); ++i) {
    good = check_landmark(pattern.key("watch").at(i), names, spec.watch[i]) && good;
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

Codec<PatternSpec> pattern_codec() {
  return Map<PatternSpec>()
      .maybe("circle", &PatternSpec::path, circle_codec(), "", "A spot that moves round a circle.")
      .maybe("line", &PatternSpec::path, line_codec(), "", "A spot that moves to and fro at constant speed.")
      .maybe("points", &PatternSpec::path, points_codec(), "", "A spot at several places in turn.")
      .maybe("amplitude", &PatternSpec::amplitude, amplitude_codec(), "",
             "Amplitude modulation by a sine. Without circle, line and points it modulates the scene's target.")
      .key("method", &PatternSpec::method,
           choice<const PhaseMethod*>(
               {{"surface", &phase_method("surface")}, {"radiation", &phase_method("radiation")}}),
           "The method of all frames. radiation: the phases for radiation pressure.")
      .key("diameter_mm", &PatternSpec::diameter, number(kMillimetres, above_to(0, 200)),
           "Diameter of the spot on the skin [mm].")
      .key("frames_per_second", &PatternSpec::frames_hz, number(kPlain, kRate), "Frames per second.")
      .key("seconds", &PatternSpec::seconds, number_or("auto", number(kPlain, above_to(0, 3600))),
           "Duration [s], after which the pattern repeats. auto: the shortest time of whole periods and whole frames.")
      .key("most_turn_deg", &PatternSpec::most_turn, number_or("none", number(kDegrees, above_to(0, 180))),
           "Largest change of any phase from one frame to the next, and from the last to the first [deg].")
      .key("iterations", &PatternSpec::iterations, integer(between(1, 100'000)),
           "Iterations of each frame after the first.")
      .maybe("pressure_pa", &PatternSpec::pressure, number(kPlain, above(0)), "3000",
             "Wanted pressure amplitude [Pa]; default: that of the target.")
      .key("watch", &PatternSpec::watch, list_of<std::string>(text(1), 0, kMostItems),
           "Landmarks at which the pressure over time is written, beside points of the pattern itself.")
      .shown_as("[index_tip]")
      .key("ring_up_ms", &PatternSpec::ring_up, number_or("none", number(kMilliseconds, above_to(0, 1000))),
           "Time constant of the transducers [ms]; the errors with it are written beside the others.")
      .at_most_one({"circle", "line", "points"})
      .check([](const Input& in, PatternSpec& spec, bool good) {
        return !good || !std::holds_alternative<std::monostate>(spec.path) || spec.amplitude ||
               in.problem("must have one of circle, line, points, amplitude");
      })
      .codec();
}

bool check_pattern(const Input& in, const Scene& scene) {
  if (!scene.pattern) {
    return true;
  }
  const Input pattern = in.key("pattern");
  bool good = true;
  if (!scene.target) {
    good = pattern.problem("needs a target, near which the mesh is fine; the scene must have one");
  } else if (!scene.pattern->pressure && !scene.target->pressure) {
    good = pattern.problem("must have pressure_pa, because target.pressure_pa is best");
  }
  std::vector<std::string> names = landmark_names(scene.bodies);
  for (const BodySpec& body : scene.bodies) {
    for (const std::string& landmark : landmark_names(body)) {
      if (!body.name.empty()) {
        names.push_back(body.name + "." + landmark);
      }
    }
  }
  return check_places(pattern, *scene.pattern, names) && good;
}

}  // namespace touchfield::schema
