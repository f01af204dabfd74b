#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

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

Codec<PatternSpec> pattern_codec() {
  return Map<PatternSpec>()
      .maybe("circle", &PatternSpec::path, circle_codec(), "", "A spot that moves round a circle.")
      .maybe("line", &PatternSpec::path, line_codec(), "", "A spot that moves to and fro at constant speed.")
      .maybe("points", &PatternSpec::path, points_codec(), "", "A spot at several places in turn.")
      .maybe("amplitude", &PatternSpec::amplitude, amplitude_codec(), "",
             "Amplitude modulation by a sine. Without circle, line and points it modulates the scene's target.")
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
             "Wanted pressure amplitude [Pa]; default: target.pressure_pa.")
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
