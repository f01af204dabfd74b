#include <memory>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/body/hand.h"
#include "sim/core/json_text.h"
#include "sim/core/units.h"
#include "sim/mesh/io/mesh_io.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/query/inspect.h"

namespace touchfield {

namespace {

struct HandCommand {
  std::string output;
  bool force = false;  // replace an existing file
  HandOptions options;
  std::string unit = "mm";  // of the file
};

int hand_command(const HandCommand& command, const CommonFlags& flags) {
  apply_threads(flags);
  require_free_output(command.output, command.force);
  const Body body = hand(command.options);
  const double unit = file_unit(command.unit).metres;
  write_mesh(command.output, body.mesh, unit);
  const MeshReport report = inspect(body.mesh);
  nlohmann::ordered_json landmarks = nlohmann::ordered_json::object();
  for (const Landmark& landmark : body.landmarks) {
    const Vector3 at = position(body.mesh, landmark) / unit;
    landmarks[landmark.name] = {at.x(), at.y(), at.z()};
  }
  if (flags.json) {
    const nlohmann::ordered_json json = {{"file", command.output},
                                         {"faces", report.faces},
                                         {"area_cm2", report.area * 1e4},
                                         {"volume_cm3", report.volume * 1e6},
                                         {"landmarks", landmarks}};
    put(json_text(json, 2) + "\n");
  } else if (!flags.quiet) {
    put(fmt::format("{}: {} faces, {:.1f} cm2, {:.1f} cm3, edges {:.2f} to {:.2f} mm\n", command.output, report.faces,
                    report.area * 1e4, report.volume * 1e6, report.shortest_edge / kMillimetre,
                    report.longest_edge / kMillimetre));
    put("landmarks in the file's unit:\n");
    for (const auto& [name, at] : landmarks.items()) {
      put(fmt::format("  {:<12} {:9.3f} {:9.3f} {:9.3f}\n", name, at[0].get<double>(), at[1].get<double>(),
                      at[2].get<double>()));
    }
  }
  return 0;
}

}  // namespace

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
             "Length of forearm beyond the hand's own skin [mm]", kMillimetre);
  command->add_option("--unit", hand->unit, "Unit of the file: mm (default), cm or m")
      ->check(one_of({"mm", "cm", "m"}));
  finish_command(command, invocation, [hand](const Invocation& invoked) { return hand_command(*hand, invoked.flags); });
}

}  // namespace touchfield
