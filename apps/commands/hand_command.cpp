#include <memory>

#include <fmt/format.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/units.h"
#include "sim/hand/hand.h"
#include "sim/mesh/io/mesh_files.h"
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
