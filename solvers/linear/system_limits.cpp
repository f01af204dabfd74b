#include "solvers/linear/system_limits.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>
#include <limits>
#include <mutex>
#include <sched.h>
#include <stdexcept>
#include <string_view>
#include <sys/mman.h>
#include <sys/resource.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <cblas.h>
#include <omp.h>

#include "solvers/linear/blas_core.h"
#include "solvers/linear/environment.h"

// What OpenBLAS takes and gives back its buffers by; not there in every build of it.
extern "C" {
void* blas_memory_alloc(int kind) __attribute__((weak));    // NOLINT(readability-identifier-naming): OpenBLAS' own name
void blas_memory_free(void* buffer) __attribute__((weak));  // NOLINT(readability-identifier-naming)
}

namespace touchfield {

namespace {

constexpr std::uint64_t kMebibyte = std::uint64_t{1} << 20;
constexpr std::uint64_t kBuffer = 128 * kMebibyte;  // of OpenBLAS, each
constexpr int kMostBlasThreads = 128;               // more no usual build of it has
constexpr std::uint64_t kLeastStack = kMebibyte;
constexpr std::uint64_t kOther = 256 * kMebibyte;  // for a small scene
constexpr const char* kThreadsVariable = "OMP_NUM_THREADS";

std::uint64_t soft_limit(__rlimit_resource_t resource) {
  rlimit limit{};
  return getrlimit(resource, &limit) == 0 ? limit.rlim_cur : RLIM_INFINITY;
}

/// Address space of this process [bytes]; 0 if unknown.
std::uint64_t own_size() {
  std::uint64_t pages = 0;
  if (std::FILE* file = std::fopen("/proc/self/statm", "r")) {
    if (std::fscanf(file, "%lu", &pages) != 1) {
      pages = 0;
    }
    std::fclose(file);
  }
  return pages * static_cast<std::uint64_t>(sysconf(_SC_PAGESIZE));
}

/// Of a thread that is started.
std::uint64_t stack_size() {
  const std::uint64_t limit = soft_limit(RLIMIT_STACK);
  return limit == RLIM_INFINITY ? 2 * kMebibyte : limit;
}

/// Whether the system gives so many buffers and stacks, as OpenBLAS and OpenMP ask for them.
bool fits(int buffers, int stacks) {
  std::vector<std::pair<void*, std::size_t>> taken;
  for (int i = 0; i < buffers + stacks; ++i) {
    const std::size_t size = i < buffers ? kBuffer : stack_size();
    void* block = mmap(nullptr, size, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (block == MAP_FAILED) {
      break;
    }
    taken.emplace_back(block, size);
  }
  for (const auto& [block, size] : taken) {
    munmap(block, size);
  }
  return std::ssize(taken) == buffers + stacks;
}

/// buffers  that are still to be taken
std::string no_room_for_blas(int threads, int buffers) {
  const std::string limit = memory_limit();
  const std::string fewer = threads > 1 ? std::string(", or use fewer threads, as by ") + kThreadsVariable + "=1" : "";
  if (limit.empty()) {
    return "the system refuses OpenBLAS its buffers, 128 MiB of address space per thread: free memory" + fewer;
  }
  constexpr std::uint64_t kRound = 100'000;
  const std::uint64_t wanted = (own_size() + static_cast<std::uint64_t>(buffers) * kBuffer +
                                static_cast<std::uint64_t>(threads) * stack_size() + kOther) /
                               1024;
  return "`" + limit +
         "` leaves OpenBLAS no room for its buffers, 128 MiB of address space per thread: raise the limit to " +
         std::to_string((wanted / kRound + 1) * kRound) + " or more" + fewer;
}

const char* value_in(const char* const* environment, const char* name) {
  const std::size_t length = std::strlen(name);
  for (; *environment != nullptr; ++environment) {
    if (std::strncmp(*environment, name, length) == 0 && (*environment)[length] == '=') {
      return *environment + length + 1;
    }
  }
  return nullptr;
}

/// How many threads OpenBLAS was built for.
int most_blas_threads() {
  constexpr const char* kName = "MAX_THREADS=";
  const char* said = std::strstr(openblas_get_config(), kName);
  const int most = said == nullptr ? 0 : std::atoi(said + std::strlen(kName));
  return most > 0 ? std::min(most, kMostBlasThreads) : kMostBlasThreads;
}

/// The number above 0 that the first of these variables has which has one; `otherwise` if none has.
int number_in(const char* const* environment, std::initializer_list<const char*> names, int otherwise) {
  for (const char* name : names) {
    const char* value = value_in(environment, name);
    if (const int number = value == nullptr ? 0 : std::atoi(value); number > 0) {
      return number;
    }
  }
  return otherwise;
}

/// The largest number of a list such as "4,2".
long largest_of(const std::string& list) {
  long largest = 0;
  for (std::size_t at = 0; at < list.size(); at = std::min(list.find(',', at), list.size() - 1) + 1) {
    largest = std::max(largest, std::strtol(list.c_str() + at, nullptr, 10));
  }
  return largest;
}

/// Of a text such as "512", in KiB, or "2 M".
double stack_bytes(const std::string& text) {
  char* end = nullptr;
  const double number = std::strtod(text.c_str(), &end);
  const std::string_view units = "BKMG";
  const std::size_t at = std::string_view(end).find_first_not_of(' ');
  const char unit = at == std::string_view::npos ? 'K' : static_cast<char>(std::toupper(end[at]));
  return number * std::pow(1024.0, static_cast<double>(std::min(units.find(unit), units.size())));
}

}  // namespace

std::string missing_room(const char* const* environment) {
  if (const std::uint64_t stack = soft_limit(RLIMIT_STACK); stack < kLeastStack) {
    return "`ulimit -s " + std::to_string(stack / 1024) + "` leaves too small a stack: raise the limit to 8192";
  }
  cpu_set_t set;
  CPU_ZERO(&set);
  const int processors = sched_getaffinity(0, sizeof set, &set) == 0 ? CPU_COUNT(&set) : kMostBlasThreads;
  const int threads = std::min(number_in(environment, {kThreadsVariable}, processors), kMostBlasThreads);
  // When it is loaded OpenBLAS has no more threads than there are processors.
  const int asked = number_in(environment, {"OPENBLAS_NUM_THREADS", "GOTO_NUM_THREADS"}, threads);
  return fits(std::min({asked, processors, kMostBlasThreads}) + 1, 0) ? "" : no_room_for_blas(threads, 2 * threads);
}

void take_blas_buffers(int threads) {
  static std::mutex mutex;
  static int taken = 0;
  const std::lock_guard lock(mutex);
  const int stacks = threads;  // OpenMP starts them all, whatever OpenBLAS was built for
  threads = std::min(threads, most_blas_threads());
  if (threads <= taken || memory_limit().empty() || blas_memory_alloc == nullptr || blas_memory_free == nullptr) {
    return;
  }
  // A buffer of each thread's own, and one of each that calls from a loop. OpenBLAS keeps those that are given back.
  const int held = openblas_get_num_threads();
  const int more = 2 * (threads - taken) - (taken == 0 ? held : 0);
  if (!fits(more + 1, stacks)) {  // one that stays free, for everything else
    throw std::runtime_error(no_room_for_blas(stacks, more));
  }
  std::vector<void*> buffers;
  for (int i = held; i < 2 * threads; ++i) {
    buffers.push_back(blas_memory_alloc(0));
  }
  std::ranges::for_each(buffers, blas_memory_free);
  taken = threads;
}

std::string memory_limit() {
  const std::uint64_t space = soft_limit(RLIMIT_AS);
  const std::uint64_t data = soft_limit(RLIMIT_DATA);
  if (std::min(space, data) == RLIM_INFINITY) {
    return "";
  }
  return (space <= data ? "ulimit -v " : "ulimit -d ") + std::to_string(std::min(space, data) / 1024);
}

double memory_below_limit() {
  const std::uint64_t limit = std::min(soft_limit(RLIMIT_AS), soft_limit(RLIMIT_DATA));
  if (limit == RLIM_INFINITY) {
    return std::numeric_limits<double>::infinity();
  }
  return static_cast<double>(limit - std::min(limit, own_size()));
}

std::string out_of_memory() {
  const std::string limit = memory_limit();
  return limit.empty() ? "out of memory" : "out of memory under `" + limit + "`: raise the limit";
}

void require_sound_variables() {
  const std::string threads = environment_value(kThreadsVariable);
  if (std::min<long>(largest_of(threads), omp_get_thread_limit()) > kMostThreads) {
    throw std::invalid_argument(std::string(kThreadsVariable) + " = '" + threads + "' must be 1 to " +
                                std::to_string(kMostThreads));
  }
  for (const char* name : {"OMP_STACKSIZE", "GOMP_STACKSIZE"}) {
    const std::string size = environment_value(name);
    if (const double bytes = stack_bytes(size); bytes > 0 && bytes < static_cast<double>(kLeastStack)) {
      throw std::invalid_argument(std::string(name) + " = '" + size + "' must be 1M or more");
    }
  }
  const std::string lacking = blas_core_chosen_by() == kBlasCoreVariable ? lacking_instructions(blas_core()) : "";
  if (!lacking.empty()) {
    throw std::invalid_argument(std::string(kBlasCoreVariable) + " = '" + environment_value(kBlasCoreVariable) +
                                "' needs " + lacking + ", which this processor lacks: unset it");
  }
}

}  // namespace touchfield
