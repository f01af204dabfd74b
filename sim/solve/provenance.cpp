#include "sim/solve/provenance.h"

#include "sim/core/version.h"
#include "solvers/linear/blas_core.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

Provenance provenance_now(int threads, const std::string& seeds, const std::string& command_line,
                          const std::string& scene_hash) {
  const BuildInfo build = build_info();
  return {.version = build.version,
          .revision = build.revision,
          .compiler = build.compiler,
          .flags = build.flags,
          .machine = machine_description(),
          .blas_core = blas_core(),
          .instruction_level = to_string(instruction_level()),
          .threads = threads,
          .seeds = seeds,
          .command_line = command_line,
          .start = utc_now(),
          .end = "",
          .scene_hash = scene_hash};
}

}  // namespace touchfield
