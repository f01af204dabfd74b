#include "sim/mesh/query/skin_patches.h"

#include <gtest/gtest.h>

#include "sim/hand/shapes.h"

namespace touchfield::skin_patches_test {

using Eigen::Index;

double farthest_neighbour(const Points& from, const Points& to) {
  double most = 0;
  for (const auto& x : from.colwise()) {
    most = std::max(most, (to.colwise() - x).colwise().norm().minCoeff());
  }
  return most;
}

TEST(SkinPatches, PiecesCoverTheirFaces) {
  const TriangleMesh mesh = capsule(0.008, 0.02, 0.003).mesh;
  const SkinPatches pieces = pieces_of(mesh, 1e-3, 4);
  EXPECT_NEAR(pieces.areas.sum(), mesh.total_area(), 1e-12 * mesh.total_area());
  EXPECT_NEAR(pieces.faces.sum(), static_cast<double>(mesh.face_count()), 1e-9);
  const TriangleMesh all = pieces.mesh();
  EXPECT_EQ(all.face_count(), pieces.size());
  EXPECT_LT((all.areas() - pieces.areas).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((all.centroids() - pieces.centres()).cwiseAbs().maxCoeff(), 1e-15);
  EXPECT_LT((all.normals() - pieces.normals()).cwiseAbs().maxCoeff(), 1e-9);
  EXPECT_NEAR(all.signed_volume(), mesh.signed_volume(), 1e-9 * mesh.signed_volume());  // none is turned over
  for (Index f = 0; f < all.face_count(); ++f) {
    for (int c = 0; c < 3; ++c) {
      EXPECT_LE((all.corner(f, c) - all.corner(f, (c + 1) % 3)).norm(), 1e-3 * (1 + 1e-9));
    }
  }
  EXPECT_EQ(pieces.owner, std::vector<int>(static_cast<std::size_t>(pieces.size()), 4));
}

TEST(SkinPatches, SpreadOnesLeaveNoGapAndAreNotCrowded) {
  const double radius = 0.03;
  SkinPatches pieces = pieces_of(sphere(radius, 0.004).mesh, 2e-3, 0);
  append(pieces_of(capsule(0.008, 0.02, 0.003).mesh, 2e-3, 1), pieces);
  const double apart = 7e-3;
  const SkinPatches spread_out = spread(pieces, apart, 0);
  const Points centres = spread_out.centres();
  EXPECT_LE(farthest_neighbour(pieces.centres(), centres), apart);
  for (Index j = 1; j < spread_out.size(); ++j) {
    EXPECT_GT((centres.leftCols(j).colwise() - centres.col(j)).colwise().norm().minCoeff(), apart);
  }
  EXPECT_NEAR(spread_out.areas.sum(), pieces.areas.sum(), 1e-12);
  EXPECT_NEAR(spread_out.faces.sum(), pieces.faces.sum(), 1e-9);
  EXPECT_TRUE(std::ranges::is_sorted(spread_out.owner));
  EXPECT_EQ(spread_out.owner.back(), 1);
  // Points that are farther than `apart` from each other stand for 0.87 apart^2 at least, those that leave no gap for
  // 2.6.
  const double each = spread_out.areas.mean() / (apart * apart);
  EXPECT_GT(each, 0.8);
  EXPECT_LT(each, 2.0);
}

TEST(SkinPatches, AsManyAsAskedForAreSpreadOverAll) {
  const SkinPatches pieces = pieces_of(sphere(0.03, 0.004).mesh, 2e-3, 0);
  const SkinPatches many = spread(pieces, 1.0, 400);
  EXPECT_EQ(many.size(), 400);
  const double side = std::sqrt(pieces.areas.sum() / 400);
  EXPECT_LT(farthest_neighbour(pieces.centres(), many.centres()), 1.2 * side);
  EXPECT_EQ(spread(pieces, 0.0, 0).size(), pieces.size());
  EXPECT_EQ(spread(pieces, 1.0, 10 * pieces.size()).size(), pieces.size());
  EXPECT_EQ(spread(pieces, 1.0, 0).size(), 1);
}

}  // namespace touchfield::skin_patches_test
