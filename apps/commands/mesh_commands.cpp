#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "sim/acoustics/medium.h"
#include "sim/core/errors.h"
#include "sim/core/json.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/remesh/resurface.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/model/stages.h"

namespace touchfield {

namespace {

/// The file's unit: stated or guessed, and what there is to warn of.
struct FileScale {
  LengthUnit unit;
  bool stated;
  UnitGuess guess;
  std::vector<std::string> warnings;
};

/// What `mesh` found and did.
struct MeshText {
  std::string file;
  FileScale scale;
  double size;                       // [file units]
  SurfaceReport report;              // of the file's surface
  std::vector<std::string> steps{};  // that made the result
  std::optional<SkinReport> result{};
  std::string written{};                           // file and unit; empty: none
  std::optional<SurfaceDistance> to_resurfaced{};  // from the file's outer faces to the new skin, if it was resurfaced
  std::optional<SurfaceDistance> from_resurfaced{};
};

Json skin_value(const SkinReport& skin) {
  const MeshReport& mesh = skin.mesh;
  Json holes = Json::array();
  for (const Hole& hole : mesh.holes) {
    const Vector3 at = hole.at / kMillimetre;
    holes.push_back(Json{{"edges", hole.edges},
                         {"length_mm", hole.length / kMillimetre},
                         {"at_mm", std::vector<double>(at.begin(), at.end())}});
  }
  const double wavelength = Wave(air(kZeroCelsius + 20.0), 40e3).wavelength();  // at 20 C and 40 kHz
  return {{"faces", mesh.faces},
          {"vertices", mesh.vertices},
          {"components", mesh.components},
          {"nested_pieces", mesh.nested_pieces},
          {"closed", skin.mean_edge > 0 && mesh.closed()},
          {"inside_out", mesh.inside_out},
          {"boundary_edges", mesh.boundary_edges},
          {"holes", holes},
          {"nonmanifold_edges", mesh.nonmanifold_edges},
          {"nonmanifold_vertices", mesh.nonmanifold_vertices},
          {"misoriented_edges", mesh.misoriented_edges},
          {"flat_faces", skin.flat_faces},
          {"self_intersections", skin.crossings},
          {"area_cm2", mesh.area * 1e4},
          {"volume_cm3", mesh.volume * 1e6},
          {"shortest_edge_mm", mesh.shortest_edge / kMillimetre},
          {"longest_edge_mm", mesh.longest_edge / kMillimetre},
          {"mean_edge_mm", skin.mean_edge / kMillimetre},
          {"smallest_angle_deg", mesh.smallest_angle / kDegree},
          {"wavelength_mm", wavelength / kMillimetre},
          {"epw_mean", wavelength / skin.mean_edge},
          {"epw_min", wavelength / mesh.longest_edge},
          {"faults", skin.faults}};
}

Json distance_value(const std::optional<SurfaceDistance>& distance) {
  return distance ? Json{{"share_counted", distance->counted},
                         {"most_95_mm", distance->most_of_it / kMillimetre},
                         {"farthest_mm", distance->farthest / kMillimetre}}
                  : Json();
}

/// How sure a guess is: as JSON says it, and as a report does.
std::pair<const char*, const char*> certainty_words(UnitCertainty certainty) {
  switch (certainty) {
    case UnitCertainty::kSure:
      return {"sure", "The size fits a hand in this unit alone"};
    case UnitCertainty::kUnclear:
      return {"unclear", "The size does not tell the unit"};
    case UnitCertainty::kNone:
      break;
  }
  return {"none", "No unit makes it a hand, a finger or an arm"};
}

Json mesh_value(const MeshText& text) {
  const SurfaceReport& report = text.report;
  return {{"file", text.file},
          {"unit", text.scale.unit.name},
          {"unit_stated", text.scale.stated},
          {"unit_guess",
           {{"unit", text.scale.guess.unit.name},
            {"certainty", certainty_words(text.scale.guess.certainty).first},
            {"reason", text.scale.guess.reason}}},
          {"size", text.size},
          {"points", report.points},
          {"faces", report.faces},
          {"repeated_points", report.repeated_points},
          {"unreferenced_points", report.unreferenced_points},
          {"collapsed_faces", report.collapsed_faces},
          {"duplicate_faces", report.duplicate_faces},
          {"surface", skin_value(report.skin)},
          {"usable", report.skin.faults.empty()},
          {"warnings", text.scale.warnings},
          {"steps", text.steps},
          {"to_resurfaced", distance_value(text.to_resurfaced)},
          {"from_resurfaced", distance_value(text.from_resurfaced)},
          {"result", text.result ? skin_value(*text.result) : Json()},
          {"written", text.written.empty() ? Json() : Json(text.written)}};
}

struct MeshCommand {
  std::string file;
  std::string output;               // empty: report only
  bool force = false;               // replace an existing file
  std::string unit;                 // of the file: mm, cm or m; empty: guessed
  std::string output_unit;          // empty: the file's
  std::optional<double> resurface;  // edge of new faces [m]
  std::optional<double> edge;       // to remesh to [m]
};

FileScale find_scale(double size, const std::string& stated) {
  FileScale scale{{}, !stated.empty(), guess_unit(size), {}};
  const UnitGuess& guess = scale.guess;
  if (scale.stated) {
    scale.unit = file_unit(stated);
    if (const auto doubt = unit_doubt(size, stated)) {
      scale.warnings.push_back("unit: " + doubt->text);
    }
    return scale;
  }
  scale.unit = guess.unit;
  if (const auto doubt = unit_doubt(size, std::nullopt)) {
    scale.warnings.push_back(fmt::format("unit: the file states none, this report takes {}. {}: {}. --unit states it",
                                         guess.unit.name, certainty_words(guess.certainty).second, guess.reason));
  }
  return scale;
}

/// Lengths in millimetres mean nothing to a body that may be ten times larger.
void require_known_scale(const MeshCommand& command, const FileScale& scale) {
  const bool counts = command.edge || command.resurface;
  if (counts && !scale.stated && scale.guess.certainty != UnitCertainty::kSure) {
    throw InputError(fmt::format("{}: lengths in mm need --unit. {}: {}", command.file,
                                 certainty_words(scale.guess.certainty).second, scale.guess.reason));
  }
}

/// The mesh after all that the command asks for; adds a line a step, and how far resurfacing moved the skin.
TriangleMesh worked(const MeshCommand& command, const FileSurface& surface, const FileScale& scale, Progress& progress,
                    MeshText& text) {
  std::vector<std::string>& steps = text.steps;
  if (const auto& faults = text.report.skin.faults; !command.resurface && !faults.empty()) {
    throw InputError(fmt::format("{}: the mesh has faults, --resurface MM makes a closed skin of it: {}", command.file,
                                 fmt::join(faults, "; ")));
  }
  TriangleMesh mesh = [&] {
    if (!command.resurface) {
      WeldedSurface merged = welded(surface, scale.unit.metres);
      return TriangleMesh(std::move(merged.points), std::move(merged.triangles));
    }
    Resurfaced result = timed(progress, "resurface", [&] {
      return resurfaced(surface, scale.unit.metres, *command.resurface, command.file, "--resurface");
    });
    steps = std::move(result.steps);
    text.to_resurfaced = result.to_skin;
    text.from_resurfaced = result.from_skin;
    return std::move(result.mesh);
  }();
  if (command.edge) {
    mesh = timed(progress, "remesh", [&] { return remeshed_surface(mesh, EdgeSizing(*command.edge)); });
    steps.push_back(
        fmt::format("remeshed to edges of {} mm: {} faces", *command.edge / kMillimetre, mesh.face_count()));
  }
  return mesh;
}

int mesh_command(const MeshCommand& command, const CommonFlags& flags) {
  apply_threads(flags);
  ConsoleProgress progress(flags);
  if (!command.output.empty()) {
    require_free_output(command.output, command.force, {command.file});
  }
  const FileSurface surface = read_surface(command.file);
  const double size = surface_size(surface);
  require(size > 0, "{}: all faces are at one point, the mesh has no size", command.file);
  FileScale scale = find_scale(size, command.unit.empty() ? format_unit(command.file) : command.unit);
  for (const std::string& note : surface.notes) {
    scale.warnings.push_back(fmt::format("{}: {}", command.file, note));
  }
  for (const std::string& warning : scale.warnings) {
    progress.warn(warning);
  }
  require_known_scale(command, scale);
  const bool works = command.resurface || command.edge || !command.output.empty();
  if (works) {
    require_body_size(size * scale.unit.metres, command.file);
  }
  if (command.resurface) {
    require_resurfaceable(surface, scale.unit.metres, *command.resurface, command.file, "--resurface");
  }
  MeshText text{command.file, scale, size,
                timed(progress, "inspect", [&] { return inspect_surface(surface, scale.unit.metres); })};
  if (works) {
    const TriangleMesh mesh = worked(command, surface, scale, progress, text);
    text.result = inspect_skin(mesh.vertices(), mesh.triangles());
    if (!text.result->faults.empty()) {
      throw NumericalError(
          fmt::format("{}: the resulting mesh has faults: {}", command.file, fmt::join(text.result->faults, "; ")));
    }
    if (!command.output.empty()) {
      const LengthUnit unit = command.output_unit.empty() ? scale.unit : file_unit(command.output_unit);
      write_mesh(command.output, mesh, unit.metres);
      text.written = fmt::format("{} in {}", command.output, unit.name);
    }
  }
  print_value(mesh_value(text), flags);
  return 0;
}

struct HandCommand {
  std::string output;
  bool force = false;  // replace an existing file
  HandOptions options{.forearm = kUsualForearm};
  std::string unit = "mm";  // of the file
};

int hand_command(const HandCommand& command, const CommonFlags& flags) {
  apply_threads(flags);
  require_free_output(command.output, command.force);
  const Body body = hand(command.options);
  const double unit = file_unit(command.unit).metres;
  write_mesh(command.output, body.mesh, unit);
  const MeshReport report = inspect(body.mesh);
  Json landmarks = Json::object();
  for (const Landmark& landmark : body.landmarks) {
    const Vector3 at = position(body.mesh, landmark) / unit;
    landmarks[landmark.name] = std::vector<double>(at.begin(), at.end());
  }
  print_value({{"file", command.output},
               {"faces", report.faces},
               {"area_cm2", report.area * 1e4},
               {"volume_cm3", report.volume * 1e6},
               {"shortest_edge_mm", report.shortest_edge / kMillimetre},
               {"longest_edge_mm", report.longest_edge / kMillimetre},
               {"unit", command.unit},
               {"landmarks", landmarks}},
              flags);
  return 0;
}

}  // namespace

void add_mesh_command(CLI::App& app, Invocation& invocation) {
  const auto mesh = std::make_shared<MeshCommand>();
  CLI::App* command = app.add_subcommand("mesh", "Inspect, resurface or remesh a mesh file (STL, OBJ, PLY, OFF, GLB)");
  command->add_option("FILE", mesh->file, "Mesh file; its ending names the format")->required()->type_name(kMeshFile);
  command->add_option("-o,--output", mesh->output, "Mesh file to write; default: report only")->type_name(kMeshFile);
  command->add_flag("--force", mesh->force, "Replace the mesh file to write if it exists");
  command->add_option("--unit", mesh->unit, "Unit of FILE: mm, cm or m; default: m for GLB, else guessed from its size")
      ->check(one_of({"mm", "cm", "m"}));
  command->add_option("--output-unit", mesh->output_unit, "Unit of the file written: mm, cm or m; default: FILE's")
      ->check(one_of({"mm", "cm", "m"}));
  add_number(
      command, "--resurface", mesh->resurface, schema::above(0),
      "Make one closed skin with edges of this length [mm]. The faces of FILE may have holes, flaps, crossings and "
      "overlaps",
      kMillimetre);
  add_number(command, "--remesh", mesh->edge, schema::above(0), "Remesh with edges of this length [mm]", kMillimetre);
  finish_command(command, invocation, [mesh](const Invocation& invoked) { return mesh_command(*mesh, invoked.flags); });
}

void add_hand_command(CLI::App& app, Invocation& invocation) {
  const auto hand = std::make_shared<HandCommand>();
  CLI::App* command = app.add_subcommand("hand", "Write the built-in hand as a mesh file (STL, OBJ or PLY)");
  command->add_option("-o,--output", hand->output, "Mesh file; its ending names the format")
      ->required()
      ->type_name(kMeshFile);
  command->add_flag("--force", hand->force, "Replace the mesh file if it exists");
  command->add_option("--pose", hand->options.pose, "Pose of the fingers")
      ->check(one_of(hand_poses()))
      ->capture_default_str();
  add_number(command, "--breadth-mm", hand->options.breadth, schema::between(50, 150), "Hand breadth [mm]",
             kMillimetre);
  add_number(command, "--length-mm", hand->options.length, schema::between(120, 260), "Hand length [mm]", kMillimetre);
  command->add_option("--side", hand->options.side, "Which hand: right (default, thumb at negative x) or left")
      ->transform(named<HandSide>({{"right", HandSide::kRight}, {"left", HandSide::kLeft}}));
  add_number(command, "--edge-mm", hand->options.edge,
             schema::between(kLeastHandEdge / kMillimetre, kMostHandEdge / kMillimetre), "Edge length [mm]",
             kMillimetre);
  add_number(command, "--forearm-mm", hand->options.forearm, schema::between(0, kMostForearm / kMillimetre),
             "Length of forearm beyond the hand's own skin [mm]; 0: a hand alone", kMillimetre);
  command->add_option("--unit", hand->unit, "Unit of the file: mm (default), cm or m")
      ->check(one_of({"mm", "cm", "m"}));
  finish_command(command, invocation, [hand](const Invocation& invoked) { return hand_command(*hand, invoked.flags); });
}

}  // namespace touchfield
