#include "sim/scene/sweep_reader.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <numbers>
#include <optional>
#include <random>
#include <set>
#include <system_error>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/text.h"
#include "sim/scene/input.h"
#include "sim/scene/scene_reader.h"
#include "sim/scene/schema.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield {

namespace {

using schema::Entry;
using schema::Input;
using schema::Node;
using schema::Reading;

constexpr int kMostCases = 1'000'000;

/// Changes that go together, several times over: one part of a sweep.
using Part = std::vector<std::vector<SceneChange>>;

bool has_keys(const Input& in, const std::vector<std::string>& required, const std::vector<std::string>& others) {
  schema::MapInfo info;
  for (const std::string& key : required) {
    info.keys.push_back({.name = key, .required = true});
  }
  for (const std::string& key : others) {
    info.keys.push_back({.name = key});
  }
  return schema::check_keys(in, info);
}

/// Each of `part` combined with each of `next`, which varies faster.
Part times(const Part& part, const Part& next) {
  require(part.size() * next.size() <= static_cast<std::size_t>(kMostCases), "a sweep must have at most {} cases",
          kMostCases);
  Part product;
  product.reserve(part.size() * next.size());
  for (const auto& before : part) {
    for (const auto& changes : next) {
      product.push_back(before);
      product.back().insert(product.back().end(), changes.begin(), changes.end());
    }
  }
  return product;
}

/// Uniform numbers in [0, 1), the same everywhere: the standard library's distributions differ from one to another.
class Uniform {
 public:
  explicit Uniform(std::uint64_t seed) : engine_(seed) {}
  double operator()() { return static_cast<double>(engine_() >> 11U) * 0x1p-53; }

 private:
  std::mt19937_64 engine_;
};

/// What a random value of a sweep is drawn from.
///
///   uniform   first .. second
///   integer   first, first + 1, ..., second
///   log       first .. second, its logarithm uniform
///   normal    mean first, standard deviation second
struct RandomRange {
  enum class Kind { kUniform, kInteger, kLog, kNormal };
  Kind kind = Kind::kUniform;
  double first = 0;
  double second = 1;

  /// A value as a scene spells it. Every kind takes two numbers, so that a draw does not depend on the others' kinds.
  std::string draw(Uniform& uniform) const;
};

/// The finite number that a scalar is; nothing if it is none, or quoted.
std::optional<double> number_in(const Node& node) {
  const auto value = node.kind == Node::Kind::kScalar && !node.quoted ? number_of<double>(node.text) : std::nullopt;
  return value && std::isfinite(*value) ? value : std::nullopt;
}

std::string RandomRange::draw(Uniform& uniform) const {
  const double u = uniform();
  const double v = uniform();
  switch (kind) {
    case Kind::kUniform:
      return fmt::format("{}", first + u * (second - first));
    case Kind::kInteger:
      return fmt::format("{:.0f}", first + std::floor(u * (second - first + 1.0)));
    case Kind::kLog:
      return fmt::format("{}", first * std::pow(second / first, u));
    case Kind::kNormal:
      return fmt::format("{}",
                         first + second * std::sqrt(-2.0 * std::log1p(-u)) * std::cos(2.0 * std::numbers::pi * v));
  }
  return "";
}

/// Reads [low, high], {integer: [low, high]}, {log: [low, high]} or {normal: [mean, sigma]}. Adds a problem and returns
/// nothing if the value has another form or its numbers do not make a range.
std::optional<RandomRange> read_range(const Entry& entry, Reading& reading) {
  const Node* pair = &entry.value;
  RandomRange range;
  if (pair->kind == Node::Kind::kMap && pair->entries.size() == 1) {
    const std::string& kind = pair->entries.front().key;
    range.kind = kind == "integer"  ? RandomRange::Kind::kInteger
                 : kind == "log"    ? RandomRange::Kind::kLog
                 : kind == "normal" ? RandomRange::Kind::kNormal
                                    : RandomRange::Kind::kUniform;
    pair = range.kind == RandomRange::Kind::kUniform ? pair : &pair->entries.front().value;
  }
  const bool two = pair->kind == Node::Kind::kList && pair->items.size() == 2;
  const auto first = two ? number_in(pair->items[0]) : std::nullopt;
  const auto second = two ? number_in(pair->items[1]) : std::nullopt;
  if (!first || !second) {
    reading.add(entry.value.place, fmt::format("random.ranges.{}: must be [low, high], {{integer: [low, high]}}, "
                                               "{{log: [low, high]}} or {{normal: [mean, sigma]}}",
                                               entry.key));
    return std::nullopt;
  }
  range.first = *first;
  range.second = *second;
  const bool whole = range.first == std::floor(range.first) && range.second == std::floor(range.second);
  const char* rule = nullptr;
  if (range.kind == RandomRange::Kind::kNormal) {
    rule = range.second >= 0 ? nullptr : "sigma >= 0";
  } else if (!(range.first <= range.second)) {
    rule = "low <= high";
  } else if (range.kind == RandomRange::Kind::kLog && !(range.first > 0)) {
    rule = "low > 0";
  } else if (range.kind == RandomRange::Kind::kInteger && !whole) {
    rule = "whole numbers";
  }
  if (rule != nullptr) {
    reading.add(entry.value.place, fmt::format("random.ranges.{}: must have {}", entry.key, rule));
    return std::nullopt;
  }
  return range;
}

class SweepFile {
 public:
  SweepFile(const Node& root, Reading& reading) : root_(root), reading_(reading) {
    has_keys(Input(root_, "", reading_), {"base"}, {"name", "set", "grid", "zip", "cases", "random"});
  }

  const Node* find(const char* key, Node::Kind kind, const char* rule) {
    const Entry* entry = root_.find(key);
    if (entry != nullptr && entry->value.kind != kind) {
      reading_.add(entry->value.place, fmt::format("{}: must be {}", key, rule));
      return nullptr;
    }
    return entry != nullptr ? &entry->value : nullptr;
  }

  /// The changes of a map {path: value}; their paths must be new, or be given together in one item of `cases`.
  std::vector<SceneChange> changes(const Node& node, const std::string& where) {
    std::vector<SceneChange> result;
    for (const Entry& entry : node.entries) {
      if (std::ranges::find(result, entry.key, &SceneChange::path) != result.end()) {
        reading_.add(entry.place, fmt::format("{}: {} is given twice", where, entry.key));
      }
      result.push_back({entry.key, schema::flow_text(entry.value)});
      claim(entry, where);
    }
    return result;
  }

  /// A part for each entry of a map {path: [values]}.
  std::vector<Part> lists(const Node& node, const std::string& where) {
    std::vector<Part> parts;
    for (const Entry& entry : node.entries) {
      if (entry.value.kind != Node::Kind::kList || entry.value.items.empty()) {
        reading_.add(entry.value.place, fmt::format("{}.{}: must be a list of values", where, entry.key));
        continue;
      }
      claim(entry, where);
      Part& part = parts.emplace_back();
      for (const Node& value : entry.value.items) {
        part.push_back({{entry.key, schema::flow_text(value)}});
      }
    }
    return parts;
  }

  Part zip(const Node& node) {
    Part zipped;
    for (const Part& part : lists(node, "zip")) {
      zipped.resize(zipped.empty() ? part.size() : zipped.size());
      if (zipped.size() != part.size()) {
        const std::string& path = part.front().front().path;
        reading_.add(root_.find("zip")->value.find(path)->value.place,
                     fmt::format("zip.{}: {} values, must be as many as the first list has, {}", path, part.size(),
                                 zipped.size()));
        return {};
      }
      for (std::size_t i = 0; i < part.size(); ++i) {
        zipped[i].push_back(part[i].front());
      }
    }
    return zipped;
  }

  Part cases(const Node& node) {
    Part part;
    for (const Node& item : node.items) {
      if (item.kind != Node::Kind::kMap) {
        reading_.add(item.place, "cases: each must be a map of paths to values");
        continue;
      }
      part.push_back(changes(item, "cases"));
    }
    return part;
  }

  Part random(const Node& node) {
    const Input in(node, "random", reading_);
    if (!has_keys(in, {"count", "seed", "ranges"}, {})) {
      return {};
    }
    int count = 0;
    unsigned seed = 0;
    schema::integer(schema::between(1, kMostCases)).read(in.key("count"), count);
    schema::seed().read(in.key("seed"), seed);
    const Node& table = in.key("ranges").node();
    if (table.kind != Node::Kind::kMap || table.entries.empty()) {
      in.key("ranges").must_be("a map of paths to ranges");
    }
    std::vector<std::pair<std::string, RandomRange>> ranges;
    for (const Entry& entry : table.entries) {
      claim(entry, "random");
      if (const auto range = read_range(entry, reading_)) {
        ranges.emplace_back(entry.key, *range);
      }
    }
    if (reading_.failed()) {
      return {};
    }
    Uniform uniform(seed);
    Part part(static_cast<std::size_t>(count));
    for (auto& changes : part) {
      for (const auto& [path, range] : ranges) {
        changes.push_back({path, range.draw(uniform)});
      }
    }
    return part;
  }

 private:
  /// Notes that a part changes a path. Two parts that change the same one, or one inside the other, would leave open
  /// which of them counts.
  void claim(const Entry& entry, const std::string& where) {
    const auto within = [](const std::string& inner, const std::string& outer) {
      return inner.starts_with(outer) &&
             (inner.size() == outer.size() || inner[outer.size()] == '.' || inner[outer.size()] == '[');
    };
    for (const auto& [path, owner] : claimed_) {
      const bool same = path == entry.key;
      if (same && owner == "cases" && where == "cases") {
        return;
      }
      if (within(entry.key, path) || within(path, entry.key)) {
        reading_.add(entry.place, same ? fmt::format("{}.{}: {} changes it already", where, entry.key, owner)
                                       : fmt::format("{}.{}: {} changes {}, one of which is part of the other", where,
                                                     entry.key, owner, path));
        return;
      }
    }
    claimed_.emplace_back(entry.key, where);
  }

  const Node& root_;
  Reading& reading_;
  std::vector<std::pair<std::string, std::string>> claimed_;  // path, part
};

}  // namespace

bool is_sweep_file(const std::string& path) {
  if (std::error_code error; std::filesystem::is_fifo(path, error) || !std::filesystem::exists(path, error)) {
    return false;  // a pipe can be read once, and a scene is what comes by it, or by the name of a shipped one
  }
  const std::string text = read_whole_file(path, schema::kMostTextBytes);
  try {
    Reading reading(path, {});
    return schema::read_map(text, "a sweep", reading).find("base") != nullptr;
  } catch (const InputError&) {
    return false;
  }
}

SweepPlan read_sweep(const std::string& path, const std::vector<std::string>& overrides) {
  Reading reading(path, {});
  SweepPlan plan;
  plan.path = path;
  plan.text = read_whole_file(path, schema::kMostTextBytes);
  const Node root = schema::read_map(plan.text, "a sweep", reading);
  SweepFile file(root, reading);
  plan.name = std::filesystem::path(path).stem().string();
  if (const Node* name = file.find("name", Node::Kind::kScalar, "a text")) {
    plan.name = name->text;
  }
  if (!schema::is_name(plan.name)) {
    const Entry* entry = root.find("name");
    reading.add(entry != nullptr ? entry->value.place : schema::Place{},
                fmt::format("name: {} must be letters, digits, _ and -", schema::quoted_for_message(plan.name)));
  }
  if (const Node* base = file.find("base", Node::Kind::kScalar, "the path of a scene file")) {
    plan.base = reading.resolve(base->place, base->text);
  }
  if (const Node* set = file.find("set", Node::Kind::kMap, "a map of paths to values")) {
    plan.common = file.changes(*set, "set");
  }
  std::vector<Part> parts;
  if (const Node* grid = file.find("grid", Node::Kind::kMap, "a map of paths to lists")) {
    parts = file.lists(*grid, "grid");
  }
  if (const Node* zip = file.find("zip", Node::Kind::kMap, "a map of paths to lists")) {
    parts.push_back(file.zip(*zip));
  }
  if (const Node* cases = file.find("cases", Node::Kind::kList, "a list of maps")) {
    parts.push_back(file.cases(*cases));
  }
  if (const Node* random = file.find("random", Node::Kind::kMap, "a map with count, seed and ranges")) {
    parts.push_back(file.random(*random));
  }
  if (parts.empty()) {
    reading.add(root.place, "nothing varies: a sweep needs grid, zip, cases or random");
  }
  if (reading.failed()) {
    throw InputError(reading.message());
  }
  for (const std::string& text : overrides) {
    const auto equals = text.find('=');
    require(equals != std::string::npos, "--set {}: must be key.path=value", text);
    plan.common.push_back({text.substr(0, equals), text.substr(equals + 1)});
  }
  Part all(1);
  for (const Part& part : parts) {
    all = times(all, part);
  }
  require(!all.empty(), "{}: no case at all", path);
  for (auto& changes : all) {
    for (const SceneChange& change : changes) {
      if (std::ranges::find(plan.parameters, change.path) == plan.parameters.end()) {
        plan.parameters.push_back(change.path);
      }
    }
    plan.cases.push_back({static_cast<int>(plan.cases.size()) + 1, std::move(changes)});
  }
  plan.base_text = read_whole_file(plan.base, schema::kMostTextBytes);
  if (Reading base(plan.base, {}); schema::read_map(plan.base_text, "a scene", base).find("write") == nullptr) {
    plan.common.insert(plan.common.begin(), {"write", "[h5]"});  // before what the sweep says of it
  }
  return plan;
}

Scene read_case(const SweepPlan& plan, const SweepCase& item) {
  std::vector<std::string> changes;
  for (const std::vector<SceneChange>* part : {&plan.common, &item.changes}) {
    for (const SceneChange& change : *part) {
      changes.push_back(change.path + "=" + change.value);
    }
  }
  return read_scene_text(plan.base_text, plan.base, std::filesystem::path(plan.base).parent_path().string(), changes,
                         fmt::format("{}: case {}:", plan.name, item.number));
}

std::vector<Scene> read_cases(const SweepPlan& plan) {
  constexpr std::size_t kMostProblems = 20;
  std::vector<Scene> scenes;
  std::string problems;
  std::size_t bad = 0;
  for (const SweepCase& item : plan.cases) {
    try {
      scenes.push_back(read_case(plan, item));
    } catch (const InputError& error) {
      if (++bad <= kMostProblems) {
        problems += (problems.empty() ? "" : "\n") + std::string(error.what());
      }
    }
  }
  if (bad > 0) {
    throw InputError(bad > kMostProblems ? fmt::format("{}\nand {} cases more", problems, bad - kMostProblems)
                                         : problems);
  }
  return scenes;
}

std::string plan_hash(const SweepPlan& plan, const std::vector<Scene>& scenes) {
  std::string all;
  std::set<std::string> files;
  for (std::size_t i = 0; i < scenes.size(); ++i) {
    all += fmt::format("{}\n", plan.cases[i].number);
    for (const SceneChange& change : plan.cases[i].changes) {
      all += change.path + "=" + change.value + "\n";
    }
    all += text_hash(resolved_yaml(scenes[i])) + "\n";
    files.merge(named_files(scenes[i]));
  }
  constexpr std::size_t kMostBytes = std::size_t{1} << 30U;  // of a mesh or a run
  for (const std::string& file : files) {
    all += file + " " + text_hash(read_whole_file(file, kMostBytes)) + "\n";
  }
  return text_hash(all);
}

}  // namespace touchfield
