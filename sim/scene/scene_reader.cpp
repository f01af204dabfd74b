#include "sim/scene/scene_reader.h"

#include <algorithm>
#include <stdexcept>

#include "sim/core/errors.h"
#include "sim/scene/input.h"
#include "sim/scene/overrides.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/text_file.h"

namespace touchfield {
namespace {

using schema::Node;

// The parser's word for a tab that indents is seldom "tab".
void explain_tab(const std::string& text, schema::SyntaxError& error) {
  std::size_t start = 0;
  for (int line = 1; line < error.place.line && start != std::string::npos; ++line) {
    start = text.find('\n', start);
    if (start != std::string::npos) ++start;
  }
  const auto tab = start == std::string::npos ? start : text.find_first_not_of(' ', start);
  if (tab == std::string::npos || text[tab] != '\t') return;
  error.place.column = static_cast<int>(tab - start) + 1;
  error.what = "not YAML: indented by a tab, must be spaces";
}

// The text's values; one that is not YAML ends the reading.
Node load(const std::string& text, schema::Reading& reading) {
  const auto fault = schema::find_text_fault(text);
  if (fault.column > 0) {
    reading.add({0, fault.line, fault.column}, "not a character of UTF-8 text, a scene is a text file");
    throw InputError(reading.message());
  }
  try {
    Node root = schema::parse_yaml(text, 0);
    if (root.kind == Node::Kind::kMap) return root;
    const bool empty = root.kind == Node::Kind::kNull;
    reading.add(empty ? schema::Place{} : root.place,
                empty ? "empty, a scene must be a map of keys" : "not a map, a scene must be a map of keys");
  } catch (schema::SyntaxError& error) {
    explain_tab(text, error);
    reading.add(error.place, error.what);
  }
  throw InputError(reading.message());
}

Scene read(const std::string& text, const std::vector<std::string>& overrides, schema::Reading reading) {
  Node root = load(text, reading);
  int source = 0;
  for (const auto& override_text : overrides) schema::apply_override(root, override_text, ++source, reading);
  Scene scene;
  schema::scene_codec().read({root, "", reading}, scene);
  if (reading.failed()) throw InputError(reading.message());
  return scene;
}

}  // namespace

Scene read_scene(const std::string& path, const std::vector<std::string>& overrides) {
  return read(schema::read_text_file(path), overrides, schema::Reading(path, overrides));
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

double EdgeSpec::finest() const {
  double edge = std::min(far, near_target.value_or(far));
  for (const auto& [landmark, length] : near) edge = std::min(edge, length);
  return edge;
}

EdgeSpec EdgeSpec::scaled(double factor) const {
  EdgeSpec other = *this;
  other.far *= factor;
  if (other.near_target) *other.near_target *= factor;
  for (auto& [landmark, length] : other.near) length *= factor;
  return other;
}

bool uses_transfer(MethodKind kind) {
  switch (kind) {
    case MethodKind::kSurface:
    case MethodKind::kGs:
    case MethodKind::kWgs:
    case MethodKind::kGsPat:
    case MethodKind::kEigen:
    case MethodKind::kLbfgs:
      return true;
    case MethodKind::kPaper:
    case MethodKind::kUnscattered:
    case MethodKind::kFocus:
    case MethodKind::kFixed:
      break;
  }
  return false;
}

bool iterates(MethodKind kind) {
  return kind != MethodKind::kFocus && kind != MethodKind::kEigen && kind != MethodKind::kGsPat &&
         kind != MethodKind::kFixed;
}

std::string to_string(MethodKind kind) {
  for (const auto& [text, known] : schema::method_names()) {
    if (known == kind) return text;
  }
  throw std::logic_error("a method without a name");
}

}  // namespace touchfield
