#include "sim/field/evaluate.h"
#include "tests/support/testing.h"

namespace touchfield::field_grid_test {

TEST(FieldGrid, APlaneHasBothBordersAndOneLayer) {
  const FieldGrid grid = centred_grid("side", {0, 0, 0.2}, {0.12, 0.0, 0.24}, 1e-3);
  EXPECT_EQ(grid.count, (std::array<int, 3>{121, 1, 241}));
  const Points x = grid.points();
  EXPECT_EQ(x.cols(), grid.size());
  EXPECT_LT((x.col(0) - Vector3(-0.06, 0, 0.08)).norm(), 1e-15);
  EXPECT_LT((x.col(1) - Vector3(-0.059, 0, 0.08)).norm(), 1e-15);  // x fastest
  EXPECT_LT((x.col(x.cols() - 1) - Vector3(0.06, 0, 0.32)).norm(), 1e-14);
}

TEST(FieldGrid, SpacingShrinksToFitTheSize) {
  const FieldGrid grid = centred_grid("cube", Vector3::Zero(), {0.01, 0.01, 0.01}, 3e-3);
  EXPECT_EQ(grid.count, (std::array<int, 3>{5, 5, 5}));
  EXPECT_DOUBLE_EQ(grid.spacing.x(), 2.5e-3);
}

TEST(FieldGrid, RefusesNegativeSizes) {
  EXPECT_THROW(centred_grid("g", Vector3::Zero(), {-0.01, 0, 0}, 1e-3), InputError);
  EXPECT_THROW(centred_grid("g", Vector3::Zero(), {0.01, 0, 0}, 0.0), InputError);
}

}  // namespace touchfield::field_grid_test
