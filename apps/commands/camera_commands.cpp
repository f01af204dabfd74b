#include <memory>

#include "apps/commands/commands.h"
#include "apps/commands/job_console.h"
#include "sim/cameras/fit_folder.h"
#include "sim/cameras/see_scene.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

namespace {

struct SeeCommand {
  std::string scene;
  std::vector<std::string> overrides;  // key.path=value
  JobOutput output;
};

int see_command(const SeeCommand& command, const Invocation& invoked) {
  JobConsole console(invoked, "times.csv lists the frames that are whole; {} says that others are missing");
  const Scene scene = read_scene(command.scene, command.overrides);
  require_apart(command.output.directory, command.scene, scene);
  const SeenScene seen = seen_scene(scene, &console.progress());
  return console.finish(command.output, see_job(seen),
                        [&] { console.progress().note(first_log_line(scene.name, console.threads())); });
}

struct FitCommand {
  std::string folder;
  JobOutput output;
  std::string pose = "auto";
  std::string side = "auto";
  double length_mm = HandShape{}.length / kMillimetre;
  double breadth_mm = HandShape{}.breadth / kMillimetre;
  double edge_mm = 3;
  double learning = 1;
  std::vector<double> workspace_mm;  // two corners
};

FolderFit fit_of(const FitCommand& command) {
  FolderFit how;
  how.any_pose = command.pose == "auto";
  how.hand.pose = how.any_pose ? HandShape{}.pose : command.pose;
  how.any_side = command.side == "auto";
  how.hand.side = command.side == "left" ? HandSide::kLeft : HandSide::kRight;
  how.hand.length = command.length_mm * kMillimetre;
  how.hand.breadth = command.breadth_mm * kMillimetre;
  how.edge = command.edge_mm * kMillimetre;
  how.learning = command.learning;
  how.workspace = MotionSpec::Sensor{}.workspace;
  if (!command.workspace_mm.empty()) {
    for (std::size_t corner = 0; corner < 2; ++corner) {
      how.workspace[corner] = kMillimetre * Eigen::Map<const Vector3>(command.workspace_mm.data() + 3 * corner);
    }
    require((how.workspace[1] - how.workspace[0]).minCoeff() > 0,
            "--workspace-mm: the second corner must be beyond the first in x, y and z");
  }
  return how;
}

int fit_command(const FitCommand& command, const Invocation& invoked) {
  JobConsole console(invoked, "every mesh that was written is whole; {} says that others are missing");
  const FolderFit how = fit_of(command);
  require_apart(command.output.directory, {command.folder});
  const CameraFolder folder(command.folder, &console.progress());
  return console.finish(command.output, fit_job(folder, how),
                        [&] { console.progress().note(first_log_line(command.folder, console.threads())); });
}

}  // namespace

void add_see_command(CLI::App& app, Invocation& invocation) {
  const auto see = std::make_shared<SeeCommand>();
  CLI::App* command = app.add_subcommand("see", "Write the depth images of a scene's simulated cameras");
  command->add_option("SCENE", see->scene, "Scene file (YAML) with motion.sensor.cameras")
      ->required()
      ->type_name(kYamlFile);
  add_overrides(command, see->overrides);
  add_output(
      command, see->output,
      "Output directory, for sensor: {recorded: {folder}}; default: results/runs/NAME-NNNN, the next free number");
  finish_command(command, invocation, [see](const Invocation& invoked) { return see_command(*see, invoked); });
}

void add_fit_command(CLI::App& app, Invocation& invocation) {
  const auto fit = std::make_shared<FitCommand>();
  CLI::App* command =
      app.add_subcommand("fit", "Fit the built-in hand to recorded depth images; writes meshes over time");
  command->add_option("FOLDER", fit->folder, "Folder of depth images (docs/cameras.md)")
      ->required()
      ->type_name(kFolder);
  add_output(command, fit->output,
             "Output directory, for body: {meshes: {folder, times, unit: m}}; default: results/runs/fit-NNNN, "
             "the next free number");
  std::vector<std::string> poses = hand_poses();
  poses.emplace_back("auto");
  command->add_option("--pose", fit->pose, "Pose of the fingers; auto: index_up or flat, whichever fits better")
      ->check(one_of(poses))
      ->capture_default_str();
  command->add_option("--side", fit->side, "Which hand; auto: whichever fits better")
      ->check(one_of({"right", "left", "auto"}))
      ->capture_default_str();
  add_number(command, "--length-mm", fit->length_mm, schema::between(120, 260),
             "Length of the hand before its shape is learnt [mm]");
  add_number(command, "--breadth-mm", fit->breadth_mm, schema::between(50, 150),
             "Breadth of the hand before its shape is learnt [mm]");
  add_number(command, "--edge-mm", fit->edge_mm,
             schema::between(kLeastHandEdge / kMillimetre, kMostHandEdge / kMillimetre),
             "Edge length of the meshes [mm]");
  add_number(command, "--learn-s", fit->learning, schema::between(0, 60),
             "Time from which the shape is learnt [s]; 0: it is not learnt");
  add_numbers(command, "--workspace-mm", fit->workspace_mm, {},
              "Two corners of the box in which the hand is searched: least x, y, z and largest [mm]")
      ->expected(6);
  finish_command(command, invocation, [fit](const Invocation& invoked) { return fit_command(*fit, invoked); });
}

}  // namespace touchfield
