#include "sim/cameras/skin_grid.h"

#include "sim/mesh/query/face_tree.h"

namespace touchfield {

SkinGrid::SkinGrid(const TriangleMesh& skin, double cell, double margin) : cell_(cell) {
  least_ = skin.vertices().rowwise().minCoeff() - Vector3::Constant(margin);
  const Vector3 size = skin.vertices().rowwise().maxCoeff() + Vector3::Constant(margin) - least_;
  count_ = (size / cell).array().ceil().cast<int>();
  last_ = (count_ - 1).cast<double>();
  const FaceTree tree(skin);
  nearest_.resize(static_cast<std::size_t>(count_.prod()));
#pragma omp parallel for
  for (int z = 0; z < count_.z(); ++z) {
    for (int y = 0; y < count_.y(); ++y) {
      for (int x = 0; x < count_.x(); ++x) {
        const SkinPoint found = tree.nearest(least_ + cell * Vector3(x + 0.5, y + 0.5, z + 0.5));
        const int place = (z * count_.y() + y) * count_.x() + x;
        nearest_[static_cast<std::size_t>(place)] = {found.at, skin.normals().col(found.face)};
      }
    }
  }
}

}  // namespace touchfield
