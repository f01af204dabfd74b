#include "sim/scene/scene_table.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/scene/suggest.h"

namespace touchfield::schema {

namespace {

Codec<MediumSpec> medium_codec() {
  return Map<MediumSpec>()
      .key("temperature_c", &MediumSpec::temperature, number(Unit::celsius(), between(-50, 60)),
           "Temperature of the air [C]: gives the speed of sound and the density.")
      .key("humidity_percent", &MediumSpec::humidity, number(Unit::power_of_ten(-2), between(0, 100)),
           "Relative humidity [%]: enters the absorption only.")
      .key("absorption", &MediumSpec::absorption, flag(), "Whether the air absorbs sound (ISO 9613-1).")
      .maybe("sound_speed_m_s", &MediumSpec::sound_speed, number(kPlain, above_to(0, 1e4)), "343.21",
             "Speed of sound [m/s] instead of the temperature's.")
      .maybe("density_kg_m3", &MediumSpec::density, number(kPlain, above_to(0, 1e4)), "1.2041",
             "Density [kg/m3] instead of the temperature's.")
      .codec();
}

Codec<TargetBoxSpec> target_box_codec() {
  using Box = TargetBoxSpec;
  const auto coordinate = vector3(kMillimetres, {});
  const auto write_if = [coordinate](bool given, const Vector3& value) {
    return given ? std::optional<Node>(coordinate.write(value)) : std::nullopt;
  };
  const auto landmark = text(1);
  return Map<Box>()
      .add(
          {.name = "at",
           .type = landmark.type,
           .help = "The landmark of the placed body that the box is centred on; nearest_array: the point of the skin "
                   "that is "
                   "nearest to the array. Of several bodies body.landmark, or landmark if only one has it.",
           .example = "index_pad"},
          [landmark](const Input& in, Box& box) { return landmark.read(in, box.at); },
          [landmark](const Box& box) {
            return box.at.empty() ? std::nullopt : std::optional<Node>(landmark.write(box.at));
          })
      .add(
          {.name = "offset_mm",
           .type = coordinate.type,
           .help = "From the landmark to the centre of the box, along the world's axes [mm].",
           .fallback = "[0, 0, 0]"},
          [coordinate](const Input& in, Box& box) { return coordinate.read(in, box.offset); },
          [write_if](const Box& box) { return write_if(!box.at.empty(), box.offset); })
      .allowed_with({"at"})
      .add(
          {.name = "centre_mm",
           .type = coordinate.type,
           .help = "Centre of the box in the world's frame [mm].",
           .example = "[0, 0, 200]"},
          [coordinate](const Input& in, Box& box) { return coordinate.read(in, box.centre); },
          [write_if](const Box& box) { return write_if(box.at.empty(), box.centre); })
      .required("size_mm", &Box::size, vector3(kMillimetres, above(0)), "[8, 40, 6]",
                "Side lengths of the box [mm]: its width, its length, its depth.")
      .key("rotate_deg", &Box::angles, vector3(kDegrees, {}),
           "Rotation of the box about its centre: about the world's x, then y, then z axis [deg].")
      .exactly_one({"at", "centre_mm"})
      .codec();
}

Codec<TargetSpec> target_codec() {
  const auto box = target_box_codec();
  const auto boxes = list_of(box, 1, kMostItems);
  const auto pressure = number(kPlain, above(0));
  const auto best = word({"best"});
  const TypeInfo pressure_type{.kind = TypeInfo::Kind::kAny, .of = {pressure.type, best.type}};
  return Map<TargetSpec>()
      .add(
          {.name = "box", .type = box.type, .help = "Faces of the skin whose centroid is in this box are pressed on."},
          [box](const Input& in, TargetSpec& target) { return box.read(in, target.boxes.emplace_back()); },
          [box](const TargetSpec& target) {
            return target.boxes.size() == 1 ? std::optional<Node>(box.write(target.boxes.front())) : std::nullopt;
          })
      .add(
          {.name = "boxes", .type = boxes.type, .help = "Several boxes; a face in two belongs to the first."},
          [boxes](const Input& in, TargetSpec& target) { return boxes.read(in, target.boxes); },
          [boxes](const TargetSpec& target) {
            return target.boxes.size() == 1 ? std::nullopt : std::optional<Node>(boxes.write(target.boxes));
          })
      .key("profile", &TargetSpec::profile,
           choice<TargetProfile>({{"uniform", TargetProfile::kUniform}, {"penetration", TargetProfile::kPenetration}}),
           "Wanted pressure on the faces: the same on each, or in proportion to the depth below the side of the box "
           "through which the skin enters.")
      .add(
          {.name = "pressure_pa",
           .type = pressure_type,
           .help = "Wanted pressure amplitude [Pa], the largest of a profile; best: as strong as the array can at "
                   "the smallest error.",
           .fallback = "best"},
          [=](const Input& in, TargetSpec& target) {
            if (in.node().kind != Node::Kind::kScalar) {
              in.must_be(phrase(pressure_type));
              return false;
            }
            target.pressure.reset();
            if (in.node().text == "best") {
              return true;
            }
            if (in.node().quoted || !parse_decimal(in.node().text)) {
              in.must_be(phrase(pressure_type));
              return false;
            }
            return pressure.read(in, target.pressure.emplace());
          },
          [pressure](const TargetSpec& target) {
            return std::optional<Node>(target.pressure ? pressure.write(*target.pressure) : scalar("best"));
          })
      .exactly_one({"box", "boxes"})
      .codec();
}

Codec<WriteSpec> write_codec() {
  const std::vector<std::pair<std::string, bool WriteSpec::*>> kinds = {{"h5", &WriteSpec::h5},
                                                                        {"vtp", &WriteSpec::vtp},
                                                                        {"vti", &WriteSpec::vti},
                                                                        {"png", &WriteSpec::png},
                                                                        {"transfer", &WriteSpec::transfer}};
  std::vector<std::string> words;
  words.reserve(kinds.size());
  for (const auto& [text, member] : kinds) {
    words.push_back(text);
  }
  auto base = list_of<std::string>(word(words), 1, kinds.size(),
                                   {.name = [](const std::string& kind) { return kind; }, .advice = ""});
  base.type.distinct = true;
  return kept_as<WriteSpec, std::vector<std::string>>(
      base,
      [kinds](const Input&, const std::vector<std::string>& given) {
        WriteSpec write;
        for (const auto& [text, member] : kinds) {
          write.*member = std::find(given.begin(), given.end(), text) != given.end();
        }
        write.h5 = write.h5 || write.transfer;
        return std::optional(write);
      },
      [kinds](const WriteSpec& write) {
        std::vector<std::string> given;
        for (const auto& [text, member] : kinds) {
          if (write.*member) {
            given.push_back(text);
          }
        }
        return given;
      });
}

// The name of the method that an item of solve.methods holds, if it is well formed.
std::string method_of(const Node& item) {
  if (item.kind == Node::Kind::kScalar) {
    return item.text;
  }
  return item.kind == Node::Kind::kMap && item.entries.size() == 1 ? item.entries.front().key : "";
}

// Every method but `fixed` works towards a target, and the transfer matrix is that of its faces.
bool check_targets(const Input& in, const Scene& scene) {
  for (const auto& entry : in.node().entries) {  // a misspelt one has its own message
    if (!entry.value.removed && edit_distance(entry.key, "target") <= 2) {
      return true;
    }
  }
  bool good = true;
  if (scene.write.transfer) {
    in.at(*in.node().find("write")).problem("transfer needs a target, the scene must have one");
    good = false;
  }
  const Entry* solve = in.node().find("solve");
  const Entry* methods = solve ? solve->value.find("methods") : nullptr;
  if (!methods) {
    return good;
  }
  const Input list = in.at(*solve).at(*methods);
  for (std::size_t i = 0; i < methods->value.items.size(); ++i) {
    const std::string method = method_of(methods->value.items[i]);
    const auto known = std::ranges::find(phase_methods(), method, &PhaseMethod::name);
    if (known == phase_methods().end() || known->model == MethodModel::kGiven) {
      continue;
    }
    list.at(i).problem(fmt::format("{} needs a target, the scene must have one", method));
    good = false;
  }
  return good;
}

/// A scene with `body`, not `bodies`.
bool is_single(const Scene& scene) { return scene.bodies.size() == 1 && scene.bodies.front().name.empty(); }

Codec<SensingNoise> sensing_codec() {
  const auto seeded = seed();
  return Map<SensingNoise>()
      .key("noise_mm_rms", &SensingNoise::rms, number(kMillimetres, between(0, 3)),
           "Displacement along the normal of the skin, root mean square [mm].")
      .key("correlation_mm", &SensingNoise::correlation, number(kMillimetres, between(1, 100)),
           "Length over which it loses its correlation [mm].")
      .key("offset_mm", &SensingNoise::offset, vector3(kMillimetres, between(-100, 100)),
           "Of the bodies as a whole [mm].")
      .add(
          {.name = "seed", .type = seeded.type, .help = "Of the noise.", .fallback = "1"},
          [seeded](const Input& in, SensingNoise& noise) {
            unsigned value = 0;
            const bool good = seeded.read(in, value);
            noise.seed = value;
            return good;
          },
          [seeded](const SensingNoise& noise) {
            return std::optional<Node>(seeded.write(static_cast<unsigned>(noise.seed)));
          })
      .codec();
}

Codec<Scene> make_scene_codec() {
  const auto body = body_codec();
  const auto bodies = bodies_codec();
  return Map<Scene>()
      .required("name", &Scene::name, name(), "my_scene", "Names the run's folder.")
      .key("medium", &Scene::medium, medium_codec(), "The air.")
      .key("frequency_khz", &Scene::frequency, number(Unit::power_of_ten(3), between(1, 200)),
           "Frequency of the ultrasound [kHz].")
      .required("array", &Scene::array, array_codec(), "", "The transducers.")
      .add(
          {.name = "body", .type = body.type, .help = "What the sound is scattered by, a sound-hard skin."},
          [body](const Input& in, Scene& scene) { return body.read(in, scene.bodies.emplace_back()); },
          [body](const Scene& scene) {
            return is_single(scene) ? std::optional<Node>(body.write(scene.bodies.front())) : std::nullopt;
          })
      .add(
          {.name = "bodies", .type = bodies.type, .help = "Several bodies, each with a name; they must not touch."},
          [bodies](const Input& in, Scene& scene) { return bodies.read(in, scene.bodies); },
          [bodies](const Scene& scene) {
            return is_single(scene) ? std::nullopt : std::optional<Node>(bodies.write(scene.bodies));
          })
      .exactly_one({"body", "bodies"})
      .maybe("sensing", &Scene::sensing, sensing_codec(), "{noise_mm_rms: 0.5}",
             "What the solver sees of the bodies, as a sensor would: displaced by smooth noise and moved. The judge "
             "sees them as they are.")
      .maybe("target", &Scene::target, target_codec(), "",
             "Where on the skin to press. Every method but fixed needs one.")
      .required("solve", &Scene::solve, solve_codec(), "", "How the phases are found.")
      .key("judge", &Scene::judge, judge_codec(),
           "What computes the pressures that a result is judged by: the model that was solved, a model of its own, or "
           "nothing.")
      .key("field", &Scene::fields, fields_codec(), "Planes and boxes of points in the air to compute the pressure at.")
      .key("write", &Scene::write, write_codec(),
           "Files to write: results (h5), surfaces (vtp) and fields (vti) for ParaView, pictures (png); with transfer "
           "the results hold the transfer matrix too.")
      .check([](const Input& in, Scene& scene, bool /*good*/) {
        const bool good_targets = check_targets(in, scene);
        return check_judge(in, scene) && good_targets;
      })
      .codec();
}

}  // namespace

const Codec<Scene>& scene_codec() {
  static const Codec<Scene> codec = make_scene_codec();
  return codec;
}

}  // namespace touchfield::schema
