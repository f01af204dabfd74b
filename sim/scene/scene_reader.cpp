#include "sim/scene/scene_reader.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <map>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/scene/input.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/schema_info.h"
#include "sim/scene/shipped_scenes.h"
#include "sim/scene/yaml_tree.h"

namespace touchfield {

namespace {

Scene read(const std::string& text, const std::vector<std::string>& overrides, schema::Reading reading) {
  schema::Node root = schema::read_map(text, "a scene", reading);
  int source = 0;
  for (const auto& override_text : overrides) {
    schema::apply_override(root, override_text, ++source, reading);
  }
  Scene scene;
  schema::scene_codec().read({root, "", reading}, scene);
  if (reading.failed()) {
    throw InputError(reading.message());
  }
  return scene;
}

using Json = nlohmann::ordered_json;
using schema::contains;
using schema::KeyInfo;
using schema::MapInfo;
using schema::Node;
using schema::TypeInfo;
using Kind = TypeInfo::Kind;

// ---- JSON Schema

Json value_json(const Node& node) {
  Json json;
  switch (node.kind) {
    case Node::Kind::kNull:
      break;
    case Node::Kind::kScalar:
      if (node.text == "true" || node.text == "false") {
        json = node.text == "true";
      } else if (node.quoted || !schema::parse_decimal(node.text)) {
        json = node.text;
      } else {
        json = Json::parse(node.text);
      }
      break;
    case Node::Kind::kList:
      json = Json::array();
      for (const auto& item : node.items) {
        json.push_back(value_json(item));
      }
      break;
    case Node::Kind::kMap:
      json = Json::object();
      for (const auto& entry : node.entries) {
        json[entry.key] = value_json(entry.value);
      }
      break;
  }
  return json;
}

Json number_json(double value) { return Json::parse(schema::decimal_text(value)); }

Json type_json(const TypeInfo& type);

// What the choice of one key of a group asks of the others.
Json alternative_json(const MapInfo& info, const std::string& chosen) {
  Json required = {chosen};
  Json properties = Json::object();
  for (const auto& key : info.keys) {
    if (!key.fits(chosen)) {
      properties[key.name] = false;
    }
    if (key.required && contains(key.only_with, chosen)) {
      required.push_back(key.name);
    }
    for (const auto& [other, count] : key.items_with) {
      if (other == chosen) {
        properties[key.name] = {{"minItems", count}, {"maxItems", count}};
      }
    }
  }
  Json json = {{"required", required}};
  if (!properties.empty()) {
    json["properties"] = properties;
  }
  return json;
}

Json map_json(const MapInfo& info) {
  Json json = {{"type", "object"}, {"additionalProperties", false}};
  Json required = Json::array();
  Json properties = Json::object();
  for (const auto& key : info.keys) {
    if (key.required && key.only_with.empty()) {
      required.push_back(key.name);
    }
    Json property = {{"description", key.help}};
    property.update(type_json(key.type));
    if (!key.fallback.empty()) {
      property["default"] = value_json(schema::parse_yaml(key.fallback, 0));
    }
    if (const Node example = schema::example_of(key); schema::flow_text(example) != key.fallback) {
      property["examples"] = Json::array({value_json(example)});
    }
    properties[key.name] = property;
  }
  if (!required.empty()) {
    json["required"] = required;
  }
  json["properties"] = properties;
  if (info.group && info.group->required) {
    json["oneOf"] = Json::array();
    for (const auto& key : info.group->keys) {
      json["oneOf"].push_back(alternative_json(info, key));
    }
  } else if (info.group) {
    json["not"] = {{"required", info.group->keys}};
  }
  return json;
}

Json number_type_json(const TypeInfo& type) {
  const auto& range = type.range;
  Json json = {{"type", type.kind == Kind::kInteger ? "integer" : "number"}};
  json[range.low_excluded ? "exclusiveMinimum" : "minimum"] = number_json(range.low.value_or(-schema::Range::kLargest));
  json["maximum"] = number_json(range.high.value_or(schema::Range::kLargest));
  return json;
}

Json type_json(const TypeInfo& type) {
  const std::string name_pattern = fmt::format("^[A-Za-z0-9_-]{{1,{}}}$", schema::kLongestName);
  switch (type.kind) {
    case Kind::kNumber:
    case Kind::kInteger:
      return number_type_json(type);
    case Kind::kFlag:
      return {{"type", "boolean"}};
    case Kind::kWord:
      return {{"enum", type.words}};
    case Kind::kName:
      return {{"type", "string"}, {"pattern", name_pattern}};
    case Kind::kText:
    case Kind::kFile:
      return {{"type", "string"}, {"minLength", type.fewest}};
    case Kind::kList: {
      Json json = {{"type", "array"}, {"items", type_json(type.of.front())}};
      if (type.fewest > 0) {
        json["minItems"] = type.fewest;
      }
      if (type.most != TypeInfo::kNoLimit) {
        json["maxItems"] = type.most;
      }
      if (type.distinct) {
        json["uniqueItems"] = true;
      }
      return json;
    }
    case Kind::kMap:
      return map_json(*type.map);
    case Kind::kTable:
      return {{"type", "object"},
              {"propertyNames", {{"pattern", name_pattern}}},
              {"additionalProperties", type_json(type.of.front())}};
    case Kind::kAny: {
      Json json = {{"anyOf", Json::array()}};
      for (const auto& part : type.of) {
        json["anyOf"].push_back(type_json(part));
      }
      return json;
    }
  }
  return {};
}

// ---- Markdown

// The map that a value of this type is or may hold.
const MapInfo* map_within(const TypeInfo& type) {
  if (type.map) {
    return type.map.get();
  }
  for (const auto& part : type.of) {
    if (const MapInfo* map = map_within(part)) {
      return map;
    }
  }
  return nullptr;
}

std::string escaped(const std::string& text) {
  std::string result;
  for (const char c : text) {
    if (c == '|') {
      result += '\\';
    }
    result += c;
  }
  return result;
}

// Whether the key must be given, its default, and an example unless the default is one.
std::string need_text(const KeyInfo& key) {
  std::vector<std::string> parts;
  const bool shows_default = !key.fallback.empty() && key.type.kind != Kind::kMap;
  if (shows_default) {
    parts.push_back("`" + key.fallback + "`");
  }
  const std::string needed = key.required ? "required" : "only";
  if (!key.only_with.empty()) {
    parts.push_back(fmt::format("{} with {}", needed, fmt::join(key.only_with, ", ")));
  } else if (key.required) {
    parts.push_back(needed);
  }
  const std::string example = schema::flow_text(schema::example_of(key));
  if (!shows_default || example != key.fallback) {
    parts.push_back(fmt::format("e.g. `{}`", escaped(example)));
  }
  return fmt::format("{}", fmt::join(parts, "; "));
}

std::string value_text(const KeyInfo& key) {
  std::string value = escaped(phrase(key.type));
  for (const auto& [other, count] : key.items_with) {
    value += fmt::format("; {} with {}", count, other);
  }
  return value;
}

class MarkdownPage {
 public:
  void section(const std::string& path, const MapInfo& info) {
    if (!path.empty()) {
      text_ += fmt::format("\n## `{}`\n", path);
    }
    const auto [first, is_new] = written_.emplace(&info, path);
    if (!is_new) {
      text_ += fmt::format("\nThe keys of `{}`.\n", first->second);
      return;
    }
    if (info.keys.empty()) {
      text_ += "\nNo keys: `{}`.\n";
      return;
    }
    if (info.group) {
      text_ += fmt::format("\n{} one of {}.\n", info.group->required ? "Exactly" : "At most",
                           fmt::join(info.group->keys, ", "));
    }
    text_ += "\n| key | value | default, example | meaning |\n|---|---|---|---|\n";
    for (const auto& key : info.keys) {
      text_ += fmt::format("| `{}` | {} | {} | {} |\n", key.name, value_text(key), need_text(key), escaped(key.help));
    }
    for (const auto& key : info.keys) {
      const std::string name = path.empty() ? key.name : path + "." + key.name;
      if (const MapInfo* map = map_within(key.type)) {
        section(name + (key.type.kind == Kind::kList ? "[]" : ""), *map);
      }
    }
  }

  const std::string& text() const { return text_; }

 private:
  std::string text_;
  std::map<const MapInfo*, std::string> written_;  // and the section that has its keys
};

// The keys whose paths end with `wanted`, without indices of lists. Maps that several keys share count once.
std::string described(const std::string& wanted, const std::string& path, const MapInfo& info,
                      std::set<const MapInfo*>& seen) {
  std::string text;
  for (const auto& key : info.keys) {
    const std::string name = path.empty() ? key.name : path + "." + key.name;
    const MapInfo* map = map_within(key.type);
    if (("." + name).ends_with("." + wanted)) {
      text += fmt::format("{}\n  {}\n  value: {}\n  default, example: {}\n", name, key.help, value_text(key),
                          need_text(key));
      for (std::size_t i = 0; map != nullptr && i < map->keys.size(); ++i) {
        text += fmt::format("    {}: {}\n", map->keys[i].name, map->keys[i].help);
      }
    }
    if (map != nullptr && seen.insert(map).second) {
      text += described(wanted, name, *map, seen);
    }
  }
  return text;
}

constexpr const char* kPageHead = R"(# Scene keys

A scene is a YAML file that describes a run: the transducers, the body that scatters their sound, the part of its skin
to press on, and the methods that find the phases. `touchfield run scenes/quick.yaml` runs a scene. `touchfield check`
checks it without solving anything. `touchfield check --resolved` prints it with all defaults.

- Every key has an example in the tables: its default, or a value after "e.g.". If a map is left
  out, its keys have their defaults.
- The key of a number names its unit. Nothing else is converted.
- A key that is not listed here, is given twice, has the wrong type or is out of its range is an error. All errors of a
  scene are reported together, each as `file:line:column: path: problem, rule`.
- Positive numbers must be at least 1e-9. Numbers without a bound must be at most 1e9 in magnitude.
- A scene file has at most 2 MiB and 200,000 values. An alias counts as all the values that it stands for. The same
  limits hold for a file of positions or phases, which has at most 10,000 of them.
- The name of a file in a scene is relative to the scene's folder.
- `--set key.path=value` changes a value for one run: `--set solve.iterations=10`. For an item of a list (numbered from
  0) write `--set body.place.at_mm.2=250` or `at_mm[2]`. Missing maps on the path are made. The value is YAML. `null`
  removes a key, so `--set array.grid=null --set array.plane_wave={}` replaces one alternative by another. The name of
  a file in `--set` is relative to the working directory.
- `template.yaml` is a commented scene to start from. With `schema.json` editors complete and check a scene that has
  the line `# yaml-language-server: $schema=schema.json`.

World coordinates: an array lies in the plane z = 0 and emits along +z unless it is moved. Rotations are in degrees
about the fixed x, then y, then z axis.

`touchfield schema KEY` prints one key. `schema.json` is generated from the same table as this page.

## A scene
)";

}  // namespace

Scene read_scene(const std::string& path, const std::vector<std::string>& overrides) {
  if (path.find_first_of("/.") == std::string::npos && !std::filesystem::is_regular_file(path)) {
    const ShippedScene* shipped = shipped_scene(path);
    std::vector<std::string_view> names;
    std::ranges::transform(shipped_scenes(), std::back_inserter(names), &ShippedScene::name);
    require(shipped != nullptr, "{}: no such file, and no scene that comes with the program: {}", path,
            fmt::join(names, ", "));
    return read_scene_text(std::string(shipped->text), path, "", overrides);
  }
  return read(read_whole_file(path, schema::kMostTextBytes), overrides, schema::Reading(path, overrides));
}

Scene read_scene_text(const std::string& text, const std::string& name, const std::string& folder,
                      const std::vector<std::string>& overrides, const std::string& changes) {
  return read(text, overrides, schema::Reading(name, overrides, folder, changes));
}

std::string resolved_yaml(const Scene& scene) { return schema::block_text(schema::scene_codec().write(scene)); }

std::string shape_text(const BodySpec& body) {
  BodySpec shape;
  shape.shape = body.shape;
  return schema::block_text(schema::body_codec().write(shape));
}

std::set<std::string> named_files(const Scene& scene) {
  std::set<std::string> files;
  for (const BodySpec& body : scene.bodies) {
    if (const auto* mesh = std::get_if<MeshShape>(&body.shape)) {
      files.insert(mesh->file);
      if (mesh->series) {
        files.insert(mesh->series->times);
        for (const MeshSeries::Mesh& later : mesh->series->meshes) {
          files.insert(later.file);
        }
      }
    }
  }
  for (const MethodSpec& method : scene.solve.methods) {
    if (!method.start.file.empty()) {
      files.insert(method.start.file);
    }
  }
  return files;
}

double EdgeSpec::finest() const {
  double edge = std::min(far, near_target.value_or(far));
  for (const auto& [landmark, length] : near) {
    edge = std::min(edge, length);
  }
  return edge;
}

EdgeSpec UsualHandEdges::of_scene(bool has_target) {
  EdgeSpec edge;
  edge.far = has_target ? kFar : kWithoutTarget;
  if (has_target) {
    edge.near_target = kNearTarget;
    edge.within = kWithin;
  }
  return edge;
}

EdgeSpec EdgeSpec::scaled(double factor) const {
  EdgeSpec other = *this;
  other.far *= factor;
  if (other.near_target) {
    *other.near_target *= factor;
  }
  for (auto& [landmark, length] : other.near) {
    length *= factor;
  }
  return other;
}

std::string schema_markdown() {
  MarkdownPage page;
  page.section("", *schema::scene_codec().type.map);
  return kPageHead + page.text();
}

std::string schema_text(const std::string& key) {
  std::string wanted = key;
  while (wanted.find('[') < wanted.find(']')) {
    wanted.erase(wanted.find('['), wanted.find(']') - wanted.find('[') + 1);
  }
  const MapInfo& scene = *schema::scene_codec().type.map;
  std::vector<std::string> names = scene.names();
  while (true) {
    std::set<const MapInfo*> seen;
    if (std::string text = described(wanted, "", scene, seen); !text.empty()) {
      return text;
    }
    const std::size_t dot = wanted.find('.');
    if (dot == std::string::npos) {
      for (const MapInfo* map : seen) {
        std::ranges::copy(map->names(), std::back_inserter(names));
      }
      break;
    }
    wanted.erase(0, dot + 1);
  }
  const std::string near = schema::nearest_word(names, wanted);
  throw InputError(fmt::format("a scene has no key {}{}", schema::quoted_for_message(key),
                               near.empty() ? "" : fmt::format(", did you mean {}?", near)));
}

std::string schema_json() {
  Json json = {{"$schema", "https://json-schema.org/draft/2020-12/schema"}, {"title", "touchfield scene"}};
  json.update(map_json(*schema::scene_codec().type.map));
  return json.dump(2) + "\n";
}

}  // namespace touchfield
