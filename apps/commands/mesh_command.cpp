#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/mesh_text.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/mesh/io/mesh_files.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/mesh_quality.h"
#include "sim/mesh/remesh/resurface.h"
#include "sim/mesh/remesh/surface_remesh.h"
#include "sim/model/stages.h"

namespace touchfield {

namespace {

struct MeshCommand {
  std::string file;
  std::string output;               // empty: report only
  bool force = false;               // replace an existing file
  std::string unit;                 // of the file: mm, cm or m; empty: guessed
  std::string output_unit;          // empty: the file's
  std::optional<double> resurface;  // edge of new faces [m]
  std::optional<double> edge;       // to remesh to [m]
};

/// The file's unit: stated or guessed, and what there is to warn of.
struct FileScale {
  LengthUnit unit;
  bool stated;
  UnitGuess guess;
  std::vector<std::string> warnings;
};

FileScale find_scale(double size, const std::string& stated) {
  FileScale scale{{}, !stated.empty(), guess_unit(size), {}};
  const UnitGuess& guess = scale.guess;
  if (scale.stated) {
    scale.unit = file_unit(stated);
    const bool hand_in_another = guess.certainty == UnitCertainty::kSure || guess.certainty == UnitCertainty::kLikely;
    if (const auto doubt = unit_doubt(size, stated)) {
      scale.warnings.push_back("unit: " + doubt->text);
    } else if (hand_in_another && guess.unit.metres != scale.unit.metres) {
      scale.warnings.push_back(fmt::format("unit: {} is stated, but if this is a hand it is in {} ({})", stated,
                                           guess.unit.name, guess.reason));
    }
    return scale;
  }
  scale.unit = guess.unit;
  if (const auto doubt = unit_doubt(size, std::nullopt)) {
    scale.warnings.push_back(
        fmt::format("unit: assumed to be {}, {}: {}", guess.unit.name, certainty_text(guess.certainty), guess.reason));
  }
  return scale;
}

/// Lengths in millimetres mean nothing to a body that may be ten times larger.
void require_known_scale(const MeshCommand& command, const FileScale& scale) {
  const bool counts = command.edge || command.resurface;
  if (counts && !scale.stated && scale.guess.certainty != UnitCertainty::kSure) {
    throw InputError(fmt::format("{}: lengths in mm need --unit: perhaps {}, {}: {}", command.file,
                                 scale.guess.unit.name, certainty_text(scale.guess.certainty), scale.guess.reason));
  }
}

template <class Work>
auto as_stage(Progress& progress, const char* what, const Work& work) {
  std::vector<std::pair<std::string, double>> unused;
  return timed(progress, unused, what, what, work);
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
    Resurfaced result = as_stage(progress, "resurface", [&] {
      return resurfaced(surface, scale.unit.metres, *command.resurface, command.file, "--resurface");
    });
    steps = std::move(result.steps);
    text.to_resurfaced = result.to_skin;
    text.from_resurfaced = result.from_skin;
    return std::move(result.mesh);
  }();
  if (command.edge) {
    mesh = as_stage(progress, "remesh", [&] { return remeshed_surface(mesh, EdgeSizing(*command.edge)); });
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
  const bool is_glb = std::filesystem::path(command.file).extension() == ".glb";  // which is in m
  FileScale scale = find_scale(size, command.unit.empty() && is_glb ? "m" : command.unit);
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
  const SurfaceReport report =
      as_stage(progress, "inspect", [&] { return inspect_surface(surface, scale.unit.metres); });

  MeshText text{command.file, scale.unit, scale.stated, scale.guess, size, scale.warnings, report, {}, {}, {}, {}, {}};
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

}  // namespace touchfield
