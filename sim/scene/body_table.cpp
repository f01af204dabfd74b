#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/hand/hand_flesh.h"
#include "sim/hand/implicit_surface.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/scene/number_files.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/schema_info.h"

namespace touchfield::schema {

namespace {

/// "one of top, bottom; did you mean top?", as it follows "must be".
std::string rule(const std::vector<std::string>& names, const std::string& name) {
  if (names.empty()) {
    return "a landmark of the body, which has none";
  }
  const std::string nearest = nearest_word(names, name);
  return fmt::format("one of {}{}", fmt::join(names, ", "),
                     nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest));
}

/// Sizes of a body [mm]: from a tenth of a hair to a room. Beyond is a slip of the unit.
const Range kBodySize = between(0.01, 10'000);
// Faces are as small as the radius: 150,000 of them, meshed in a second or two.
constexpr double kLongestCapsule = 10'000;

/// What a joint's angle is, and an example of it [deg].
struct JointHelp {
  const char* help;
  const char* example;
};

constexpr JointHelp kThumbHelp[] = {
    {"Angle of its base across the palm [deg].", "0"},
    {"Angle of its base out of the palm's plane [deg].", "30"},
    {"Rotation of its base about its own axis; at 80 the pad faces the fingertips [deg].", "20"},
    {"Flexion at the middle joint [deg].", "15"},
    {"Flexion at the last joint [deg].", "15"}};
constexpr JointHelp kFingerHelp[] = {
    {"Angle away from the middle finger; for the middle finger towards the thumb [deg].", "5"},
    {"Flexion at the knuckle [deg].", "30"},
    {"Flexion at the middle joint [deg].", "30"},
    {"Flexion at the last joint [deg].", "20"}};

Codec<HandJoints> digit_codec(std::size_t digit) {
  Map<HandJoints> map;
  for (Eigen::Index i = 0; i < joint_count(digit); ++i) {
    const Eigen::Index place = first_joint(digit) + i;
    const NamedJoint& joint = hand_joints()[static_cast<std::size_t>(place)];
    const auto& [help, example] = (digit == 0 ? kThumbHelp : kFingerHelp)[i];
    const auto angle = number(kDegrees, between(joint.least, joint.most));
    map.add(
        {.name = fmt::format("{}_deg", joint.name), .type = angle.type, .help = help, .example = example},
        [=](const Input& in, HandJoints& joints) { return angle.read(in, joint_in(joints, place).emplace()); },
        [=](const HandJoints& joints) {
          const auto& given = joint_in(joints, place);
          return given ? std::optional(angle.write(*given)) : std::nullopt;
        });
  }
  return map.codec();
}

Codec<HandJoints> joints_codec() {
  Map<HandJoints> map;
  for (std::size_t digit = 0; digit < 5; ++digit) {
    const auto codec = digit_codec(digit);
    map.add({.name = hand_joints()[static_cast<std::size_t>(first_joint(digit))].digit,
             .type = codec.type,
             .help = "Angles that differ from those of the pose.",
             .fallback = "{}"},
            codec.read, codec.write);
  }
  return map.codec();
}

Codec<SphereShape> sphere_codec() {
  return Map<SphereShape>()
      .required("radius_mm", &SphereShape::radius, number(kMillimetres, kBodySize), "8", "Radius [mm].")
      .codec();
}

Codec<CapsuleShape> capsule_codec() {
  return Map<CapsuleShape>()
      .required("radius_mm", &CapsuleShape::radius, number(kMillimetres, kBodySize), "8", "Radius [mm].")
      .required("length_mm", &CapsuleShape::length, number(kMillimetres, between(0, *kBodySize.high)), "60",
                "Length of the cylinder between the half spheres [mm], at most 10,000 radii.")
      .check([](const Input& in, CapsuleShape& capsule, bool good) {
        if (!good || capsule.length <= kLongestCapsule * capsule.radius) {
          return good;
        }
        return in.key("length_mm").must_be(fmt::format("at most {:.0f} times radius_mm", kLongestCapsule));
      })
      .codec();
}

Codec<BoxShape> box_codec() {
  return Map<BoxShape>()
      .required("size_mm", &BoxShape::size, vector3(kMillimetres, kBodySize), "[20, 60, 10]", "Side lengths [mm].")
      .codec();
}

Codec<std::map<std::string, Vector3>> landmarks_codec(const std::string& unit) {
  return table_of(vector3(Unit::power_of_ten(file_unit(unit).power), {}));
}

void set_unit(const std::string& name, MeshShape& mesh) {
  mesh.unit_name = name;
  mesh.unit = file_unit(name).metres;
  mesh.unit_given = true;
}

void add_unit(const std::string& of_formats, Map<MeshShape>& map) {
  std::vector<std::string> units;
  for (const auto& unit : kFileUnits) {
    units.emplace_back(unit.name);
  }
  const auto unit = word(units);
  map.add(
      {.name = "unit",
       .type = unit.type,
       .help = fmt::format("Unit of the file's coordinates{}. It may be left out if they are in mm and the size of the "
                           "body confirms it.",
                           of_formats),
       .fallback = "mm"},
      [unit](const Input& in, MeshShape& mesh) {
        std::string name;
        if (!unit.read(in, name)) {
          return false;
        }
        set_unit(name, mesh);
        return true;
      },
      [unit](const MeshShape& mesh) { return std::optional<Node>(unit.write(mesh.unit_name)); });
}

/// Points near the skin in the unit of the file, which must have been read.
void add_landmarks(Map<MeshShape>& map) {
  map.add(
      {.name = "landmarks",
       .type = landmarks_codec("mm").type,
       .help = "Named points near the skin, in the frame and unit of the file.",
       .example = "{index_pad: [0, 0, 0]}",
       .fallback = "{}"},
      [](const Input& in, MeshShape& mesh) { return landmarks_codec(mesh.unit_name).read(in, mesh.landmarks); },
      [](const MeshShape& mesh) { return std::optional(landmarks_codec(mesh.unit_name).write(mesh.landmarks)); });
}

Codec<MeshShape> mesh_codec() {
  const auto file = absolute_file();
  Map<MeshShape> map;
  map.add(
      {.name = "file",
       .type = file.type,
       .help = "STL, OBJ, PLY, OFF or GLB file of a closed surface. A relative name starts from the scene's folder.",
       .required = true,
       .example = "my_hand.stl"},
      [file](const Input& in, MeshShape& mesh) {
        mesh.named = in.reading().placed(in.node().place, in.path());
        if (!file.read(in, mesh.file)) {
          return false;
        }
        if (const std::string unit = format_unit(mesh.file); !unit.empty()) {
          set_unit(unit, mesh);
        }
        return true;
      },
      [file](const MeshShape& mesh) { return std::optional(file.write(mesh.file)); });
  add_unit(" (m of GLB)", map);
  map.maybe("resurface_mm", &MeshShape::resurface, number(kMillimetres, above(0)), "1.5",
            "Makes one closed skin with edges of this length [mm] from the faces of the file. They may have holes, "
            "flaps, duplicates, and parts that cross or overlap. Without this key the surface must be closed and must "
            "not intersect itself.");
  add_landmarks(map);
  return map.codec();
}

/// The same body at several times.
Codec<MeshShape> meshes_codec() {
  const auto path = absolute_file();
  const auto key = [path](const std::string& name, std::string MeshSeries::*member, const std::string& example,
                          const std::string& help, Map<MeshShape>& map) {
    map.add(
        {.name = name, .type = path.type, .help = help, .required = true, .example = example},
        [path, member](const Input& in, MeshShape& mesh) {
          if (!mesh.series) {
            mesh.series.emplace();
          }
          return path.read(in, (*mesh.series).*member);
        },
        [path, member](const MeshShape& mesh) { return std::optional(path.write((*mesh.series).*member)); });
  };
  Map<MeshShape> map;
  key("folder", &MeshSeries::folder, "tracked",
      "Folder of the mesh files, all with the same triangles. A relative name starts from the scene's folder.", map);
  key("times", &MeshSeries::times, "tracked/times.csv",
      "Table of the files and their times [s] in ascending order, with the header file,time_s and one row per file. "
      "Between two times the vertices move along straight lines. A run takes the first mesh.",
      map);
  add_unit("", map);
  add_landmarks(map);
  map.check([](const Input& in, MeshShape& mesh, bool good) { return good && read_mesh_times(in, mesh); });
  return map.codec();
}

Codec<Placement> place_codec() {
  return Map<Placement>()
      .key("landmark", &Placement::landmark, text(0),
           "Landmark of the body that is placed at at_mm; empty: the body's own origin.")
      .shown_as("index_pad")
      .key("at_mm", &Placement::at, vector3(kMillimetres, {}), "Position of this point in the world [mm].")
      .shown_as("[0, 0, 200]")
      .key("rotate_deg", &Placement::angles, vector3(kDegrees, {}),
           "Rotation of the body about this point: about the world's x, then y, then z axis [deg].")
      .codec();
}

bool check_body(const Input& in, const BodySpec& body, bool good) {
  if (!good) {
    return true;
  }
  const std::vector<std::string> landmarks = landmark_names(body);
  if (!body.place.landmark.empty()) {
    const Input place = in.key("place");
    good = check_landmark(place.key("landmark"), landmarks, body.place.landmark);
  }
  const Entry* edge = in.node().find("edge_mm");
  if (!edge) {
    return good;
  }
  if (std::holds_alternative<HandShape>(body.shape)) {
    good = check_hand_edges(in.at(*edge)) && good;
  }
  return check_near(in.at(*edge), landmarks) && good;
}

bool is_no_series(const BodySpec& body) {
  const auto* mesh = std::get_if<MeshShape>(&body.shape);
  return mesh == nullptr || !mesh->series;
}

std::string usual_edges_text() {
  using Usual = UsualHandEdges;
  return fmt::format("{{near_target: {:g}, far: {:g}, within_mm: {:g}}} in a scene with a target, {:g} without",
                     Usual::kNearTarget / kMillimetre, Usual::kFar / kMillimetre, Usual::kWithin / kMillimetre,
                     Usual::kWithoutTarget / kMillimetre);
}

Map<BodySpec> body_map() {
  Map<BodySpec> map;
  map.maybe("hand", &BodySpec::shape, hand_codec(), "",
            "The built-in hand. Its own frame has the origin at the wrist, y towards the fingertips and z out of the "
            "back of the hand. The thumb of a right hand is at negative x, that of a left hand at positive x. "
            "Landmarks: thumb_pad, index_pad, middle_pad, ring_pad, little_pad, thumb_tip to little_tip, palm_centre, "
            "back_centre, wrist.")
      .maybe("sphere", &BodySpec::shape, sphere_codec(), "",
             "A sphere about its origin. Landmarks: top, bottom, x_plus, x_minus, y_plus, y_minus.")
      .maybe("capsule", &BodySpec::shape, capsule_codec(), "",
             "A cylinder along y between two half spheres, a simple finger. Landmarks: those of a sphere.")
      .maybe("box", &BodySpec::shape, box_codec(), "", "A box about its origin. Landmarks: those of a sphere.")
      .maybe("mesh", &BodySpec::shape, mesh_codec(), "", "A surface from a file.")
      .written_if(is_no_series)
      .maybe("meshes", &BodySpec::shape, meshes_codec(), "", "A moving surface, from one file per time.")
      .key("place", &BodySpec::place, place_codec(), "Place of the body.")
      .maybe("edge_mm", &BodySpec::edge, edge_codec(), "2.8",
             fmt::format("Requested edge length of the mesh [mm]: one for the whole body, or shorter ones near some "
                         "places. Then the edges of a forearm are up to {:g} times as long as far, at most {:g} mm. "
                         "Range for a hand: {}; above {:g} mm its edges are no longer than {:g} of the "
                         "thickness of the flesh or the width of a cleft. Default for a hand: {}. A mesh from a file "
                         "is remeshed if this key is given, and kept as it is otherwise.",
                         kForearmEdge, kMostHandEdge / kMillimetre, kHandEdge.text(), kAlwaysPossible / kMillimetre,
                         kOfRoom, usual_edges_text()))
      .needed_with({"sphere", "capsule", "box"}, {"hand", "mesh"})
      .maybe("keep_within_mm", &BodySpec::keep_within, number(kMillimetres, above(0)), "60",
             "Scattering is solved only on the part of the body within this distance of the target along each axis of "
             "the body [mm]. Flat caps close its open ends. The phases keep the incident pressure low at points of the "
             "rest of the skin, and the evaluation mesh has the whole body.")
      .allowed_with({"hand", "sphere", "capsule", "box", "mesh"})
      .exactly_one({"hand", "sphere", "capsule", "box", "mesh", "meshes"})
      .check([](const Input& in, BodySpec& body, bool good) { return check_body(in, body, good); });
  return map;
}

}  // namespace

std::vector<std::string> landmark_names(const BodySpec& body) {
  if (std::holds_alternative<HandShape>(body.shape)) {
    return hand_landmark_names();
  }
  const auto* mesh = std::get_if<MeshShape>(&body.shape);
  if (!mesh) {
    return shape_landmark_names();
  }
  std::vector<std::string> names;
  names.reserve(mesh->landmarks.size());
  for (const auto& [name, position] : mesh->landmarks) {
    names.push_back(name);
  }
  return names;
}

std::vector<std::string> landmark_names(const std::vector<BodySpec>& bodies) {
  std::set<std::string> all;
  for (const BodySpec& body : bodies) {
    for (std::string& name : landmark_names(body)) {
      all.insert(std::move(name));
    }
  }
  return {all.begin(), all.end()};
}

bool check_landmark(const Input& at, const std::vector<std::string>& names, const std::string& name) {
  if (contains(names, name)) {
    return true;
  }
  return at.must_be(rule(names, name));
}

bool check_near(const Input& edges, const std::vector<std::string>& names) {
  const Entry* near = edges.node().find("near");
  if (!near) {
    return true;
  }
  const Input table = edges.at(*near);
  bool good = true;
  for (const Entry& entry : near->value.entries) {
    if (entry.value.removed || contains(names, entry.key)) {
      continue;
    }
    edges.reading().add(entry.place, fmt::format("{}: must be {}", table.path_of(entry.key), rule(names, entry.key)));
    good = false;
  }
  return good;
}

bool check_box_landmarks(const Input& scene, const std::vector<BodySpec>& bodies) {
  const Entry* target = scene.node().find("target");
  if (!target) {
    return true;
  }
  std::vector<std::string> names = landmark_names(bodies);
  names.emplace_back(kNearestToArray);
  std::vector<std::string> known = names;
  for (const BodySpec& body : bodies) {
    for (const std::string& landmark : landmark_names(body)) {
      known.push_back(body.name + "." + landmark);
    }
  }
  bool good = true;
  const auto check = [&](const Input& place) {
    const Entry* at = place.node().find("at");
    if (at && !contains(known, at->value.text)) {
      good = place.at(*at).must_be(rule(names, at->value.text));
    }
  };
  const auto check_items = [](const Input& in, const char* key, const auto& check_item) {
    const Entry* entry = in.node().find(key);
    for (std::size_t i = 0; entry && i < entry->value.items.size(); ++i) {
      check_item(in.at(*entry).at(i));
    }
  };
  const Input table = scene.at(*target);
  if (const Entry* box = target->value.find("box")) {
    check(table.at(*box));
  }
  check_items(table, "boxes", check);
  check_items(table, "points", check);
  check_items(table, "lines", [&](const Input& line) { check_items(line, "points", check); });
  return good;
}

Codec<HandShape> hand_codec() {
  return Map<HandShape>()
      .key("pose", &HandShape::pose, word(hand_poses()), "Pose of the fingers.")
      .key("breadth_mm", &HandShape::breadth, number(kMillimetres, between(50, 150)),
           "Breadth across the knuckles [mm].")
      .key("length_mm", &HandShape::length, number(kMillimetres, between(120, 260)),
           "Length of the flat hand from the wrist to the tip of the middle finger [mm].")
      .key("side", &HandShape::side, choice<HandSide>({{"right", HandSide::kRight}, {"left", HandSide::kLeft}}),
           "Which hand; the left one is the mirror image in x.")
      .key("joints", &HandShape::joints, joints_codec(), "Joint angles that differ from the pose.")
      .key("forearm_mm", &HandShape::forearm, number(kMillimetres, between(0, kMostForearm / kMillimetre)),
           "Length of forearm [mm] beyond the hand's own skin, which ends 20 mm behind the wrist joint; 0: a hand "
           "alone. The forearm moves with the palm.")
      .check([](const Input& in, HandShape& hand, bool good) {
        const Entry* forearm = in.node().find("forearm_mm");
        hand.forearm_given = forearm != nullptr && !forearm->value.removed;
        return good;
      })
      .codec();
}

Codec<BodySpec> body_codec() { return body_map().codec(); }

Codec<std::vector<BodySpec>> bodies_codec() {
  const auto named = name();
  auto map = body_map();
  map.required("name", &BodySpec::name, named, "hand", "Name of the body; its landmarks are called name.landmark.");
  return list_of<BodySpec>(map.codec(), 1, 20, {.name = [](const BodySpec& body) { return body.name; }, .advice = ""});
}

}  // namespace touchfield::schema
