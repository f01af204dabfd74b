#include "sim/scene/scene_table.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/format.h>

#include "sim/scene/number_files.h"
#include "sim/scene/schema_info.h"

namespace touchfield::schema {

namespace {

struct FieldForm {
  std::string name;
  std::optional<std::string> plane;
  std::optional<Vector3> through;
  std::optional<Vector3> centre;
  std::optional<Vector3> at;
  std::vector<double> size;
  double spacing = FieldSpec{}.spacing;
};

int axis_number(char axis) { return axis - 'x'; }

std::optional<FieldSpec> to_field(const Input& in, const FieldForm& form) {
  FieldSpec field{.name = form.name, .plane = form.plane.value_or(""), .spacing = form.spacing};
  if (form.at) {
    field.centre = *form.at;
    return field;
  }
  field.centre = form.plane ? form.through.value_or(Vector3::Zero()) : form.centre.value_or(Vector3::Zero());
  const std::string axes = form.plane.value_or("xyz");
  for (std::size_t i = 0; i < axes.size(); ++i) {
    field.size[axis_number(axes[i])] = form.size[i];
  }

  // As many points as the field's grid gets: at most `spacing` apart.
  constexpr double kMostPoints = 20e6;
  double count = 1;
  for (const double extent : field.size) {
    count *= std::max(0.0, std::ceil(extent / field.spacing - 1e-9)) + 1;
  }
  if (count > kMostPoints) {
    in.problem(fmt::format("{:.0f} points, must be at most {:.0f}", count, kMostPoints));
    return std::nullopt;
  }
  return field;
}

FieldForm to_form(const FieldSpec& field) {
  FieldForm form;
  form.name = field.name;
  form.spacing = field.spacing;
  if (field.size.isZero()) {
    form.at = field.centre;
    return form;
  }
  (field.plane.empty() ? form.centre : form.through) = field.centre;
  if (!field.plane.empty()) {
    form.plane = field.plane;
  }
  for (const char axis : form.plane.value_or("xyz")) {
    form.size.push_back(field.size[axis_number(axis)]);
  }
  return form;
}

Codec<std::vector<FieldSpec>> fields_codec() {
  const auto form = Map<FieldForm>()
                        .required("name", &FieldForm::name, name(), "side", "Name of the field in the results.")
                        .maybe("plane", &FieldForm::plane, word({"xy", "xz", "yz"}), "xz", "Axes of the plane.")
                        .maybe("through_mm", &FieldForm::through, vector3(kMillimetres, {}), "[0, 0, 200]",
                               "Centre of the plane [mm].")
                        .needed_with({"plane"})
                        .maybe("centre_mm", &FieldForm::centre, vector3(kMillimetres, {}), "[0, 0, 200]",
                               "Centre of a box of points, instead of a plane [mm].")
                        .maybe("at_mm", &FieldForm::at, vector3(kMillimetres, {}), "[0, -300, 400]",
                               "One point, such as an ear, instead of a plane [mm]. The run prints the sound level "
                               "there.")
                        .required("size_mm", &FieldForm::size, list_of(number(kMillimetres, above(0)), 2, 3),
                                  "[120, 240]", "Extent along the plane's two axes, or along x, y and z [mm].")
                        .needed_with({"plane", "centre_mm"})
                        .items_with("plane", 2)
                        .items_with("centre_mm", 3)
                        .key("spacing_mm", &FieldForm::spacing, number(kMillimetres, above(0)),
                             "Largest distance between points [mm]. A field may have 20 million points.")
                        .allowed_with({"plane", "centre_mm"})
                        .exactly_one({"plane", "centre_mm", "at_mm"})
                        .codec();
  const auto field = kept_as<FieldSpec, FieldForm>(form, to_field, [](const FieldSpec& f) { return to_form(f); });
  return list_of<FieldSpec>(field, 0, kMostItems, {.name = [](const FieldSpec& f) { return f.name; }, .advice = ""});
}

Codec<MediumSpec> medium_codec() {
  return Map<MediumSpec>()
      .key("temperature_c", &MediumSpec::temperature, number(Unit::celsius(), between(-50, 60)),
           "Temperature of the air [C]; determines the speed of sound and the density.")
      .key("humidity_percent", &MediumSpec::humidity, number(Unit::power_of_ten(-2), between(0, 100)),
           "Relative humidity [%]; affects the absorption only.")
      .key("absorption", &MediumSpec::absorption, flag(), "Whether the air absorbs sound (ISO 9613-1).")
      .maybe("sound_speed_m_s", &MediumSpec::sound_speed, number(kPlain, above_to(0, 1e4)), "343.21",
             "Speed of sound [m/s], instead of the one from the temperature.")
      .maybe("density_kg_m3", &MediumSpec::density, number(kPlain, above_to(0, 1e4)), "1.2041",
             "Density [kg/m3], instead of the one from the temperature.")
      .codec();
}

/// The keys of a place of a target, kept in a Place, and what the pages call the place.
template <class Place>
Map<Place> place_keys(const std::string& what) {
  return Map<Place>()
      .maybe("at", &Place::at, text(1), "index_pad",
             fmt::format("Landmark of the placed body at {}; nearest_array: the point of the skin that is nearest to "
                         "the array. With several bodies write body.landmark, or landmark if only one body has it.",
                         what))
      .key("offset_mm", &Place::offset, vector3(kMillimetres, {}),
           fmt::format("Offset of {} from the landmark, along the world's axes [mm].", what))
      .allowed_with({"at"})
      .maybe("centre_mm", &Place::centre, vector3(kMillimetres, {}), "[0, 0, 200]",
             fmt::format("Position of {} in the world [mm], instead of a landmark.", what))
      .exactly_one({"at", "centre_mm"});
}

template <class Part>
Codec<Part> with_level(Map<Part>& map) {
  return map
      .key("level", &Part::level, number(kPlain, above_to(0, 1)),
           "Pressure wanted here, as a share of target.pressure_pa or target.radiation_pa.")
      .codec();
}

Codec<TargetBoxSpec> target_box_codec() {
  return with_level(place_keys<TargetBoxSpec>("the centre of the box")
                        .required("size_mm", &TargetBoxSpec::size, vector3(kMillimetres, above(0)), "[8, 40, 6]",
                                  "Side lengths of the box [mm]: width, length, depth.")
                        .key("rotate_deg", &TargetBoxSpec::angles, vector3(kDegrees, {}),
                             "Rotation of the box about its centre: about the world's x, then y, then z axis [deg]."));
}

Codec<TargetPointSpec> target_point_codec() {
  return with_level(place_keys<TargetPointSpec>("the point")
                        .required("diameter_mm", &TargetPointSpec::diameter, number(kMillimetres, above(0)), "8",
                                  "Diameter of the disc [mm]."));
}

Codec<TargetLineSpec> target_line_codec() {
  return with_level(
      Map<TargetLineSpec>()
          .required("points", &TargetLineSpec::points,
                    list_of(place_keys<TargetPlace>("the point").codec(), 2, kMostItems),
                    "[{at: index_pad}, {at: middle_pad}]",
                    "Two or more points. The line goes along the skin nearest to the straight lines between them, and "
                    "is closed if the last point is the first.")
          .required("width_mm", &TargetLineSpec::width, number(kMillimetres, above(0)), "6",
                    "Width of the line [mm]."));
}

Codec<TargetMaskSpec> target_mask_codec() {
  return kept_as<TargetMaskSpec, std::string>(
      absolute_file(),
      [](const Input& in, const std::string& path) {
        return read_named(in, [&] { return TargetMaskSpec{path, read_levels(path)}; });
      },
      [](const TargetMaskSpec& mask) { return mask.file; });
}

bool check_target(const Input& in, const TargetSpec& target, bool good) {
  const bool drawn = !target.points.empty() || !target.lines.empty() || target.mask;
  if (good && !drawn && target.boxes.empty()) {
    return in.problem("none of box, boxes, points, lines, mask_file given, must be one or more");
  }
  if (good && drawn && target.profile == TargetProfile::kPenetration) {
    return in.key("profile").problem(
        "penetration is of boxes alone; leave points, lines and mask_file out, or write uniform");
  }
  const Entry* amplitude = in.node().find("pressure_pa");
  const Entry* radiation = in.node().find("radiation_pa");
  if (amplitude != nullptr && radiation != nullptr) {
    const bool amplitude_first = amplitude->place.source <= radiation->place.source;
    const auto& [first, second] = amplitude_first ? std::pair(amplitude, radiation) : std::pair(radiation, amplitude);
    in.reading().add(second->place,
                     fmt::format("{0}: cannot be given with {1}; take that away, in changes of a scene by "
                                 "target.{1}: null or --set target.{1}=null",
                                 in.path_of(second->key), first->key));
    return false;
  }
  return good;
}

/// The wanted radiation pressure, kept in the member of the amplitude.
Map<TargetSpec>& add_radiation(Map<TargetSpec>& map) {
  const Codec<double> codec = number(kPlain, above(0));
  return map.add(
      {.name = "radiation_pa",
       .type = codec.type,
       .help =
           "Wanted radiation pressure P [Pa], the largest one of a profile, instead of pressure_pa. Levels and depths "
           "are then shares of P. Methods get the amplitude p with P = p^2 / (4 rho c^2), in the air of the scene.",
       .example = "30"},
      [codec](const Input& in, TargetSpec& target) {
        target.quantity = TargetQuantity::kRadiation;
        return codec.read(in, target.pressure.emplace());
      },
      [codec](const TargetSpec& target) {
        return target.quantity == TargetQuantity::kRadiation ? std::optional<Node>(codec.write(*target.pressure))
                                                             : std::nullopt;
      });
}

Codec<TargetSpec> target_codec() {
  const auto box = target_box_codec();
  Map<TargetSpec> map =
      Map<TargetSpec>()
          .maybe("box", &TargetSpec::boxes, box, "",
                 "The target: the faces of the skin with their centroid in this box.")
          .maybe("boxes", &TargetSpec::boxes, list_of(box, 1, kMostItems), "", "Several boxes, instead of one.")
          .written_if([](const TargetSpec& target) { return !target.boxes.empty(); })
          .maybe(
              "points", &TargetSpec::points, list_of(target_point_codec(), 1, kMostItems), "",
              "Round discs on the skin, each about the point of the skin that is nearest to a place. Boxes, points, "
              "lines and a mask may be given together; a face in several of them belongs to the first, in this order.")
          .written_if([](const TargetSpec& target) { return !target.points.empty(); })
          .maybe(
              "lines", &TargetSpec::lines, list_of(target_line_codec(), 1, kMostItems), "",
              "Lines and paths on the skin. Their metrics have the width across the first piece, if nothing is given "
              "before it.")
          .written_if([](const TargetSpec& target) { return !target.lines.empty(); })
          .maybe("mask_file", &TargetSpec::mask, target_mask_codec(), "mask.txt",
                 "A text file of one number per face of the body's mesh file, in the order of its faces: the pressure "
                 "wanted "
                 "there as a share of target.pressure_pa or target.radiation_pa, 0 to 1. The numbers are separated by "
                 "commas or white space; # "
                 "starts a comment. A relative name starts from the scene's folder.")
          .key("profile", &TargetSpec::profile,
               choice<TargetProfile>(
                   {{"uniform", TargetProfile::kUniform}, {"penetration", TargetProfile::kPenetration}}),
               "Wanted pressure on the faces: the same on each, or proportional to the depth below the side of the box "
               "through which the skin enters.")
          .key("pressure_pa", &TargetSpec::pressure, number_or("best", number(kPlain, above(0))),
               "Wanted pressure amplitude [Pa], the largest one of a profile. best: the strongest that the array "
               "reaches "
               "with the smallest error.")
          .written_if([](const TargetSpec& target) { return target.quantity == TargetQuantity::kPressure; });
  return add_radiation(map)
      .at_most_one({"box", "boxes"})
      .check([](const Input& in, TargetSpec& target, bool good) { return check_target(in, target, good); })
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

void fill_hand_edges(Scene& scene) {
  for (BodySpec& body : scene.bodies) {
    if (std::holds_alternative<HandShape>(body.shape) && !body.edge) {
      body.edge = UsualHandEdges::of_scene(scene.target.has_value());
    }
  }
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
    good = in.key("write").problem("transfer needs a target, the scene must have one");
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
    good = list.at(i).problem(fmt::format("{} needs a target, the scene must have one", method));
  }
  return good;
}

bool check_tolerances(const Input& in, const Scene& scene) {
  bool good = true;
  for (const MethodSpec& method : scene.solve.methods) {
    if (method.tolerances && (method.free_amplitudes || scene.motion)) {
      good = in.key("solve").problem(
          fmt::format("methods: {} has tolerances, {}", method.name,
                      scene.motion ? "which are for stills: leave them out, or motion"
                                   : "for which all amplitudes are one: leave out free_amplitudes or tolerances"));
    }
  }
  return good;
}

Codec<Scene> make_scene_codec() {
  return Map<Scene>()
      .required("name", &Scene::name, name(), "my_scene", "Name of the run's folder.")
      .key("medium", &Scene::medium, medium_codec(), "The air.")
      .key("frequency_khz", &Scene::frequency,
           number(Unit::power_of_ten(3), between(kLeastFrequency / 1e3, kMostFrequency / 1e3)),
           "Frequency of the ultrasound [kHz].")
      .required("array", &Scene::array, array_codec(), "", "The transducers.")
      .maybe("body", &Scene::bodies, body_codec(), "", "The body that scatters the sound; its skin is sound-hard.")
      .written_if([](const Scene& scene) { return scene.bodies.size() == 1 && scene.bodies.front().name.empty(); })
      .maybe("bodies", &Scene::bodies, bodies_codec(), "", "Several bodies, each with a name; they must not touch.")
      .exactly_one({"body", "bodies"})
      .maybe("sensing", &Scene::sensing, sensing_codec(), "",
             "Bodies as the solver sees them, with the errors of a sensor: displaced by smooth noise and moved. The "
             "evaluation uses the true bodies.")
      .maybe("target", &Scene::target, target_codec(), "",
             "The part of the skin to press on. Every method except fixed needs one.")
      .required("solve", &Scene::solve, solve_codec(), "", "The search for the phases.")
      .key("evaluation", &Scene::evaluation, evaluation_codec(),
           "The evaluation mesh. same: the model that was solved. none: no evaluation. A map: a model of its own. "
           "auto: same, if it has whole bodies with edges of at most 0.35 wavelengths; otherwise a new mesh of the "
           "whole bodies.")
      .key("field", &Scene::fields, fields_codec(),
           "Planes, boxes of points and single points in the air where the pressure is computed.")
      .key("write", &Scene::write, write_codec(),
           "Files to write: results (h5), surfaces (vtp) and fields (vti) for ParaView, pictures (png). With transfer "
           "the results also hold the transfer matrix.")
      .maybe("motion", &Scene::motion, motion_codec(), "",
             "The motion of the scene, and the loop of sensor, solver and array during it. The rest of the scene is a "
             "still; a run computes only the still.")
      .maybe("pattern", &Scene::pattern, pattern_codec(), "",
             "A pattern that repeats on the still hand, for `touchfield pattern`.")
      .maybe("felt", &Scene::felt, felt_codec(), "",
             "What the skin does under the radiation pressure: `run` and `pattern` then also write what `touchfield "
             "felt` does.")
      .check([](const Input& in, Scene& scene, bool good) {
        fill_hand_edges(scene);
        const bool good_targets = check_targets(in, scene);
        const bool good_motion = !good || (check_motion(in, scene) && check_pattern(in, scene));
        if (good && scene.felt && !scene.felt->at && !scene.target) {
          good = in.key("felt").problem("needs a target or at_mm, the place on the skin that is computed");
        }
        const bool good_landmarks = !good || check_box_landmarks(in, scene.bodies);
        const bool good_tolerances = check_tolerances(in, scene);
        return check_evaluation(in, scene) && good_tolerances && good_targets && good_motion && good_landmarks;
      })
      .codec();
}

}  // namespace

Codec<SensingNoise> sensing_codec() {
  return Map<SensingNoise>()
      .key("noise_mm_rms", &SensingNoise::rms, number(kMillimetres, between(0, 3)),
           "Displacement along the normal of the skin, root mean square [mm].")
      .shown_as("0.5")
      .key("correlation_mm", &SensingNoise::correlation, number(kMillimetres, between(1, 100)),
           "Correlation length of the displacement [mm].")
      .key("offset_mm", &SensingNoise::offset, vector3(kMillimetres, between(-100, 100)),
           "Displacement of the bodies as a whole [mm].")
      .key("seed", &SensingNoise::seed, seed(), "Seed of the noise.")
      .codec();
}

Codec<std::optional<double>> number_or(const std::string& none, const Codec<double>& number) {
  using Number = std::optional<double>;
  const auto given = kept_as<Number, double>(
      number, [](const Input&, const double& value) { return std::optional<Number>(value); },
      [](const Number& value) { return *value; });
  return either<Number>(given, choice<Number>({{none, std::nullopt}}),
                        [](const Number& value) { return value.has_value(); });
}

const Codec<Scene>& scene_codec() {
  static const Codec<Scene> codec = make_scene_codec();
  return codec;
}

}  // namespace touchfield::schema
