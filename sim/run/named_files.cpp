#include "sim/run/named_files.h"

#include <set>
#include <string>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/model/meshed_body.h"
#include "sim/model/model.h"
#include "sim/scene/scene_reader.h"

namespace touchfield {

void require_named_files(const std::vector<Scene>& scenes) {
  constexpr int kMostProblems = 20;
  std::set<std::string> done;
  std::vector<std::string> problems;
  const auto once = [&](std::size_t place, const std::string& key, const auto& check) {
    if (!done.insert(key).second || problems.size() == kMostProblems) {
      return;
    }
    try {
      check();
    } catch (const InputError& error) {
      problems.push_back(fmt::format("case {}: {}", place + 1, error.what()));
    }
  };
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    for (const BodySpec& body : scenes[i].bodies) {
      if (std::holds_alternative<MeshShape>(body.shape)) {
        once(i, shape_text(body), [&] { require_body(body); });
      }
    }
    const Eigen::Index channels = channel_count(scenes[i].array);
    for (const MethodSpec& method : scenes[i].solve.methods) {
      once(i,
           fmt::format("{} {} {} {} {}", method.name, method.start.file, method.start.method, method.phases.size(),
                       channels),
           [&] { require_fitting_phases(method, channels); });
    }
  }
  require(problems.empty(), "{}", fmt::join(problems, "\n"));
}

}  // namespace touchfield
