#include <cstdlib>
#include <filesystem>
#include <memory>
#include <string>
#include <unistd.h>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <omp.h>

#include "apps/commands/command_line.h"
#include "apps/commands/commands.h"
#include "apps/commands/standard_streams.h"
#include "sim/core/json.h"
#include "sim/core/program_start.h"
#include "sim/core/text.h"
#include "sim/core/version.h"
#include "sim/gpu/gpu_library.h"
#include "sim/pictures/canvas.h"
#include "sim/run/archive_file.h"
#include "sim/run/estimates.h"
#include "sim/run/solver_choice.h"
#include "sim/scene/scene_reader.h"
#include "solvers/linear/instruction_level.h"

namespace touchfield {

namespace {

/// One line about this machine and installation.
struct Finding {
  std::string subject;  // "processor", "BLAS", "pictures", ...
  std::string state;    // what there is
  std::string advice;   // empty, or what makes runs slow or incomplete and how to mend it
};

constexpr double kGibibyte = 1024.0 * 1024.0 * 1024.0;

Finding processor() {
  Finding finding{"processor",
                  fmt::format("{}; loops for level {}", machine_description(), to_string(instruction_level())), ""};
  if (instruction_level() < processor_level()) {
    finding.advice = fmt::format("TOUCHFIELD_LEVEL keeps the loops below {}, the level of this processor: unset it",
                                 to_string(processor_level()));
  } else if (processor_level() < InstructionLevel::kV3) {
    finding.advice = "no AVX2: sums over faces take about four times as long as on processors since 2013";
  }
  return finding;
}

Finding blas() {
  Finding finding{"BLAS",
                  fmt::format("OpenBLAS, core {} (chosen by {}), threads by {}", blas_core(), blas_core_chosen_by(),
                              blas_threading()),
                  blas_warning()};
  if (const std::string better = better_blas_core(); finding.advice.empty() && !better.empty()) {
    finding.advice = fmt::format("OPENBLAS_CORETYPE asks for {}; {} is faster here: unset it", blas_core(), better);
  } else if (blas_threading() != "OpenMP") {
    finding.advice =
        "its threads compete with those of our own loops: install libopenblas0-openmp and choose it with "
        "update-alternatives --config libopenblas.so.0-x86_64-linux-gnu";
  }
  return finding;
}

Finding threads_of(int threads) {
  const auto set = [](const char* name) { return std::string(std::getenv(name) == nullptr ? "" : std::getenv(name)); };
  const std::string spins = set(kSpinsVariable);
  const std::string policy = set("OMP_WAIT_POLICY");
  const bool wait_long = spins.empty() && (policy.empty() || policy == "active" || policy == "ACTIVE");
  const int cores = omp_get_num_procs();  // that this process may use, as a batch system or a container says
  Finding finding{"threads",
                  fmt::format("{} on {} usable cores; a thread without work {}", threads, cores,
                              !spins.empty() ? fmt::format("looks for more {} times, then sleeps", spins)
                              : wait_long    ? "looks for more for milliseconds, then sleeps"
                                             : "sleeps at once"),
                  ""};
  if (finding.advice = binding_warning(threads); !finding.advice.empty()) {
    return finding;
  }
  if (threads > cores) {
    finding.advice = "more threads than cores wait for each other: use --threads or OMP_NUM_THREADS";
  } else if (threads < cores) {
    finding.advice =
        fmt::format("OMP_NUM_THREADS or --threads leaves {} idle", counted(cores - threads, "core", "cores"));
  } else if (wait_long) {
    finding.advice =
        fmt::format("with other programs running, a run may take ten times as long: set {}={} before it starts",
                    kSpinsVariable, kSpins);
  }
  return finding;
}

Finding speed() {
  const Speed& measured = measured_speed(kTimedRows);
  return {"speed", fmt::format("LU in double precision {:.1f} GFlop/s", measured.flops / 1e9), measured.note};
}

Finding memory() {
  const double total =
      static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGE_SIZE)) / kGibibyte;
  const double free = available_memory() / kGibibyte;
  Finding finding{"memory", fmt::format("{:.1f} GiB, {:.1f} GiB free", total, free), ""};
  if (free < 2.0) {
    finding.advice = "below 2 GiB a whole hand with all channels does not fit";
  }
  return finding;
}

Finding disk() {
  std::error_code error;
  const std::filesystem::path here = std::filesystem::current_path(error);
  const std::filesystem::space_info space = std::filesystem::space(here, error);
  if (error) {
    return {"disk", "unknown", fmt::format("the working directory cannot be read: {}", error.message())};
  }
  const double free = static_cast<double>(space.available) / kGibibyte;
  Finding finding{"disk", fmt::format("{:.1f} GiB free here", free), ""};
  if (access(here.c_str(), W_OK) != 0) {
    finding.advice = "the working directory cannot be written to: runs need -o";
  } else if (free < 1.0) {
    finding.advice = "a run with fields takes about 100 MB, a sweep the same per case";
  }
  return finding;
}

Finding libraries() {
  std::string state;
  for (const auto& [name, version] : library_versions()) {
    state += fmt::format("{}{} {}", state.empty() ? "" : ", ", name, version);
  }
  return {"libraries", state, ""};
}

Finding pictures() {
  const std::string font = picture_font();
  if (font.empty()) {
    return {"pictures", "no font", "text is drawn in simple strokes: install fonts-dejavu-core"};
  }
  return {"pictures", fmt::format("text in {}", font), ""};
}

Finding graphics_card() {
  const GpuLibrary& library = gpu_library();
  if (library.cards == 0) {
    return {"card", library.why_none, ""};
  }
  std::string state;
  for (int card = 0; card < library.cards; ++card) {
    const GpuInfo info = shared_gpu(card)->info();
    state += fmt::format("{}cuda:{} {}, {:.0f} GiB, driver for CUDA {}", card == 0 ? "" : "; ", card, info.name,
                         static_cast<double>(info.memory) / kGibibyte, info.driver);
  }
  return {"card", state, ""};
}

/// Examines everything that decides how fast and how completely runs work here. Hardware: processor and instruction
/// level, threads and cores, speed (an LU of about half a second), memory, disk, graphics card. Software: the program's
/// build, BLAS core and its threads, libraries, pictures (their font).
///
/// threads   in use
std::vector<Finding> examine_machine(int threads) {
  const BuildInfo build = build_info();
  const Finding program{
      "program",
      fmt::format("touchfield {} ({}), {}, {} build", build.version, build.revision, build.compiler, build.build_type),
      build.build_type == "Release" || build.build_type == "RelWithDebInfo"
          ? ""
          : "the build is not optimised: everything takes many times as long"};
  return {program,  processor(), blas(),          threads_of(threads), speed(),
          memory(), disk(),      graphics_card(), libraries(),         pictures()};
}

int doctor_command(const CommonFlags& flags) {
  const std::vector<Finding> findings = examine_machine(apply_threads(flags));
  if (flags.json) {
    nlohmann::ordered_json json = nlohmann::ordered_json::object();
    for (const Finding& finding : findings) {
      json[finding.subject] = {{"state", finding.state}, {"advice", finding.advice}};
    }
    put(json_text(json, 2) + "\n");
    return 0;
  }
  for (const Finding& finding : findings) {
    if (!flags.quiet || !finding.advice.empty()) {
      put(fmt::format("{:<10} {}{}{}\n", finding.subject, finding.state, finding.advice.empty() ? "" : " -- ",
                      finding.advice));
    }
  }
  return 0;
}

}  // namespace

void add_doctor_command(CLI::App& app, Invocation& invocation) {
  CLI::App* command =
      app.add_subcommand("doctor", "Check this machine for anything that makes runs slow or incomplete");
  finish_command(command, invocation, [](const Invocation& invoked) { return doctor_command(invoked.flags); });
}

void add_schema_command(CLI::App& app, Invocation& invocation) {
  const auto format = std::make_shared<std::string>("markdown");
  CLI::App* command = app.add_subcommand("schema", "Print the schema of scene files");
  const auto key = std::make_shared<std::string>();
  auto* form = command->add_option("--format", *format, "Format: markdown, or json for editors")
                   ->check(one_of({"markdown", "json"}))
                   ->capture_default_str();
  command->add_option("KEY", *key, "Print this key alone: solve.iterations, or the end of such a path")->excludes(form);
  command->callback([=, &invocation] {
    invocation.action = [=] {
      put(!key->empty() ? schema_text(*key) : *format == "json" ? schema_json() : schema_markdown());
      return 0;
    };
  });
}

}  // namespace touchfield
