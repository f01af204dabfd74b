#include "sim/scene/scene_reader.h"

#include <algorithm>
#include <stdexcept>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/scene/input.h"
#include "sim/scene/overrides.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/text_file.h"

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

}  // namespace touchfield
