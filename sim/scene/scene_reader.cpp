#include "sim/scene/scene_reader.h"

#include <algorithm>
#include <stdexcept>

#include "sim/core/errors.h"
#include "sim/core/whole_file.h"
#include "sim/scene/input.h"
#include "sim/scene/overrides.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/text_file.h"

namespace touchfield {

namespace {

using schema::Node;

Scene read(const std::string& text, const std::vector<std::string>& overrides, schema::Reading reading) {
  Node root = schema::read_map(text, "a scene", reading);
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

}  // namespace

Scene read_scene(const std::string& path, const std::vector<std::string>& overrides) {
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

double EdgeSpec::finest() const {
  double edge = std::min(far, near_target.value_or(far));
  for (const auto& [landmark, length] : near) {
    edge = std::min(edge, length);
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

}  // namespace touchfield
