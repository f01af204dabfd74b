#include "solvers/linear/blas_core.h"

#include <cstdlib>
#include <map>

#include <cblas.h>

#include "solvers/linear/instruction_level.h"
#include "solvers/linear/program_start.h"

// What OpenBLAS chooses its kernels by when it is loaded; not there where it has those of one processor only.
extern "C" {
void gotoblas_dynamic_init() __attribute__((weak));  // NOLINT(readability-identifier-naming): OpenBLAS' own name
void gotoblas_dynamic_quit() __attribute__((weak));
}

namespace touchfield {

namespace {

/// What the kernels of a core need of a processor: 4 AVX-512, 3 AVX2 and FMA, 2 AVX, 1 less (those not named).
int kernel_rank(const std::string& core) {
  static const std::map<std::string, int> kRanks = {
      {"SkylakeX", 4},  {"Cooperlake", 4},  {"SapphireRapids", 4}, {"Haswell", 3},    {"Zen", 3},
      {"Excavator", 3}, {"Sandybridge", 2}, {"Bulldozer", 2},      {"Piledriver", 2}, {"Steamroller", 2}};
  const auto found = kRanks.find(core);
  return found == kRanks.end() ? 1 : found->second;
}

}  // namespace

std::string blas_core() { return openblas_get_corename(); }

std::string better_blas_core(const std::string& core, bool avx, bool avx2, bool wide) {
  const std::string fitting = wide ? "SkylakeX" : avx2 ? "Haswell" : avx ? "Sandybridge" : core;
  return kernel_rank(fitting) > kernel_rank(core) ? fitting : "";
}

std::string better_blas_core() {
#ifdef __x86_64__
  const InstructionLevel level = processor_level();
  // AMD's kernels of 256 bits are its own library's choice on its processors with AVX-512 too.
  const bool wide = level >= InstructionLevel::kV4 && __builtin_cpu_is("intel") != 0;
  return better_blas_core(blas_core(), __builtin_cpu_supports("avx") != 0, level >= InstructionLevel::kV3, wide);
#else
  return "";
#endif
}

std::string blas_core_chosen_by() {
  const std::string chosen = environment_value(kBlasCoreVariable);
  if (chosen.empty()) {
    return "OpenBLAS";
  }
  return chosen == environment_value(kChosenByUs) ? "touchfield" : kBlasCoreVariable;
}

std::string blas_warning() {
  const std::string better = better_blas_core();
  if (better.empty() || blas_core_chosen_by() == kBlasCoreVariable) {
    return "";
  }
  return "OpenBLAS runs its kernels for '" + blas_core() + "', much slower than this processor allows: set " +
         kBlasCoreVariable + "=" + better + " before the program starts";
}

void take_better_blas_core() {
  const std::string better = better_blas_core();
  if (better.empty() || !environment_value(kBlasCoreVariable).empty() || gotoblas_dynamic_init == nullptr ||
      gotoblas_dynamic_quit == nullptr) {
    return;
  }
  setenv(kBlasCoreVariable, better.c_str(), 1);
  gotoblas_dynamic_quit();
  gotoblas_dynamic_init();
  unsetenv(kBlasCoreVariable);  // processes that are started from here choose for themselves
}

std::string blas_threading() {
  switch (openblas_get_parallel()) {
    case OPENBLAS_OPENMP:
      return "OpenMP";
    case OPENBLAS_THREAD:
      return "pthreads";
    default:
      return "none";
  }
}

}  // namespace touchfield
