#include "sim/motion/motion_instants.h"

#include "sim/run/motion_file.h"
#include "sim/run/motion_summary.h"
#include "tests/support/files.h"
#include "tests/support/motion_support.h"
#include "tests/support/output_support.h"
#include "tests/support/same_support.h"
#include "tests/support/testing.h"

namespace touchfield::motion_instants_test {

TEST(MotionInstants, LieEvenlyOverTheMotion) {
  EXPECT_EQ(spread_numbers(3, 6), (std::vector<int>{0, 1, 2}));
  EXPECT_EQ(spread_numbers(12, 3), (std::vector<int>{2, 6, 10}));
  EXPECT_EQ(spread_numbers(0, 6), std::vector<int>());
  EXPECT_EQ(most_instants(15'000, 6), 48);
  EXPECT_EQ(most_instants(200'000, 2), 17);
  EXPECT_EQ(most_instants(2'000'000, 2), 6);
  EXPECT_EQ(some_instants(full_motion(), 2).back().time, full_motion().instants.back().time);
}

TEST(MotionInstants, AreWithinAMicrometreAndATenThousandth) {
  const Motion motion = full_motion();
  for (const MotionInstant& instant : motion.instants) {
    const MotionInstant round = rounded(instant);
    EXPECT_LE((round.mesh.vertices() - instant.mesh.vertices()).cwiseAbs().maxCoeff(), 0.5e-6);
    const Eigen::VectorXcd& pressure = instant.pressure[0].second;
    EXPECT_LE((round.pressure[0].second - pressure).cwiseAbs().maxCoeff(), 1e-4 * pressure.cwiseAbs().maxCoeff());
  }
  MotionInstant thin = motion.instants.front();
  const Points needle{{0, 0.02, 0.01}, {0, 0, 3e-7}, {0, 0, 0}};
  thin.mesh = TriangleMesh(needle, Triangles{{0}, {1}, {2}});
  expect_same(rounded(thin).mesh, thin.mesh);
}

}  // namespace touchfield::motion_instants_test
