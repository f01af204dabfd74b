#include "solvers/linear/blas_core.h"

#include <algorithm>
#include <cstdlib>
#include <strings.h>

#include <cblas.h>
#ifdef __x86_64__
#include <cpuid.h>
#endif

#include "solvers/linear/environment.h"
#include "solvers/linear/processor_level.h"

// What OpenBLAS chooses its kernels by when it is loaded; not there where it has those of one processor only.
extern "C" {
void gotoblas_dynamic_init() __attribute__((weak));  // NOLINT(readability-identifier-naming): OpenBLAS' own name
void gotoblas_dynamic_quit() __attribute__((weak));
}

namespace touchfield {

namespace {

/// Instructions that kernels of OpenBLAS use beyond those that every processor of 64 bits has.
enum class Needs { kNothing, kSsse3, kSse41, kSse42, kSse4a, k3dNow, kAvx, kFma4, kAvx2, kAvx512, kAvx512Bf16 };

struct Kernels {
  const char* core;
  int rank;  // by the width of their registers: 3 AVX-512, 2 AVX2 and FMA, 1 AVX, 0 less, as cores not named here
  Needs needs;
};

constexpr Kernels kKernels[] = {{"SapphireRapids", 3, Needs::kAvx512Bf16},
                                {"Cooperlake", 3, Needs::kAvx512Bf16},
                                {"SkylakeX", 3, Needs::kAvx512},
                                {"Haswell", 2, Needs::kAvx2},
                                {"Zen", 2, Needs::kAvx2},
                                {"Excavator", 2, Needs::kFma4},
                                {"Steamroller", 1, Needs::kFma4},
                                {"Piledriver", 1, Needs::kFma4},
                                {"Bulldozer", 1, Needs::kFma4},
                                {"Sandybridge", 1, Needs::kAvx},
                                {"Bobcat", 0, Needs::kSse4a},
                                {"Barcelona", 0, Needs::kSse4a},
                                {"Opteron_SSE3", 0, Needs::k3dNow},
                                {"Opteron", 0, Needs::k3dNow},
                                {"Nehalem", 0, Needs::kSse42},
                                {"Dunnington", 0, Needs::kSse41},
                                {"Penryn", 0, Needs::kSse41},
                                {"Core2", 0, Needs::kSsse3},
                                {"Atom", 0, Needs::kSsse3}};

Kernels kernels_of(const std::string& core) {
  const auto* found = std::ranges::find_if(kKernels, [&](const Kernels& kernels) { return core == kernels.core; });
  return found == std::end(kKernels) ? Kernels{core.c_str(), 0, Needs::kNothing} : *found;
}

#ifdef __x86_64__
bool has_3dnow() {
  unsigned int a = 0;
  unsigned int b = 0;
  unsigned int c = 0;
  unsigned int d = 0;
  return __get_cpuid(0x80000001U, &a, &b, &c, &d) != 0 && (d >> 31) != 0;
}

/// The name of these instructions where the processor or its operating system does not carry them out.
std::string lacking(Needs needs) {
  __builtin_cpu_init();
  const auto unless = [](int has, const char* name) { return has != 0 ? std::string() : std::string(name); };
  switch (needs) {
    case Needs::kNothing:
      return "";
    case Needs::kSsse3:
      return unless(__builtin_cpu_supports("ssse3"), "SSSE3");
    case Needs::kSse41:
      return unless(__builtin_cpu_supports("sse4.1"), "SSE4.1");
    case Needs::kSse42:
      return unless(__builtin_cpu_supports("sse4.2"), "SSE4.2");
    case Needs::kSse4a:
      return unless(__builtin_cpu_supports("sse4a"), "SSE4a");
    case Needs::k3dNow:
      return unless(has_3dnow(), "3DNow!");
    case Needs::kAvx:
      return unless(__builtin_cpu_supports("avx"), "AVX");
    case Needs::kFma4:
      return unless(__builtin_cpu_supports("fma4"), "FMA4");
    case Needs::kAvx2:
      return unless(processor_level() >= InstructionLevel::kV3, "AVX2 and FMA");
    case Needs::kAvx512:
      return unless(processor_level() >= InstructionLevel::kV4, "AVX-512");
    case Needs::kAvx512Bf16:
      return unless(processor_level() >= InstructionLevel::kV4 && __builtin_cpu_supports("avx512bf16") != 0,
                    "AVX-512 with bfloat16");
  }
  return "";
}
#else
std::string lacking(Needs /*needs*/) { return ""; }
#endif

}  // namespace

std::string blas_core() { return openblas_get_corename(); }

std::string better_blas_core(const std::string& core, bool avx, bool avx2, bool wide) {
  const std::string fitting = wide ? "SkylakeX" : avx2 ? "Haswell" : avx ? "Sandybridge" : core;
  return kernels_of(fitting).rank > kernels_of(core).rank ? fitting : "";
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

std::string lacking_instructions(const std::string& core) { return lacking(kernels_of(core).needs); }

std::string blas_warning() {
  const std::string asked = environment_value(kBlasCoreVariable);
  if (blas_core_chosen_by() == kBlasCoreVariable && strcasecmp(asked.c_str(), blas_core().c_str()) != 0) {
    return std::string(kBlasCoreVariable) + " = '" + asked +
           "' names no kernels that this OpenBLAS has; it runs those for '" + blas_core() + "': unset it";
  }
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
