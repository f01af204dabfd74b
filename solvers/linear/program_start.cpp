#include "solvers/linear/program_start.h"

#include <array>
#include <cstdlib>
#include <malloc.h>
#include <unistd.h>
#include <utility>
#include <vector>

#include <climits>

#include "solvers/linear/blas_core.h"
#include "solvers/linear/environment.h"

namespace touchfield {

namespace {

constexpr const char* kPolicyVariable = "OMP_WAIT_POLICY";

}  // namespace

void restart_with_better_settings(char** argv) {
  std::vector<std::pair<const char*, std::string>> settings;
  if (environment_value(kPolicyVariable).empty() && environment_value(kSpinsVariable).empty()) {
    settings.emplace_back(kSpinsVariable, std::to_string(kSpins));
  }
  const std::string better = better_blas_core();
  if (!better.empty() && environment_value(kBlasCoreVariable).empty() && environment_value(kChosenByUs).empty()) {
    settings.emplace_back(kChosenByUs, better);
    settings.emplace_back(kBlasCoreVariable, better);
  }
  std::array<char, PATH_MAX> self{};
  if (settings.empty() || ::readlink("/proc/self/exe", self.data(), self.size() - 1) <= 0) {
    return;
  }
  for (const auto& [name, value] : settings) {
    setenv(name, value.c_str(), 1);
  }
  ::execv(self.data(), argv);
  for (const auto& [name, value] : settings) {
    unsetenv(name);  // what its children inherit is what the user has set
  }
}

void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 1 << 30);
  mallopt(M_TRIM_THRESHOLD, -1);  // never
}

bool threads_wait_long() {
  const std::string policy = environment_value(kPolicyVariable);
  return environment_value(kSpinsVariable).empty() && (policy.empty() || policy == "active" || policy == "ACTIVE");
}

std::string thread_waiting() {
  if (const std::string spins = environment_value(kSpinsVariable); !spins.empty()) {
    return "look " + spins + " times, then sleep";
  }
  return threads_wait_long() ? "look for milliseconds, then sleep" : "sleep at once";
}

}  // namespace touchfield
