#pragma once

#include <exception>
#include <functional>
#include <string>
#include <vector>

#include "sim/core/json.h"
#include "sim/core/progress.h"
#include "sim/run/run_directory.h"

namespace touchfield {

/// What `run`, `play`, `pattern`, `see`, `fit` and `study` have in common: something is computed into a directory. A
/// job is made when all that can be wrong with its input has been found.
template <class Result>
struct Job {
  std::string name;                // of the scene, or of what is made otherwise
  std::vector<std::string> files;  // all that it may write, its log first
  std::function<Result(RunDirectory& directory, Progress& progress)> compute;
  /// As --json prints it.
  /// directory   where the files are
  std::function<Json(const Result& result, const std::string& directory)> value{};
  /// As text; without it the lines of the value.
  /// terse   whether nothing else is said: then the directory belongs to it
  std::function<std::string(const Result& result, const Json& value, bool terse)> print{};
  std::string makes = "results";  // in a word, for a person
};

/// The result of compute(directory, progress) in a directory that is then published. An error leaves word in the
/// directory and is thrown on.
template <class Compute>
auto filled(RunDirectory& directory, Progress& progress, const Compute& compute) {
  if (!directory.warning().empty()) {
    progress.warn(directory.warning());
  }
  try {
    auto result = compute(directory, progress);
    directory.publish();
    return result;
  } catch (const std::exception& error) {
    if (directory.fail(error.what())) {
      progress.note("what is finished is in " + directory.path());
    }
    throw;
  }
}

/// The result of a job, with its files in a directory.
/// throws   as RunDirectory and the job
template <class Result>
Result filled(const Job<Result>& job, const std::string& path, bool force, Progress& progress) {
  RunDirectory directory = RunDirectory::at(path, job.files, force);
  return filled(directory, progress, job.compute);
}

}  // namespace touchfield
