#include "sim/core/program_start.h"

#include <algorithm>
#include <array>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <limits>
#include <mutex>
#include <sched.h>
#include <stdexcept>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>
#include <vector>

#include <cblas.h>
#include <fmt/format.h>
#include <omp.h>

#include "sim/core/require.h"
#include "sim/core/text.h"
#include "solvers/linear/instruction_level.h"

// What OpenBLAS takes its buffers by, and chooses its kernels by; not there in every build of it.
extern "C" {
void* blas_memory_alloc(int kind) __attribute__((weak));  // NOLINTBEGIN(readability-identifier-naming): OpenBLAS' names
void blas_memory_free(void* buffer) __attribute__((weak));
void gotoblas_dynamic_init() __attribute__((weak));
void gotoblas_dynamic_quit() __attribute__((weak));  // NOLINTEND(readability-identifier-naming)
}

namespace touchfield {

namespace {

constexpr const char* kThreadsVariable = "OMP_NUM_THREADS";
constexpr const char* kCoreVariable = "OPENBLAS_CORETYPE";
constexpr const char* kChosenByUs = "TOUCHFIELD_BLAS_CORE";  // what this program has set it to
constexpr std::uint64_t kBuffer = std::uint64_t{128} << 20;  // of OpenBLAS, each
constexpr int kMostBlasThreads = 128;                        // more no usual build of it has

std::string value_of(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

/// Whose instructions the kernels of a core use.
InstructionLevel level_of(const std::string& core) {
  const auto is_one_of = [&](auto... names) { return (... || (core == names)); };
  return is_one_of("SapphireRapids", "Cooperlake", "SkylakeX") ? InstructionLevel::kV4
         : is_one_of("Haswell", "Zen", "Excavator")            ? InstructionLevel::kV3
                                                               : InstructionLevel::kGeneric;
}

std::uint64_t soft_limit(__rlimit_resource_t resource) {
  rlimit limit{};
  return getrlimit(resource, &limit) == 0 ? limit.rlim_cur : RLIM_INFINITY;
}

/// The limit on this process's memory as a shell sets it, "ulimit -v 400000"; empty if there is none.
std::string memory_limit() {
  const std::uint64_t space = soft_limit(RLIMIT_AS);
  const std::uint64_t data = soft_limit(RLIMIT_DATA);
  const std::uint64_t least = std::min(space, data);
  return least == RLIM_INFINITY ? "" : fmt::format("ulimit -{} {}", space <= data ? 'v' : 'd', least / 1024);
}

/// Address space of this process [bytes]; 0 if unknown.
std::uint64_t address_space() {
  std::uint64_t pages = 0;
  std::ifstream("/proc/self/statm") >> pages;
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Whether the system gives OpenBLAS so many buffers.
bool fits(int buffers) {
  const std::size_t size = static_cast<std::size_t>(buffers) * kBuffer;
  void* block = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
  return block != MAP_FAILED && munmap(block, size) == 0;
}

/// buffers  that are still to be taken
std::string no_room_for_blas(int buffers) {
  constexpr std::uint64_t kRound = 100'000;
  const std::string limit = memory_limit();
  const std::uint64_t wanted = address_space() + static_cast<std::uint64_t>(buffers + 2) * kBuffer;  // 2: a scene
  return fmt::format(
      "{} leaves OpenBLAS no room for its buffers, 128 MiB of address space per thread: {}use fewer "
      "threads, as by {}=1",
      limit.empty() ? "the system" : "`" + limit + "`",
      limit.empty() ? "" : fmt::format("raise the limit to {} or more, or ", (wanted / 1024 / kRound + 1) * kRound),
      kThreadsVariable);
}

/// How many threads OpenBLAS was built for.
int most_blas_threads() {
  const char* said = std::strstr(openblas_get_config(), "MAX_THREADS=");
  const int most = said == nullptr ? 0 : std::atoi(std::strchr(said, '=') + 1);
  return most > 0 ? most : kMostBlasThreads;
}

}  // namespace

void restart_with_better_settings(char** argv) {
  const bool waits = value_of("OMP_WAIT_POLICY").empty() && value_of(kSpinsVariable).empty();
  const bool chooses = value_of(kCoreVariable).empty() && value_of(kChosenByUs).empty();
  const std::string better = chooses ? better_blas_core() : "";
  if (waits) {
    setenv(kSpinsVariable, std::to_string(kSpins).c_str(), 1);
  }
  for (const char* name : {kChosenByUs, kCoreVariable}) {
    if (!better.empty()) {
      setenv(name, better.c_str(), 1);
    }
  }
  if (waits || !better.empty()) {
    restore_processors();
    std::error_code none;
    ::execv(std::filesystem::read_symlink("/proc/self/exe", none).c_str(), argv);
  }
}

void restore_processors() {
  cpu_set_t set;
  CPU_ZERO(&set);
  for (int place = 0; place < omp_get_num_places(); ++place) {
    std::array<int, CPU_SETSIZE> numbers;
    omp_get_place_proc_ids(place, numbers.data());
    std::for_each_n(numbers.begin(), omp_get_place_num_procs(place),
                    [&](int number) { CPU_SET(static_cast<std::size_t>(number), &set); });
  }
  if (CPU_COUNT(&set) > 0) {  // none: nobody is bound
    sched_setaffinity(0, sizeof set, &set);
  }
}

std::string binding_warning(int threads) {
  const int places = omp_get_proc_bind() == omp_proc_bind_master ? 1 : omp_get_num_places();
  int processors = 0;
  for (int place = 0; place < std::min(places, omp_get_num_places()); ++place) {
    processors += omp_get_place_num_procs(place);
  }
  if (processors == 0 || threads <= processors) {
    return "";
  }
  return fmt::format(
      "{} threads are bound to {}: unset OMP_PROC_BIND, OMP_PLACES and GOMP_CPU_AFFINITY, or set OMP_PROC_BIND=close",
      threads, counted(processors, "processor", "processors"));
}

void require_sound_variables() {
  require(std::min(omp_get_max_threads(), omp_get_thread_limit()) <= kMostThreads, "{} = '{}' must be 1 to {}",
          kThreadsVariable, value_of(kThreadsVariable), kMostThreads);
  const InstructionLevel needed = level_of(blas_core());
  require(needed <= processor_level() || blas_core_chosen_by() != kCoreVariable,
          "{} = '{}' needs instructions of level {}, which this processor lacks: unset it", kCoreVariable,
          value_of(kCoreVariable), to_string(needed));
}

std::string blas_core() { return openblas_get_corename(); }

std::string blas_core_chosen_by() {
  const std::string chosen = value_of(kCoreVariable);
  return chosen.empty() ? "OpenBLAS" : chosen == value_of(kChosenByUs) ? "touchfield" : kCoreVariable;
}

std::string better_blas_core() {
#ifdef __x86_64__
  // AMD's kernels of 256 bits are its own library's choice on its processors with AVX-512 too.
  const InstructionLevel widest = __builtin_cpu_is("intel") != 0 ? InstructionLevel::kV4 : InstructionLevel::kV3;
  const InstructionLevel level = std::min(processor_level(), widest);
  if (level >= InstructionLevel::kV3 && level > level_of(blas_core())) {
    return level == InstructionLevel::kV4 ? "SkylakeX" : "Haswell";
  }
#endif
  return "";
}

std::string blas_warning() {
  const std::string better = better_blas_core();
  if (better.empty() || blas_core_chosen_by() == kCoreVariable) {
    return "";
  }
  return fmt::format("OpenBLAS runs slow kernels for '{}': set {}={} before the program starts", blas_core(),
                     kCoreVariable, better);
}

void take_better_blas_core() {
  const std::string better = better_blas_core();
  if (better.empty() || !value_of(kCoreVariable).empty() || gotoblas_dynamic_init == nullptr) {
    return;
  }
  setenv(kCoreVariable, better.c_str(), 1);
  gotoblas_dynamic_quit();
  gotoblas_dynamic_init();
  unsetenv(kCoreVariable);  // processes that are started from here choose for themselves
}

std::string blas_threading() {
  const int kind = openblas_get_parallel();
  return kind == OPENBLAS_OPENMP ? "OpenMP" : kind == OPENBLAS_THREAD ? "pthreads" : "none";
}

std::string missing_room(char** environment) {
  if (const std::uint64_t stack = soft_limit(RLIMIT_STACK); stack < std::uint64_t{1} << 20) {
    return fmt::format("`ulimit -s {}` leaves too small a stack: raise the limit to 8192", stack / 1024);
  }
  environ = environment;  // where the system's library has not started yet
  cpu_set_t set;
  const int processors = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : kMostBlasThreads;
  const int asked = std::atoi(value_of(kThreadsVariable).c_str());
  const int threads = std::min(asked > 0 ? asked : processors, kMostBlasThreads);
  // When it is loaded OpenBLAS has no more threads than there are processors.
  return fits(std::min(threads, processors) + 1) ? "" : no_room_for_blas(2 * threads);
}

void take_blas_buffers(int threads) {
  static std::mutex mutex;
  static const int held = openblas_get_num_threads();
  static int taken = held;
  const std::lock_guard lock(mutex);
  // A buffer of each thread's own, and one of each that calls from a loop. OpenBLAS keeps those that are given back.
  const int wanted = 2 * std::min(threads, most_blas_threads());
  if (wanted <= taken || memory_limit().empty() || blas_memory_alloc == nullptr || blas_memory_free == nullptr) {
    return;
  }
  const int others = 1 + threads / 16;  // stacks of the threads, and everything else
  if (!fits(wanted - taken + others)) {
    throw std::runtime_error(no_room_for_blas(wanted - taken + others));
  }
  std::vector<void*> buffers;
  for (int i = held; i < wanted; ++i) {
    buffers.push_back(blas_memory_alloc(0));
  }
  std::ranges::for_each(buffers, blas_memory_free);
  taken = wanted;
}

double memory_below_limit() {
  const std::uint64_t limit = std::min(soft_limit(RLIMIT_AS), soft_limit(RLIMIT_DATA));
  return limit == RLIM_INFINITY ? std::numeric_limits<double>::infinity()
                                : static_cast<double>(limit - std::min(limit, address_space()));
}

std::string out_of_memory() {
  const std::string limit = memory_limit();
  return limit.empty() ? "out of memory" : "out of memory under `" + limit + "`: raise the limit";
}

}  // namespace touchfield
