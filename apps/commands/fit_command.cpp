#include <cmath>
#include <memory>

#include <fmt/format.h>

#include "apps/commands/claimed_directory.h"
#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/console_progress.h"
#include "apps/commands/standard_streams.h"
#include "sim/cameras/fit_folder.h"
#include "sim/core/require.h"
#include "sim/core/units.h"
#include "sim/run/motion_summary.h"

namespace touchfield {

namespace {

struct FitCommand {
  std::string folder;
  std::string output;  // empty: results/runs/NAME-NNNN
  bool force = false;
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

Json fit_value(const FittedFolder& fitted, const std::string& directory) {
  std::vector<double> residuals;
  std::vector<double> seen;
  std::vector<double> times;
  for (const FittedFrame& frame : fitted.frames) {
    times.push_back(frame.milliseconds);
    if (!frame.fit.lost) {
      residuals.push_back(frame.fit.residual / kMillimetre);
      seen.push_back(frame.fit.seen);
    }
  }
  return {{"directory", directory},
          {"frames", fitted.frames.size()},
          {"lost", fitted.frames.size() - residuals.size()},
          {"pose", fitted.hand.pose},
          {"side", side_name(fitted.hand.side)},
          {"shape_learnt", fitted.learnt},
          {"length_ratio", std::exp(fitted.proportions(kLengthRatio))},
          {"breadth_ratio", std::exp(fitted.proportions(kBreadthRatio))},
          {"residual_mm_median", statistics(residuals).median},
          {"seen_median", statistics(seen).median},
          {"fit_ms_p95", statistics(times).p95},
          {"warnings", fitted.warnings}};
}

int fit_command(const FitCommand& command, const Invocation& invoked) {
  const CommonFlags& flags = invoked.flags;
  ClaimedDirectory claimed("every mesh that was written is whole; {} says that others are missing");
  const int threads = apply_threads(flags);
  ConsoleProgress progress(flags);
  const FolderFit how = fit_of(command);
  require_apart(command.output, {command.folder});
  const CameraFolder folder(command.folder, &progress);
  RunDirectory& directory = claimed.claim(command.output, command.force, "fit", fit_files(folder));
  claimed.fill(progress, [&] {
    progress.log_to(directory.file("fit.log"));
    progress.note(first_log_line(command.folder, threads));
    const FittedFolder fitted = fit_folder(folder, how, directory, progress);
    directory.publish();
    progress.note(fmt::format("meshes in {}", directory.path()));
    print_value(fit_value(fitted, directory.path()), flags, true);
  });
  return 0;
}

}  // namespace

void add_fit_command(CLI::App& app, Invocation& invocation) {
  const auto fit = std::make_shared<FitCommand>();
  CLI::App* command =
      app.add_subcommand("fit", "Fit the built-in hand to recorded depth images; writes meshes over time");
  command->add_option("FOLDER", fit->folder, "Folder of depth images (docs/cameras.md)")
      ->required()
      ->type_name(kFolder);
  command
      ->add_option("-o,--output", fit->output,
                   "Output directory, for body: {meshes: {folder, times, unit: m}}; default: results/runs/fit-NNNN, "
                   "the next free number")
      ->type_name(kFolder);
  command->add_flag("--force", fit->force, "Replace the run that the output directory holds");
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
