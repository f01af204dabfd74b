#include <algorithm>
#include <set>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/hand/hand_flesh.h"
#include "sim/hand/shapes.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/suggest.h"

namespace touchfield::schema {

namespace {

/// "one of top, bottom; did you mean top?", as it follows "must be".
std::string rule(const std::vector<std::string>& names, const std::string& name) {
  if (names.empty()) {
    return "a landmark of the body, which has none";
  }
  const std::string nearest = nearest_word(names, name);
  return fmt::format("one of {}{}", fmt::join(names, ", "),
                     nearest.empty() ? "" : fmt::format("; did you mean {}?", nearest));
}

}  // namespace

std::vector<std::string> landmark_names(const BodySpec& body) {
  if (std::holds_alternative<HandShape>(body.shape)) {
    return hand_landmark_names();
  }
  const auto* mesh = std::get_if<MeshShape>(&body.shape);
  if (!mesh) {
    return shape_landmark_names();
  }
  std::vector<std::string> names;
  names.reserve(mesh->landmarks.size());
  for (const auto& [name, position] : mesh->landmarks) {
    names.push_back(name);
  }
  return names;
}

std::vector<std::string> landmark_names(const std::vector<BodySpec>& bodies) {
  std::set<std::string> all;
  for (const BodySpec& body : bodies) {
    for (std::string& name : landmark_names(body)) {
      all.insert(std::move(name));
    }
  }
  return {all.begin(), all.end()};
}

bool check_landmark(const Input& at, const std::vector<std::string>& names, const std::string& name) {
  if (contains(names, name)) {
    return true;
  }
  return at.must_be(rule(names, name));
}

bool check_near(const Input& edges, const std::vector<std::string>& names) {
  const Entry* near = edges.node().find("near");
  if (!near) {
    return true;
  }
  const Input table = edges.at(*near);
  bool good = true;
  for (const Entry& entry : near->value.entries) {
    if (entry.value.removed || contains(names, entry.key)) {
      continue;
    }
    edges.reading().add(entry.place, fmt::format("{}: must be {}", table.path_of(entry.key), rule(names, entry.key)));
    good = false;
  }
  return good;
}

bool check_box_landmarks(const Input& scene, const std::vector<BodySpec>& bodies) {
  const Entry* target = scene.node().find("target");
  if (!target) {
    return true;
  }
  std::vector<std::string> names = landmark_names(bodies);
  names.emplace_back(kNearestToArray);
  std::vector<std::string> known = names;
  for (const BodySpec& body : bodies) {
    for (const std::string& landmark : landmark_names(body)) {
      known.push_back(body.name + "." + landmark);
    }
  }
  bool good = true;
  const auto check = [&](const Input& place) {
    const Entry* at = place.node().find("at");
    if (at && !contains(known, at->value.text)) {
      good = place.at(*at).must_be(rule(names, at->value.text));
    }
  };
  const auto check_items = [](const Input& in, const char* key, const auto& check_item) {
    const Entry* entry = in.node().find(key);
    for (std::size_t i = 0; entry && i < entry->value.items.size(); ++i) {
      check_item(in.at(*entry).at(i));
    }
  };
  const Input table = scene.at(*target);
  if (const Entry* box = target->value.find("box")) {
    check(table.at(*box));
  }
  check_items(table, "boxes", check);
  check_items(table, "points", check);
  check_items(table, "lines", [&](const Input& line) { check_items(line, "points", check); });
  return good;
}

}  // namespace touchfield::schema
