#include "sim/solve/previous_phases.h"

#include <algorithm>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/store/run_file.h"

namespace touchfield {

namespace {

Run read_previous(const MethodSpec& method) {
  try {
    return read_run_file(method.start.file);
  } catch (const Error& error) {
    throw InputError(fmt::format("start of {}: {}", method.name, error.what()));
  }
}

}  // namespace

Eigen::VectorXd previous_phases(const MethodSpec& method, Eigen::Index channels) {
  const StartSpec& start = method.start;
  const Run run = read_previous(method);
  auto found = std::ranges::find(run.methods, start.method.empty() ? method.name : start.method, &MethodResult::name);
  if (found == run.methods.end() && start.method.empty()) {
    found = run.methods.begin();
  }
  if (found == run.methods.end()) {
    throw InputError(fmt::format("start of {}: {} has no method {}", method.name, start.file,
                                 start.method.empty() ? "at all" : start.method));
  }
  if (found->solution.phases.size() != channels) {
    throw InputError(fmt::format("start of {}: {} has {} channels, the array here has {}", method.name, start.file,
                                 found->solution.phases.size(), channels));
  }
  return found->solution.phases;
}

}  // namespace touchfield
