#include <assimp/Importer.hpp>
#include <assimp/scene.h>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/mesh/io/isolated_surface.h"

namespace touchfield {

namespace {

/// From a node's frame to the file's.
aiMatrix4x4 placed(const aiNode* node) {
  aiMatrix4x4 to_file;
  for (; node != nullptr; node = node->mParent) {
    to_file = node->mTransformation * to_file;
  }
  return to_file;
}

/// Adds the triangles of a mesh, with its points as its node places them or, if it has bones, as these do.
void add_mesh(const aiScene& scene, const aiNode& node, const aiMesh& mesh, FileSurface& surface) {
  const std::size_t first = surface.points.size();
  surface.points.resize(first + mesh.mNumVertices, Vector3::Zero());
  std::vector<double> weights(mesh.mNumVertices, 0.0);
  const auto add = [&](const aiMatrix4x4& place, std::size_t v, double weight) {
    const aiVector3D x = place * mesh.mVertices[v];
    surface.points[first + v] += weight * Vector3(x.x, x.y, x.z);
    weights[v] += weight;
  };
  for (unsigned b = 0; b < mesh.mNumBones; ++b) {
    const aiBone& bone = *mesh.mBones[b];
    const aiMatrix4x4 place = placed(scene.mRootNode->FindNode(bone.mName)) * bone.mOffsetMatrix;
    for (unsigned w = 0; w < bone.mNumWeights; ++w) {
      add(place, bone.mWeights[w].mVertexId, static_cast<double>(bone.mWeights[w].mWeight));
    }
  }
  const aiMatrix4x4 by_node = placed(&node);
  for (std::size_t v = 0; v < weights.size(); ++v) {
    if (weights[v] > 0) {
      surface.points[first + v] /= weights[v];
    } else {
      add(by_node, v, 1.0);
    }
  }
  const bool mirrored = mesh.mNumBones == 0 && by_node.Determinant() < 0;
  for (unsigned f = 0; f < mesh.mNumFaces; ++f) {
    if (const aiFace& face = mesh.mFaces[f]; face.mNumIndices == 3) {  // others are points and lines
      const auto corner = [&](int c) { return static_cast<std::int64_t>(first + face.mIndices[c]); };
      surface.triangles.push_back({corner(0), corner(mirrored ? 2 : 1), corner(mirrored ? 1 : 2)});
    }
  }
}

void add_node(const aiScene& scene, const aiNode& node, FileSurface& surface) {
  for (unsigned m = 0; m < node.mNumMeshes; ++m) {
    add_mesh(scene, node, *scene.mMeshes[node.mMeshes[m]], surface);
  }
  for (unsigned c = 0; c < node.mNumChildren; ++c) {
    add_node(scene, *node.mChildren[c], surface);
  }
}

/// In the process of its own.
void send_glb(const Emit& emit, const std::string& content, const std::string& name) {
  Assimp::Importer importer;
  const aiScene* scene = importer.ReadFileFromMemory(content.data(), content.size(), 0, "glb");
  if (scene == nullptr || scene->mRootNode == nullptr) {
    throw InputError(fmt::format("{}: assimp cannot read it as binary glTF: {}", name, importer.GetErrorString()));
  }
  FileSurface surface;
  add_node(*scene, *scene->mRootNode, surface);
  send_number(emit, static_cast<std::int64_t>(surface.points.size()));
  send_numbers(emit, surface.points.data(), surface.points.size());
  send_number(emit, static_cast<std::int64_t>(surface.triangles.size()));
  for (const auto& triangle : surface.triangles) {
    send_number(emit, 3);
    send_numbers(emit, triangle.data(), 3);
  }
  send_number(emit, 0);  // strips
}

}  // namespace

FileSurface parse_glb(const std::string& content, const std::string& name) {
  if (!content.starts_with("glTF")) {  // assimp would go by the content
    throw InputError(fmt::format("{}: not a binary glTF file: it does not begin with 'glTF'", name));
  }
  return isolated_surface(content, name, [&](const Emit& emit) { send_glb(emit, content, name); });
}

}  // namespace touchfield
