#include "sim/solve/named_files.h"

#include <functional>
#include <set>
#include <string>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/scene/scene_reader.h"
#include "sim/solve/meshed_body.h"
#include "sim/solve/model.h"

namespace touchfield {

namespace {

/// Does each thing once and gathers what is wrong.
class Checks {
 public:
  void once(std::size_t place, const std::string& key, const std::function<void()>& check) {
    constexpr int kMostProblems = 20;
    if (!done_.insert(key).second || count_ == kMostProblems) {
      return;
    }
    try {
      check();
    } catch (const InputError& error) {
      ++count_;
      problems_ += fmt::format("{}case {}: {}", problems_.empty() ? "" : "\n", place + 1, error.what());
    }
  }

  const std::string& problems() const { return problems_; }

 private:
  std::set<std::string> done_;
  std::string problems_;
  int count_ = 0;
};

}  // namespace

void require_named_files(const std::vector<Scene>& scenes) {
  Checks checks;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    for (const BodySpec& body : scenes[i].bodies) {
      if (std::holds_alternative<MeshShape>(body.shape)) {
        checks.once(i, shape_text(body), [&] { require_body(body); });
      }
    }
    const Eigen::Index channels = channel_count(scenes[i].array);
    for (const MethodSpec& method : scenes[i].solve.methods) {
      checks.once(i,
                  fmt::format("{} {} {} {} {}", method.name, method.start.file, method.start.method,
                              method.phases.size(), channels),
                  [&] { require_fitting_phases(method, channels); });
    }
  }
  if (!checks.problems().empty()) {
    throw InputError(checks.problems());
  }
}

}  // namespace touchfield
