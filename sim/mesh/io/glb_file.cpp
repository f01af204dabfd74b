#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numeric>
#include <optional>
#include <string_view>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "sim/core/errors.h"
#include "sim/mesh/io/file_text.h"
#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

namespace {

using Json = nlohmann::json;

constexpr int kDeepestNode = 1000;
constexpr const char* kInstancing = "EXT_mesh_gpu_instancing";

/// A kind of number in a buffer.
struct Component {
  std::size_t type;  // glTF's number for it
  std::size_t size;  // [bytes]
  double (*value)(const char* at);
  double most;  // what 1 is stored as in normalised accessors; 0: is never normalised
};

template <class Number>
double value_at(const char* at) {
  return static_cast<double>(number_at<Number>(at, false));
}

constexpr std::array<Component, 6> kComponents = {{{5120, 1, value_at<std::int8_t>, 127},
                                                   {5121, 1, value_at<std::uint8_t>, 255},
                                                   {5122, 2, value_at<std::int16_t>, 32767},
                                                   {5123, 2, value_at<std::uint16_t>, 65535},
                                                   {5125, 4, value_at<std::uint32_t>, 0},
                                                   {5126, 4, value_at<float>, 0}}};

enum class Use { kNumbers, kIndices };

/// Extensions that say how a surface looks, not where it is. Quantised numbers are read as their accessors say.
bool is_harmless(const std::string& extension) {
  constexpr std::array<std::string_view, 5> kBeginnings = {"KHR_materials_", "KHR_texture_", "EXT_texture_",
                                                           "KHR_lights_", "KHR_mesh_quantization"};
  return std::ranges::any_of(kBeginnings, [&](std::string_view begin) { return extension.starts_with(begin); });
}

class Glb {
 public:
  Glb(const std::string& content, const std::string& name) : name_(name) {
    if (!content.starts_with("glTF")) {
      fail("not a binary glTF file: it does not begin with 'glTF'");
    }
    constexpr std::size_t kHeader = 12;
    const auto number = [&](std::size_t at) {
      return std::size_t{number_at<std::uint32_t>(content.data() + at, false)};
    };
    if (content.size() < kHeader || number(8) > content.size()) {
      fail("is damaged: it is cut short");
    }
    if (number(4) != 2) {
      fail(fmt::format("is glTF version {}; only version 2 is read", number(4)));
    }
    const std::size_t end = number(8);
    std::string_view json;
    for (std::size_t at = kHeader; at < end;) {
      if (end - at < 8 || number(at) > end - at - 8) {
        fail("is damaged: it is cut short");
      }
      const std::string_view chunk = std::string_view(content).substr(at + 8, number(at));
      const std::string_view kind = std::string_view(content).substr(at + 4, 4);
      if (at == kHeader && kind == "JSON") {
        json = chunk;
      } else if (binary_.empty() && kind == std::string_view("BIN\0", 4)) {
        binary_ = chunk;
      }
      at += 8 + chunk.size();
    }
    root_ = Json::parse(json);
    if (end < content.size()) {
      surface_.notes.push_back(bytes_behind_text(content.size() - end));
    }
  }

  FileSurface surface() {
    for (const Json& extension : list("extensionsRequired")) {
      if (!is_harmless(extension.get<std::string>())) {
        refuse_extension(extension.get<std::string>());
      }
    }
    const Json& nodes = list("nodes");
    parents_.resize(nodes.size());
    worlds_.resize(nodes.size());
    for (std::size_t n = 0; n < nodes.size(); ++n) {
      for (const Json& child : list("children", nodes[n])) {
        std::optional<std::size_t>& parent = parents_[whole(child, nodes.size(), "children of a node")];
        if (parent) {
          fail(fmt::format("node {} has two parents", child.get<std::size_t>()));
        }
        parent = n;
      }
    }
    const Json& scenes = list("scenes");
    std::vector<std::size_t> left = indices("nodes", scenes.at(whole_or(root_, "scene", scenes.size(), 0)));
    std::vector<bool> seen(nodes.size(), false);
    while (!left.empty()) {
      const std::size_t n = left.back();
      left.pop_back();
      if (seen[n]) {
        fail(fmt::format("node {} is in its scene twice", n));
      }
      seen[n] = true;
      add_node(n);
      const std::vector<std::size_t> children = indices("children", nodes[n]);
      left.insert(left.end(), children.begin(), children.end());
    }
    if (unweighted_ > 0) {
      surface_.notes.push_back(fmt::format("points without bone weights, placed by their node: {}", unweighted_));
    }
    return std::move(surface_);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const { throw InputError(fmt::format("{}: {}", name_, what)); }

  [[noreturn]] void refuse_extension(const std::string& extension) const {
    fail(fmt::format("needs the glTF extension {}, which is not read; export it without {}", extension,
                     extension == kInstancing                             ? "instances: each as a node of its own"
                     : extension.find("compression") != std::string::npos ? "compression"
                                                                          : "this extension"));
  }

  /// An index, a count or a size.
  std::size_t whole(const Json& json, std::size_t end, const char* what) const {
    if (!json.is_number_unsigned() || json.get<std::uint64_t>() >= end) {
      fail(fmt::format("{}: {} must be a whole number below {}", what, json.dump().substr(0, 40), end));
    }
    return json.get<std::size_t>();
  }
  std::size_t whole_or(const Json& object, const char* key, std::size_t end, std::size_t standard) const {
    const auto found = object.find(key);
    return found == object.end() ? standard : whole(*found, end, key);
  }

  const Json& list(const char* key) const { return list(key, root_); }
  const Json& list(const char* key, const Json& object) const {
    static const Json kNone = Json::array();
    const auto found = object.find(key);
    if (found != object.end() && !found->is_array()) {
      fail(fmt::format("{} must be a list", key));
    }
    return found == object.end() ? kNone : *found;
  }
  const Json& item(const char* key, const Json& index) const { return list(key)[whole(index, list(key).size(), key)]; }
  /// Of nodes; the last one first.
  std::vector<std::size_t> indices(const char* key, const Json& object) const {
    std::vector<std::size_t> found;
    for (const Json& index : list(key, object)) {
      found.push_back(whole(index, parents_.size(), key));
    }
    std::ranges::reverse(found);
    return found;
  }
  std::vector<double> numbers(const Json& object, const char* key, std::vector<double> standard) const {
    const Json& given = list(key, object);
    if (!object.contains(key)) {
      return standard;
    }
    std::vector<double> found = given.get<std::vector<double>>();
    if (!standard.empty() && found.size() != standard.size()) {
      fail(fmt::format("{} has {} numbers, must have {}", key, found.size(), standard.size()));
    }
    return found;
  }

  /// Bytes of a buffer view from an offset on.
  std::string_view view(const Json& index, std::size_t offset) const {
    const Json& view = item("bufferViews", index);
    const Json& buffer = item("buffers", view.at("buffer"));
    if (&buffer != &list("buffers")[0] || buffer.contains("uri")) {
      fail("has data in another file or in its text; export it as a single binary glTF file without compression");
    }
    const std::size_t length = whole(buffer.at("byteLength"), binary_.size() + 1, "byteLength of the buffer");
    const std::size_t begin = whole_or(view, "byteOffset", length + 1, 0);
    const std::size_t size = whole(view.at("byteLength"), length - begin + 1, "byteLength of a bufferView");
    if (offset > size) {
      fail(fmt::format("byteOffset = {} of an accessor is behind the end of its bufferView", offset));
    }
    return binary_.substr(begin + offset, size - offset);
  }

  /// Numbers that lie one element after another in a buffer view, which `place` names with an offset into it.
  void fill(const Json& place, std::size_t count, std::size_t width, const Component& component, bool normalised,
            const std::function<double&(std::size_t, std::size_t)>& target) const {
    const std::string_view bytes = view(place.at("bufferView"), whole_or(place, "byteOffset", binary_.size() + 1, 0));
    const std::size_t element = width * component.size;
    const std::size_t stride = whole_or(item("bufferViews", place.at("bufferView")), "byteStride", 253, element);
    if (stride < element || (count - 1) * stride + element > bytes.size()) {
      fail(fmt::format("is damaged: {} elements of {} bytes, {} apart, do not fit into a bufferView", count, element,
                       stride));
    }
    for (std::size_t i = 0; i < count; ++i) {
      for (std::size_t c = 0; c < width; ++c) {
        const double value = component.value(bytes.data() + i * stride + c * component.size);
        if (!std::isfinite(value)) {
          fail(fmt::format("element {} of an accessor is not a finite number", i));
        }
        target(i, c) = normalised ? std::max(value / component.most, -1.0) : value;
      }
    }
  }

  const Component& component_of(const Json& object, Use use) const {
    const std::size_t type = whole(object.at("componentType"), 6000, "componentType");
    const auto* found = std::ranges::find(kComponents, type, &Component::type);
    const bool is_index = type == 5121 || type == 5123 || type == 5125;
    if (found == kComponents.end() || (use == Use::kIndices ? !is_index : type == 5125)) {
      fail(fmt::format("componentType {} is not one of {}", type, use == Use::kIndices ? "indices" : "coordinates"));
    }
    return *found;
  }

  /// All numbers of an accessor, element by element.
  std::vector<double> values(const Json& index, const char* type, std::size_t width, Use use) const {
    const Json& accessor = item("accessors", index);
    if (accessor.at("type") != type) {
      fail(fmt::format("accessor {} is of type {}, must be {}", index.dump(), accessor.at("type").dump(), type));
    }
    const Component& component = component_of(accessor, use);
    const bool normalised = accessor.value("normalized", false);
    if (normalised && (use == Use::kIndices || component.most == 0)) {
      fail(fmt::format("accessor {} cannot be normalised", index.dump()));
    }
    // Sparse values alone may change a mesh that is stored too, at a byte or more for each point.
    const std::size_t least = accessor.contains("bufferView") ? width * component.size : 1;
    const std::size_t most = std::min<std::size_t>(binary_.size() / least, kMostFileCorners);
    const std::size_t count = whole(accessor.at("count"), most + 1, "count of an accessor");
    std::vector<double> found(count * width, 0.0);
    const bool sparse = accessor.contains("sparse");
    if (count == 0 || (!sparse && !accessor.contains("bufferView"))) {
      fail(fmt::format("accessor {} has no values of its own; export it without compression", index.dump()));
    }
    if (accessor.contains("bufferView")) {
      fill(accessor, count, width, component, normalised,
           [&](std::size_t i, std::size_t c) -> double& { return found[i * width + c]; });
    }
    if (sparse) {
      const Json& changes = accessor.at("sparse");
      std::vector<double> at(whole(changes.at("count"), count + 1, "count of sparse values"));
      if (!at.empty()) {
        const Json& places = changes.at("indices");
        fill(places, at.size(), 1, component_of(places, Use::kIndices), false,
             [&](std::size_t i, std::size_t) -> double& { return at[i]; });
        if (std::ranges::adjacent_find(at, std::greater_equal<>()) != at.end() ||
            at.back() >= static_cast<double>(count)) {
          fail(fmt::format("sparse indices of accessor {} must rise and be below {}", index.dump(), count));
        }
        fill(changes.at("values"), at.size(), width, component, normalised,
             [&](std::size_t i, std::size_t c) -> double& {
               return found[static_cast<std::size_t>(at[i]) * width + c];
             });
      }
    }
    return found;
  }

  /// From 16 numbers, column by column.
  Eigen::Affine3d affine(const double* matrix) const {
    const Eigen::Matrix4d given = Eigen::Map<const Eigen::Matrix4d>(matrix);
    constexpr double kRounding = 1e-5;
    if (!((given.row(3) - Eigen::RowVector4d(0, 0, 0, 1)).cwiseAbs().maxCoeff() < kRounding)) {
      fail("a matrix has a last row that is not 0 0 0 1");
    }
    return Eigen::Affine3d(Eigen::AffineCompact3d(given.topRows<3>()));
  }

  Eigen::Affine3d local(const Json& node) const {
    if (node.contains("matrix")) {
      return affine(numbers(node, "matrix", std::vector<double>(16)).data());
    }
    const std::vector<double> shift = numbers(node, "translation", {0, 0, 0});
    const std::vector<double> turn = numbers(node, "rotation", {0, 0, 0, 1});
    const std::vector<double> scale = numbers(node, "scale", {1, 1, 1});
    const Eigen::Quaterniond rotation(turn[3], turn[0], turn[1], turn[2]);
    constexpr double kRounding = 1e-2;
    if (!(std::abs(rotation.norm() - 1) < kRounding)) {
      fail(fmt::format("the rotation of a node has length {}, must have 1", rotation.norm()));
    }
    return Eigen::Translation3d(shift[0], shift[1], shift[2]) * rotation.normalized() *
           Eigen::Scaling(scale[0], scale[1], scale[2]);
  }

  /// From a node's frame to the scene's.
  const Eigen::Affine3d& world(std::size_t n, int depth = 0) {
    if (!worlds_[n]) {
      if (depth > kDeepestNode) {
        fail(fmt::format("node {} is more than {} nodes deep, or a child of itself", n, kDeepestNode));
      }
      const Eigen::Affine3d own = local(list("nodes")[n]);
      worlds_[n] = parents_[n] ? world(*parents_[n], depth + 1) * own : own;
    }
    return *worlds_[n];
  }

  /// For each bone of a skin from where its mesh was bound to it to where it is.
  std::vector<Eigen::Affine3d> bones_of(const Json& skin) {
    std::vector<double> bound;
    if (skin.contains("inverseBindMatrices")) {
      bound = values(skin.at("inverseBindMatrices"), "MAT4", 16, Use::kNumbers);
    }
    std::vector<Eigen::Affine3d> bones;
    for (const Json& joint : list("joints", skin)) {
      bones.push_back(world(whole(joint, parents_.size(), "joints of a skin")));
      if (!bound.empty() && bound.size() < 16 * bones.size()) {
        fail("a skin has fewer inverseBindMatrices than joints");
      }
      bones.back() = bound.empty() ? bones.back() : bones.back() * affine(&bound[16 * (bones.size() - 1)]);
    }
    return bones;
  }

  void add_node(std::size_t n) {
    const Json& node = list("nodes")[n];
    if (node.contains("extensions") && node.at("extensions").contains(kInstancing)) {
      refuse_extension(kInstancing);
    }
    if (!node.contains("mesh")) {
      return;
    }
    const Json& mesh = item("meshes", node.at("mesh"));
    const std::vector<double> morphs = numbers(node, "weights", numbers(mesh, "weights", {}));
    const std::vector<Eigen::Affine3d> bones =
        node.contains("skin") ? bones_of(item("skins", node.at("skin"))) : std::vector<Eigen::Affine3d>();
    for (const Json& primitive : list("primitives", mesh)) {
      const std::size_t mode = whole_or(primitive, "mode", 7, 4);
      if (mode < 4) {
        continue;  // points and lines
      }
      const std::size_t first = surface_.points.size();
      const bool mirrored = add_points(primitive, morphs, bones, world(n));
      add_triangles(primitive, mode, first, mirrored);
      require_few(static_cast<std::int64_t>(surface_.points.size()),
                  static_cast<std::int64_t>(surface_.triangles.size()), name_);
    }
  }

  std::vector<double> morphed(const Json& primitive, const std::vector<double>& weights) const {
    std::vector<double> points = values(primitive.at("attributes").at("POSITION"), "VEC3", 3, Use::kNumbers);
    const Json& targets = list("targets", primitive);
    if (!weights.empty() && weights.size() != targets.size()) {
      fail(fmt::format("a mesh has {} weights for {} morph targets", weights.size(), targets.size()));
    }
    for (std::size_t t = 0; t < weights.size(); ++t) {
      if (weights[t] != 0 && targets[t].contains("POSITION")) {
        const std::vector<double> shifts = values(targets[t].at("POSITION"), "VEC3", 3, Use::kNumbers);
        require_size(shifts, points.size() / 3, 3, "a morph target");
        for (std::size_t i = 0; i < points.size(); ++i) {
          points[i] += weights[t] * shifts[i];
        }
      }
    }
    return points;
  }

  void require_size(const std::vector<double>& found, std::size_t count, std::size_t width, const char* what) const {
    if (found.size() != count * width) {
      fail(fmt::format("{} has {} elements for {} points", what, found.size() / width, count));
    }
  }

  /// Adds the points of a primitive where its bones or its node put them.
  /// returns  whether that mirrors it
  bool add_points(const Json& primitive, const std::vector<double>& morphs, const std::vector<Eigen::Affine3d>& bones,
                  const Eigen::Affine3d& by_node) {
    const std::vector<double> given = morphed(primitive, morphs);
    const Json& attributes = primitive.at("attributes");
    const std::size_t count = given.size() / 3;
    const auto at = [&](std::size_t v) { return Vector3(given[3 * v], given[3 * v + 1], given[3 * v + 2]); };
    std::vector<Vector3> points(count, Vector3::Zero());
    std::vector<double> sums(count, 0.0);
    double upright = 0;
    for (int set = 0; !bones.empty() && attributes.contains(fmt::format("WEIGHTS_{}", set)); ++set) {
      const auto weights = values(attributes.at(fmt::format("WEIGHTS_{}", set)), "VEC4", 4, Use::kNumbers);
      const auto joints = values(attributes.at(fmt::format("JOINTS_{}", set)), "VEC4", 4, Use::kIndices);
      require_size(weights, count, 4, "WEIGHTS");
      require_size(joints, count, 4, "JOINTS");
      for (std::size_t i = 0; i < weights.size(); ++i) {
        if (weights[i] == 0) {
          continue;
        }
        if (weights[i] < 0 || joints[i] >= static_cast<double>(bones.size())) {
          fail(fmt::format("point {} has weight {} for bone {} of {}", i / 4, weights[i], joints[i], bones.size()));
        }
        const Eigen::Affine3d& bone = bones[static_cast<std::size_t>(joints[i])];
        points[i / 4] += weights[i] * (bone * at(i / 4));
        sums[i / 4] += weights[i];
        upright += weights[i] * (bone.linear().determinant() < 0 ? -1 : 1);
      }
    }
    for (std::size_t v = 0; v < count; ++v) {
      points[v] = sums[v] > 0 ? Vector3(points[v] / sums[v]) : by_node * at(v);
      unweighted_ += !bones.empty() && sums[v] == 0 ? 1 : 0;
      if (!points[v].allFinite()) {
        fail(fmt::format("point {} of a mesh is not at a finite place", v));
      }
    }
    surface_.points.insert(surface_.points.end(), points.begin(), points.end());
    return upright == 0 ? by_node.linear().determinant() < 0 : upright < 0;
  }

  void add_triangles(const Json& primitive, std::size_t mode, std::size_t first, bool mirrored) {
    std::vector<std::int64_t> corners(surface_.points.size() - first);
    std::iota(corners.begin(), corners.end(), std::int64_t{0});
    if (primitive.contains("indices")) {
      const std::vector<double> named = values(primitive.at("indices"), "SCALAR", 1, Use::kIndices);
      if (const double last = *std::ranges::max_element(named); last >= static_cast<double>(corners.size())) {
        fail(fmt::format("a face names vertex {}, but its mesh has {} (the first is 0)", last, corners.size()));
      }
      corners.assign(named.begin(), named.end());
    }
    std::vector<std::vector<std::int64_t>> triangles;
    if (mode == 5) {
      add_strip(triangles, corners);
    }
    for (std::size_t i = 2; mode != 5 && i < corners.size(); i += mode == 4 ? 3 : 1) {
      triangles.push_back({corners[mode == 4 ? i - 2 : 0], corners[i - 1], corners[i]});
    }
    if (mode == 4 && corners.size() % 3 != 0) {
      fail(fmt::format("{} corners are not a whole number of triangles", corners.size()));
    }
    for (const std::vector<std::int64_t>& triangle : triangles) {
      const auto corner = [&](std::size_t c) { return static_cast<std::int64_t>(first) + triangle[c]; };
      surface_.triangles.push_back({corner(0), corner(mirrored ? 2 : 1), corner(mirrored ? 1 : 2)});
    }
  }

  const std::string& name_;
  std::string_view binary_;
  Json root_;
  std::vector<std::optional<std::size_t>> parents_;     // of the nodes
  std::vector<std::optional<Eigen::Affine3d>> worlds_;  // as far as they were asked for
  std::size_t unweighted_ = 0;
  FileSurface surface_;
};

}  // namespace

FileSurface parse_glb(const std::string& content, const std::string& name) {
  try {
    return Glb(content, name).surface();
  } catch (const Json::exception& error) {
    throw InputError(fmt::format("{}: is not glTF 2.0: {}", name, error.what()));
  }
}

}  // namespace touchfield
