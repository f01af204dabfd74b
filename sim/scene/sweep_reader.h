#pragma once

#include <string>
#include <vector>

#include "sim/scene/scene.h"

namespace touchfield {

/// One change of a scene: a key path and its value as YAML in one line.
struct SceneChange {
  std::string path;
  std::string value;

  bool operator==(const SceneChange&) const = default;
};

/// One scene of a sweep: the base with its changes.
struct SweepCase {
  int number = 0;                    // from 1
  std::vector<SceneChange> changes;  // in the order of the plan's parameters; without those a case leaves alone
};

/// What a sweep file says. Its keys:
///
///   base     the scene file, relative to the sweep file
///   set      {path: value}: changes that every case has
///   grid     {path: [values]}: every combination
///   zip      {path: [values]}: the first values together, the second ones together, ...
///   cases    [{path: value}]: a list
///   random   {count, seed, ranges: {path: range}}: draws; a range is [low, high] (uniform), {integer: [low, high]},
///            {log: [low, high]} or {normal: [mean, sigma]}
///   name     of the sweep; default: the file's name
///
/// Relative paths in values count from the base scene's folder, as if they stood there. Where the base scene leaves
/// `write` open, cases write run.h5 alone unless a change says otherwise.
///
/// Where there are several of grid, zip, cases and random, every case of one is combined with every case of the others.
/// The last one in this order varies fastest. Random draws are then the same for all. Draw number k does not depend on
/// the count.
struct SweepPlan {
  std::string name;
  std::string path;  // of the sweep file
  std::string text;  // of it
  std::string base;  // path of the scene file
  std::string base_text;
  std::vector<SceneChange> common;
  std::vector<std::string> parameters;  // every path that a case changes, in the order of the file
  std::vector<SweepCase> cases;
  std::string hash{};  // plan_hash, once the scenes are read
};

/// Whether a file looks like a sweep: it is a map with a key `base`.
bool is_sweep_file(const std::string& path);

/// Reads and checks a sweep file; the scenes are not read yet.
///
/// overrides   "key.path=value" of scenes, for every case, behind `set`
/// throws      InputError listing every problem, one per line, as file:line:column: ...
SweepPlan read_sweep(const std::string& path, const std::vector<std::string>& overrides);

/// The scene of a case.
/// throws   InputError as read_scene; a problem of a change is called `SWEEP: case N: path=value`
Scene read_case(const SweepPlan& plan, const SweepCase& item);

/// The scenes of all cases.
/// throws   InputError with the problems of the first ones that have any
std::vector<Scene> read_cases(const SweepPlan& plan);

/// A hash that tells whether two plans are of the same cases. It is over the number, the changes and the resolved scene
/// of each case, in order. The bytes of the files that the scenes name are included.
///
/// scenes   one per case
std::string plan_hash(const SweepPlan& plan, const std::vector<Scene>& scenes);

}  // namespace touchfield
