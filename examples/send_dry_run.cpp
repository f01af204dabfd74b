// From a scene file to the frame that an array would get: the scene is solved, the run kept, and its last method's
// phases go through every check of `touchfield send` (level, time, layout, rounding) to the link `dry-run`, which
// writes them to a file. No device is touched. Another address, as docs/hardware.md lists them, is checked in the same
// way; to emit sound takes plan.emit and a guard, see hardware/emission/emission.h.
//
//   send_dry_run scenes/capsule.yaml run.h5 phases.txt
#include <cstdio>
#include <exception>
#include <string>

#include <touchfield/hardware/emission/emission.h>
#include <touchfield/sim/core/units.h>
#include <touchfield/sim/run/run_file.h>
#include <touchfield/sim/run/solve_model.h>
#include <touchfield/sim/scene/scene_reader.h>

namespace {

void send(const std::string& scene, const std::string& run_file, const std::string& phases_file) {
  touchfield::write_run_file(run_file, touchfield::solve_model(touchfield::build_model(touchfield::read_scene(scene))));

  const touchfield::Run run = touchfield::read_run_file(run_file);
  const touchfield::MethodResult& method = run.methods.back();
  touchfield::EmissionPlan plan;
  plan.device.link = "dry-run:" + phases_file;
  plan.array = touchfield::layout_of(run.array);
  plan.must_match = {run.array};
  plan.drives = [&](const touchfield::ArrayLayout&) {
    return std::vector<touchfield::Drive>{{method.solution.phases, method.solution.amplitudes}};
  };
  const touchfield::EmissionReport report = touchfield::emit(plan);

  std::printf("%s: %zu transducers, method %s, %g s at level %g\n", report.device.c_str(), report.transducers,
              method.name.c_str(), report.seconds, report.level);
  std::printf("phases off by %.3f degrees at worst; %s\n", report.quantisation.worst_phase_error / touchfield::kDegree,
              report.emitted ? "emitted" : "nothing emitted");
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "usage: send_dry_run SCENE RUN.h5 PHASES.txt\n");
    return 2;
  }
  try {
    send(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "send_dry_run: %s\n", error.what());
    return 1;
  }
}
