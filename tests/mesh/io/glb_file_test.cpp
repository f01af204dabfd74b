// Binary glTF: tetrahedra with legs of 1 (volume 1/6) in every way in which a file may store, place and bend them.

#include <cmath>
#include <random>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>

#include "sim/hand/shapes.h"
#include "sim/mesh/io/file_text.h"
#include "sim/mesh/io/mesh_files.h"
#include "tests/support/files.h"
#include "tests/support/testing.h"

namespace touchfield::glb_file_test {

using Json = nlohmann::json;
using Numbers = std::vector<double>;

constexpr int kInt8 = 5120;
constexpr int kUint8 = 5121;
constexpr int kInt16 = 5122;
constexpr int kUint16 = 5123;
constexpr int kUint32 = 5125;
constexpr int kFloat = 5126;

const Numbers kPoints = {0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 1};
const Numbers kFaces = {0, 2, 1, 0, 1, 3, 0, 3, 2, 1, 2, 3};

/// A file in the making: json is what a test may change before it is written.
struct Glb {
  Json json = {{"asset", {{"version", "2.0"}}}, {"scene", 0}, {"scenes", {{{"nodes", {0}}}}}};
  std::string binary;

  std::size_t view(const Numbers& values, int component, std::size_t width, std::size_t stride = 0) {
    Json view = {{"buffer", 0}, {"byteOffset", binary.size()}};
    for (std::size_t i = 0; i < values.size(); ++i) {
      const std::size_t begin = binary.size();
      switch (component) {
        case kInt8:
          append_bytes(binary, static_cast<std::int8_t>(values[i]));
          break;
        case kUint8:
          append_bytes(binary, static_cast<std::uint8_t>(values[i]));
          break;
        case kInt16:
          append_bytes(binary, static_cast<std::int16_t>(values[i]));
          break;
        case kUint16:
          append_bytes(binary, static_cast<std::uint16_t>(values[i]));
          break;
        case kUint32:
          append_bytes(binary, static_cast<std::uint32_t>(values[i]));
          break;
        default:
          append_bytes(binary, static_cast<float>(values[i]));
      }
      if (stride > 0 && (i + 1) % width == 0) {
        binary.append(stride - width * (binary.size() - begin), '\x7F');
        view["byteStride"] = stride;
      }
    }
    view["byteLength"] = binary.size() - view["byteOffset"].get<std::size_t>();
    json["bufferViews"].push_back(view);
    return json["bufferViews"].size() - 1;
  }

  std::size_t add(const Json& accessor) {
    json["accessors"].push_back(accessor);
    return json["accessors"].size() - 1;
  }

  std::size_t accessor(const Numbers& values, int component, const std::string& type, bool normalised = false,
                       std::size_t stride = 0) {
    const std::size_t width = type == "SCALAR" ? 1 : type == "VEC3" ? 3 : type == "VEC4" ? 4 : 16;
    return add({{"bufferView", view(values, component, width, stride)},
                {"componentType", component},
                {"count", values.size() / width},
                {"type", type},
                {"normalized", normalised}});
  }

  std::string bytes() const {
    Json whole = json;
    whole["buffers"].push_back({{"byteLength", binary.size()}});
    if (json.contains("buffers")) {
      whole["buffers"] = json["buffers"];
    }
    std::string text = whole.dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    std::string file = "glTF";
    for (const std::size_t number : {std::size_t{2}, 28 + text.size() + binary.size(), text.size()}) {
      append_bytes(file, static_cast<std::uint32_t>(number));
    }
    file += "JSON" + text;
    append_bytes(file, static_cast<std::uint32_t>(binary.size()));
    return file + std::string("BIN\0", 4) + binary;
  }
};

/// The tetrahedron at node 0.
Glb tetrahedron() {
  Glb glb;
  const std::size_t points = glb.accessor(kPoints, kFloat, "VEC3");
  const std::size_t faces = glb.accessor(kFaces, kUint16, "SCALAR");
  glb.json["meshes"] = {{{"primitives", {{{"attributes", {{"POSITION", points}}}, {"indices", faces}}}}}};
  glb.json["nodes"] = {{{"mesh", 0}}};
  return glb;
}

Json& primitive(Glb& glb) { return glb.json["meshes"][0]["primitives"][0]; }

/// The tetrahedron with its points 0 to 2 on a bone at node 1 and point 3 on one at node 2, which is 5 above it.
Glb skinned(int component = kFloat, bool normalised = false, double one = 1) {
  Glb glb = tetrahedron();
  const Numbers joints = {0, 9, 9, 9, 0, 9, 9, 9, 0, 9, 9, 9, 1, 9, 9, 9};
  Numbers weights(16, 0.0);
  for (const std::size_t first : {0U, 4U, 8U, 12U}) {
    weights[first] = one;
  }
  primitive(glb)["attributes"]["JOINTS_0"] = glb.accessor(joints, kUint8, "VEC4");
  primitive(glb)["attributes"]["WEIGHTS_0"] = glb.accessor(weights, component, "VEC4", normalised);
  glb.json["skins"] = {{{"joints", {1, 2}}}};
  glb.json["nodes"] = {{{"mesh", 0}, {"skin", 0}, {"translation", {9, 9, 9}}, {"scale", {3, 3, 3}}},
                       {{"name", "bone"}, {"children", {2}}},
                       {{"name", "bone"}, {"translation", {0, 0, 5}}}};
  return glb;
}

class GlbFile : public ::testing::Test {
 protected:
  TriangleMesh read(const Glb& glb) const { return read_mesh(folder_.write("t.glb", glb.bytes()), 1.0); }

  void expect_volume(const Glb& glb, double sixths, const Vector3& middle) const {
    const TriangleMesh mesh = read(glb);
    EXPECT_NEAR(6 * mesh.signed_volume(), sixths, 1e-2 * sixths);
    EXPECT_LT((mesh.vertices().rowwise().mean() - middle).norm(), 1e-2) << mesh.vertices();
  }

  const TemporaryDirectory folder_;
  const Vector3 middle_ = Vector3::Constant(0.25);
};

TEST_F(GlbFile, NodesPlaceMeshesByIndex) {
  expect_volume(tetrahedron(), 1, middle_);
  // A parent that moves, a child that doubles and mirrors it: the faces still look outwards.
  Glb glb = tetrahedron();
  glb.json["nodes"] = {{{"children", {2}}, {"translation", {1, 2, 3}}},
                       {{"mesh", 0}},  // not in the scene
                       {{"mesh", 0}, {"scale", {-2, 2, 2}}}};
  expect_volume(glb, 8, {0.5, 2.5, 3.5});
  glb.json["nodes"][2] = {{"mesh", 0}, {"matrix", {0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0, 0, 7, 1}}};
  expect_volume(glb, 1, {0.75, 2.25, 10.25});
  glb.json["nodes"][2] = {{"mesh", 0}, {"rotation", {0, 0, std::sqrt(0.5), std::sqrt(0.5)}}};
  expect_volume(glb, 1, {0.75, 2.25, 3.25});
  glb.json["scenes"] = {{{"nodes", {1}}}, {{"nodes", {0}}}};
  expect_volume(glb, 1, middle_);
  EXPECT_EQ(read(glb).face_count(), 4);
}

TEST_F(GlbFile, NumbersAreOfTheirComponentType) {
  const std::vector<std::pair<int, double>> kinds = {
      {kInt8, 127}, {kUint8, 255}, {kInt16, 32767}, {kUint16, 65535}, {kFloat, 100}};
  for (const auto& [component, most] : kinds) {
    for (const bool normalised : {false, true}) {
      if (normalised && component == kFloat) {
        continue;
      }
      Numbers points = kPoints;
      for (double& x : points) {
        x *= most;
      }
      Glb glb = tetrahedron();
      glb.json["extensionsRequired"] = {"KHR_mesh_quantization"};
      primitive(glb)["attributes"]["POSITION"] = glb.accessor(points, component, "VEC3", normalised, 20);
      const double scale = normalised ? 1.0 : 1.0 / most;
      glb.json["nodes"][0]["scale"] = {scale, scale, scale};
      expect_volume(glb, 1, middle_);
    }
  }
}

TEST_F(GlbFile, CornersAreIndicesOrPointsInOrder) {
  for (const int component : {kUint8, kUint16, kUint32}) {
    Glb glb = tetrahedron();
    primitive(glb)["indices"] = glb.accessor(kFaces, component, "SCALAR");
    expect_volume(glb, 1, middle_);
  }
  Numbers corners;
  for (const double face : kFaces) {
    corners.insert(corners.end(), kPoints.begin() + 3 * static_cast<int>(face),
                   kPoints.begin() + 3 * static_cast<int>(face) + 3);
  }
  Glb glb = tetrahedron();
  primitive(glb) = {{"attributes", {{"POSITION", glb.accessor(corners, kFloat, "VEC3")}}}};
  expect_volume(glb, 1, middle_);
  primitive(glb) = {
      {"attributes", {{"POSITION", 0}}}, {"mode", 5}, {"indices", glb.accessor({0, 2, 1, 3, 0, 2}, kUint8, "SCALAR")}};
  expect_volume(glb, 1, middle_);
  primitive(glb) = {
      {"attributes", {{"POSITION", 0}}}, {"mode", 6}, {"indices", glb.accessor({3, 0, 1, 2, 0}, kUint8, "SCALAR")}};
  EXPECT_EQ(read(glb).face_count(), 3);
  glb.json["meshes"][0]["primitives"].push_back({{"attributes", {{"POSITION", 0}}}, {"mode", 1}});  // lines
  EXPECT_EQ(read(glb).face_count(), 3);
}

TEST_F(GlbFile, SparseValuesReplaceOthers) {
  for (const bool has_base : {true, false}) {
    Glb glb = tetrahedron();
    const Json sparse = {{"count", 3},
                         {"indices", {{"bufferView", glb.view({1, 2, 3}, kUint8, 1)}, {"componentType", kUint8}}},
                         {"values", {{"bufferView", glb.view({1, 0, 0, 0, 1, 0, 0, 0, 2}, kFloat, 3)}}}};
    Json accessor = {{"componentType", kFloat}, {"count", 4}, {"type", "VEC3"}, {"sparse", sparse}};
    if (has_base) {
      accessor["bufferView"] = 0;
    }
    primitive(glb)["attributes"]["POSITION"] = glb.add(accessor);
    expect_volume(glb, 2, {0.25, 0.25, 0.5});
  }
}

TEST_F(GlbFile, DefaultWeightsMorph) {
  Glb glb = tetrahedron();
  const std::size_t taller = glb.accessor({0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 1}, kFloat, "VEC3");
  const std::size_t wider = glb.accessor({0, 0, 0, 2, 0, 0, 0, 0, 0, 0, 0, 0}, kFloat, "VEC3");
  primitive(glb)["targets"] = {{{"POSITION", taller}}, {{"POSITION", wider}}, {{"NORMAL", wider}}};
  expect_volume(glb, 1, middle_);
  glb.json["meshes"][0]["weights"] = {1, 0, 1};
  expect_volume(glb, 2, {0.25, 0.25, 0.5});
  glb.json["nodes"][0]["weights"] = {1, 0.5, 0};
  expect_volume(glb, 4, {0.5, 0.25, 0.5});
}

// Bones of one name, weights of every type, and the mesh's own node does not count.
TEST_F(GlbFile, BonesPlaceSkinsByIndex) {
  for (const auto& [component, normalised, one] :
       {std::tuple{kFloat, false, 1.0}, {kUint8, true, 255.0}, {kUint16, true, 65535.0}}) {
    expect_volume(skinned(component, normalised, one), 6, {0.25, 0.25, 1.5});
  }
  Glb glb = skinned();
  Numbers back(32, 0.0);
  for (const std::size_t diagonal : {0U, 5U, 10U, 15U}) {
    back[diagonal] = back[16 + diagonal] = 1;
  }
  back[16 + 14] = -5;  // where the second bone was when the mesh was bound
  glb.json["skins"][0]["inverseBindMatrices"] = glb.accessor(back, kFloat, "MAT4");
  expect_volume(glb, 1, middle_);
  // A second set of influences: every point half on the other bone.
  glb = skinned();
  Json& attributes = primitive(glb)["attributes"];
  attributes["JOINTS_1"] = glb.accessor({1, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0, 0, 0}, kUint16, "VEC4");
  attributes["WEIGHTS_1"] = attributes["WEIGHTS_0"];
  expect_volume(glb, 1, {0.25, 0.25, 2.75});
}

TEST_F(GlbFile, WhatWouldBeReadWronglyIsRefused) {
  struct Case {
    const char* where;  // a value of the file's JSON
    const char* value;  // that it is given; empty: it is taken away
    const char* says;
  };
  const auto refused = [&](Glb glb, const Case& c) {
    const Json::json_pointer where(c.where);
    if (*c.value == '\0') {
      glb.json[where.parent_pointer()].erase(where.back());
    } else {
      glb.json[where] = Json::parse(c.value);
    }
    EXPECT_THAT(message_of<InputError>([&] { read(glb); }), AllOf(HasSubstr("t.glb: "), HasSubstr(c.says))) << c.where;
  };
  for (const Case& c : {
           Case{"/extensionsRequired", R"(["KHR_draco_mesh_compression"])",
                "KHR_draco_mesh_compression, which is not read; export it without compression"},
           {"/extensionsRequired", R"(["EXT_mesh_gpu_instancing"])", "each as a node of its own"},
           {"/nodes/0/extensions", R"({"EXT_mesh_gpu_instancing": {}})", "EXT_mesh_gpu_instancing"},
           {"/nodes/0/children", "[0]", "child of itself"},
           {"/nodes", R"([{"children": [2]}, {"children": [2]}, {"mesh": 0}])", "node 2 has two parents"},
           {"/scenes/0/nodes", "[0, 0]", "node 0 is in its scene twice"},
           {"/scenes/0/nodes", "[1]", "nodes: 1 must be a whole number below 1"},
           {"/nodes/0/rotation", "[0, 0, 0, 2]", "rotation of a node has length 2"},
           {"/nodes/0/matrix", "[1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1]", "last row"},
           {"/nodes/0/scale", "[1, 1]", "scale has 2 numbers, must have 3"},
           {"/accessors/0/count", "5", "do not fit into a bufferView"},
           {"/bufferViews/0/byteStride", "8", "8 apart"},
           {"/bufferViews/1/byteLength", "25", "byteLength of a bufferView"},
           {"/accessors/0/bufferView", "", "accessor 0 has no values of its own; export it without compression"},
           {"/accessors/1/componentType", "5126", "5126 is not one of indices"},
           {"/accessors/0/normalized", "true", "accessor 0 cannot be normalised"},
           {"/buffers", R"([{"byteLength": 72, "uri": "/etc/passwd"}])", "single binary glTF file"},
           {"/meshes/0/weights", "[1]", "1 weights for 0 morph targets"},
       }) {
    refused(tetrahedron(), c);
  }
  for (const Case& c : {Case{"/skins/0/joints", "[1]", "point 3 has weight 1 for bone 1 of 1"},
                        {"/skins/0/joints", "[1, 7]", "joints of a skin: 7"},
                        {"/nodes/2/children", "[1]", "child of itself"},
                        {"/accessors/3/count", "1", "WEIGHTS has 1 elements for 4 points"}}) {
    refused(skinned(), c);
  }
  Glb beyond = tetrahedron();
  primitive(beyond)["indices"] = beyond.accessor(Numbers{0, 1, 4}, kUint8, "SCALAR");
  EXPECT_THAT(message_of<InputError>([&] { read(beyond); }), HasSubstr("names vertex 4"));
  Glb chain = tetrahedron();
  for (int n = 1; n < 3000; ++n) {
    chain.json["nodes"].push_back({{"children", {n + 1}}});
  }
  chain.json["nodes"].push_back({{"mesh", 0}});
  chain.json["scenes"][0]["nodes"] = {1};
  EXPECT_THAT(message_of<InputError>([&] { read(chain); }), HasSubstr("more than 1000 nodes deep"));
}

TEST_F(GlbFile, DamageIsSeenOrIsHarmless) {
  const std::string good = skinned().bytes();
  const auto read = [&](const std::string& bytes) { read_mesh(folder_.write("d.glb", bytes), 1.0); };
  for (std::size_t cut = 1; cut < good.size(); cut += 7) {
    EXPECT_THROW(read(good.substr(0, cut)), InputError) << cut;
  }
  std::string first_version = good;
  first_version[4] = 1;
  EXPECT_THAT(message_of<InputError>([&] { read(first_version); }), HasSubstr("glTF version 1"));
  EXPECT_THAT(message_of<InputError>([&] { read("v 0 0 0\n"); }), HasSubstr("not a binary glTF file"));
  std::mt19937_64 random(3);
  for (int trial = 0; trial < 800; ++trial) {
    std::string bad = good;
    for (int i = 0; i <= trial / 200; ++i) {
      bad[(random() >> 20U) % bad.size()] = static_cast<char>(random() >> 40U);
    }
    try {
      read(bad);
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr("d.glb"));
    }
  }
  EXPECT_THAT([&] { write_mesh(folder_.file("w.glb"), icosphere(0.01, 1), 1.0); },
              ThrowsMessage<InputError>(HasSubstr("w.glb: .glb is only read; write .stl, ")));
}

}  // namespace touchfield::glb_file_test
