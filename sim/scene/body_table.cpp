#include <filesystem>
#include <system_error>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/mesh/hand.h"
#include "sim/scene/scene_table.h"

namespace touchfield::schema {
namespace {

Codec<HandShape> hand_codec() {
  return Map<HandShape>()
      .key("pose", &HandShape::pose, word(hand_poses()), "How the fingers are held.")
      .key("breadth_mm", &HandShape::breadth, number(kMillimetres, between(50, 150)),
           "Breadth across the knuckles [mm].")
      .key("length_mm", &HandShape::length, number(kMillimetres, between(120, 260)),
           "Length from the wrist to the tip of the middle finger, the hand held flat [mm].")
      .key("side", &HandShape::side, choice<HandSide>({{"right", HandSide::kRight}, {"left", HandSide::kLeft}}),
           "Which hand.")
      .codec();
}

Codec<SphereShape> sphere_codec() {
  return Map<SphereShape>()
      .required("radius_mm", &SphereShape::radius, number(kMillimetres, above(0)), "8", "Radius [mm].")
      .codec();
}

Codec<CapsuleShape> capsule_codec() {
  return Map<CapsuleShape>()
      .required("radius_mm", &CapsuleShape::radius, number(kMillimetres, above(0)), "8", "Radius [mm].")
      .required("length_mm", &CapsuleShape::length, number(kMillimetres, {.low = 0.0, .high = {}}), "60",
                "Length of the cylinder between the half spheres [mm].")
      .codec();
}

Codec<BoxShape> box_codec() {
  return Map<BoxShape>()
      .required("size_mm", &BoxShape::size, vector3(kMillimetres, above(0)), "[20, 60, 10]", "Side lengths [mm].")
      .codec();
}

struct FileUnit {
  const char* name;
  double metres;
  int power;  // metres = 10^power
};
constexpr FileUnit kFileUnits[] = {{"mm", 1e-3, -3}, {"cm", 1e-2, -2}, {"m", 1.0, 0}};

const FileUnit& file_unit(const std::string& name) {
  for (const auto& unit : kFileUnits) {
    if (unit.name == name) return unit;
  }
  return kFileUnits[0];
}

Codec<Vector3> landmark_codec(const std::string& unit) {
  return vector3(Unit::power_of_ten(file_unit(unit).power), {});
}

bool read_landmarks(const Input& in, MeshShape& mesh, const TypeInfo& type) {
  if (in.node().kind != Node::Kind::kMap) {
    in.must_be(phrase(type, false));
    return false;
  }
  bool good = true;
  const auto codec = landmark_codec(mesh.unit_name);
  for (const auto& entry : in.node().entries) {
    if (entry.value.removed) continue;
    const auto report = [&](const std::string& text) {
      in.reading().add(entry.place, fmt::format("{}: {}", in.path_of(entry.key), text));
      good = false;
    };
    Vector3 position = Vector3::Zero();
    good = codec.read(in.at(entry), position) && good;
    if (!is_name(entry.key)) report(fmt::format("a name that must be {}", phrase(name().type)));
    if (!mesh.landmarks.emplace(entry.key, position).second) report("given twice");
  }
  return good;
}

Codec<MeshShape> mesh_codec() {
  const auto named = file();
  std::vector<std::string> units;
  for (const auto& unit : kFileUnits) units.emplace_back(unit.name);
  const auto unit = word(units);
  const TypeInfo landmarks{.kind = TypeInfo::Kind::kTable, .of = {landmark_codec("mm").type}};
  return Map<MeshShape>()
      .add(
          {.name = "file",
           .type = named.type,
           .help = "STL, OBJ or PLY file of a closed surface; a relative name counts from the scene's folder.",
           .required = true,
           .example = "my_hand.stl"},
          [named](const Input& in, MeshShape& mesh) {
            std::string path;
            if (!named.read(in, path)) return false;
            std::error_code error;
            const auto absolute = std::filesystem::absolute(path, error);
            mesh.file = error ? path : absolute.lexically_normal().string();
            return true;
          },
          [named](const MeshShape& mesh) { return std::optional<Node>(named.write(mesh.file)); })
      .add(
          {.name = "unit", .type = unit.type, .help = "Unit of the file's coordinates.", .fallback = "mm"},
          [unit](const Input& in, MeshShape& mesh) {
            if (!unit.read(in, mesh.unit_name)) return false;
            mesh.unit = file_unit(mesh.unit_name).metres;
            return true;
          },
          [unit](const MeshShape& mesh) { return std::optional<Node>(unit.write(mesh.unit_name)); })
      .add(
          {.name = "landmarks",
           .type = landmarks,
           .help = "Named points near the skin, in the file's frame and unit.",
           .example = "{index_pad: [0, 0, 0]}",
           .fallback = "{}"},
          [landmarks](const Input& in, MeshShape& mesh) { return read_landmarks(in, mesh, landmarks); },
          [](const MeshShape& mesh) {
            const auto codec = landmark_codec(mesh.unit_name);
            std::vector<std::pair<std::string, Node>> entries;
            for (const auto& [landmark, position] : mesh.landmarks) {
              entries.emplace_back(landmark, codec.write(position));
            }
            return std::optional<Node>(map(std::move(entries)));
          })
      .codec();
}

Codec<Placement> place_codec() {
  return Map<Placement>()
      .key("landmark", &Placement::landmark, text(0),
           "The landmark of the body that is put on at_mm; empty: the body's own origin.")
      .shown_as("index_pad")
      .key("at_mm", &Placement::at, vector3(kMillimetres, {}), "Where it is put in the world [mm].")
      .shown_as("[0, 0, 200]")
      .key("rotate_deg", &Placement::angles, vector3(kDegrees, {}),
           "Rotation of the body about it: about the world's x, then y, then z axis [deg].")
      .codec();
}

bool check_body(const Input& in, const BodySpec& body, bool good) {
  if (!good) return true;
  if (std::holds_alternative<HandShape>(body.shape)) {
    return check_hand_edge(in.at(*in.node().find("edge_mm")));
  }
  const auto* mesh = std::get_if<MeshShape>(&body.shape);
  if (!mesh || body.place.landmark.empty() || mesh->landmarks.contains(body.place.landmark)) return true;
  std::vector<std::string> names;
  names.reserve(mesh->landmarks.size());
  for (const auto& [landmark, position] : mesh->landmarks) names.push_back(landmark);
  const Input place = in.at(*in.node().find("place"));
  place.at(*place.node().find("landmark"))
      .must_be(names.empty() ? "one of body.mesh.landmarks, which has none"
                             : fmt::format("one of body.mesh.landmarks: {}", fmt::join(names, ", ")));
  return false;
}

}  // namespace

bool check_hand_edge(const Input& edge) {
  const auto rule = kHandEdge.broken_by(*parse_decimal(edge.node().text));
  if (rule) edge.must_be(*rule + " for a hand");
  return !rule;
}

Codec<BodySpec> body_codec() {
  return Map<BodySpec>()
      .alternative("hand", &BodySpec::shape, hand_codec(),
                   "The built-in hand. Its own frame: origin at the wrist, x to the thumb's side of a right hand, y to "
                   "the fingertips, z out of the back of the hand. Landmarks: thumb_pad, index_pad, middle_pad, "
                   "ring_pad, little_pad, thumb_tip to little_tip, palm_centre, back_centre, wrist.")
      .alternative("sphere", &BodySpec::shape, sphere_codec(),
                   "A sphere about its origin. Landmarks: top, bottom, x_plus, x_minus, y_plus, y_minus.")
      .alternative("capsule", &BodySpec::shape, capsule_codec(),
                   "A cylinder along y between two half spheres, a simple finger. Landmarks as of a sphere.")
      .alternative("box", &BodySpec::shape, box_codec(), "A box about its origin. Landmarks as of a sphere.")
      .alternative("mesh", &BodySpec::shape, mesh_codec(), "A surface from a file.")
      .key("place", &BodySpec::place, place_codec(), "Where the body is.")
      .maybe("edge_mm", &BodySpec::edge, number(kMillimetres, above(0)), "2.8",
             fmt::format("Wanted edge length of the mesh [mm]; of a hand {}.", kHandEdge.text()))
      .needed_with({"hand", "sphere", "capsule", "box"})
      .exactly_one({"hand", "sphere", "capsule", "box", "mesh"})
      .check([](const Input& in, BodySpec& body, bool good) { return check_body(in, body, good); })
      .codec();
}

}  // namespace touchfield::schema
