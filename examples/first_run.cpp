// A scene that comes with the library is solved, and a metric of each method printed.
#include <cstdio>
#include <exception>

#include <touchfield/sim/core/program_start.h>
#include <touchfield/sim/run/solve_model.h>
#include <touchfield/sim/scene/scene_reader.h>

int main(int, char** argv) {
  touchfield::restart_with_better_settings(argv);
  try {
    const touchfield::Scene scene = touchfield::read_scene("quick", {"target.pressure_pa=3000"});
    const touchfield::Run run = touchfield::solve_model(touchfield::build_model(scene));
    for (const touchfield::MethodResult& method : run.methods) {
      std::printf("%s: relative error %.1f %%\n", method.name.c_str(), 100 * method.metrics.relative_error);
    }
  } catch (const std::exception& error) {
    std::fprintf(stderr, "first_run: %s\n", error.what());
    return 1;
  }
}
