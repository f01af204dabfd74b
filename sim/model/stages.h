#pragma once

#include <chrono>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "sim/core/progress.h"

namespace touchfield {

/// Runs `work`, tells `progress`, and adds (name, seconds) to `record`.
template <typename Work>
auto timed(Progress& progress, std::vector<std::pair<std::string, double>>& record, const std::string& name,
           const std::string& what, Work&& work) {
  progress.begin(what);
  const auto start = std::chrono::steady_clock::now();
  const auto finish = [&] {
    const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    record.emplace_back(name, seconds);
    progress.end(seconds);
  };
  if constexpr (std::is_void_v<decltype(work())>) {
    work();
    finish();
  } else {
    auto result = work();
    finish();
    return result;
  }
}

/// The same without a record.
template <typename Work>
auto timed(Progress& progress, const std::string& what, Work&& work) {
  std::vector<std::pair<std::string, double>> none;
  return timed(progress, none, what, what, std::forward<Work>(work));
}

}  // namespace touchfield
