#include <gtest/gtest.h>

#include "sim/bem/scattering_solver.h"
#include "sim/hand/shapes.h"

namespace touchfield::factored_transfer_test {

TransducerArray channels(double height) {
  Points at(3, 5);
  at << 0.01, -0.03, 0.002, 0.05, -0.01,  //
      0.02, 0.0, 0.01, -0.04, 0.03,       //
      0.15, 0.12, -0.1, 0.02, 0.2;
  at.row(2).array() += height;
  return make_array({at, Vector3::UnitZ().replicate(1, 5), Eigen::VectorXi::Zero(5), Eigen::VectorXi::Zero(5)},
                    Directivity::omni(), 1.0, 1.0);
}

class FactoredTransferOf : public ::testing::TestWithParam<Scheme> {};

INSTANTIATE_TEST_SUITE_P(EveryScheme, FactoredTransferOf, ::testing::ValuesIn(all_schemes()),
                         [](const auto& info) { return to_string(info.param); });

// Single precision: k r of 150 is known to 1e-5, times what a condition below 100 makes of it.
TEST_P(FactoredTransferOf, MultipliesByTheTransferMatrixOfTheDoubleSolver) {
  const ScatteringSystem system(icosphere(7e-3, 3), {air(293.15), 40e3}, GetParam());
  const DenseLu lu(system.dense());
  FactoredTransfer factored(system);
  for (const double height : {0.0, 0.03}) {  // the array moves, the factors stay
    const TransducerArray array = channels(height);
    const IncidentField unit = system.incident(array);
    const Eigen::MatrixXcd h = system.pressure(lu.solve(system.right_hand_side(unit)), unit);
    factored.face(system, array);
    std::srand(3);
    const Eigen::VectorXcd q = Eigen::VectorXcd::Random(array.size());
    const Eigen::VectorXcd v = Eigen::VectorXcd::Random(system.faces());
    const Eigen::VectorXcd p = h * q;
    const Eigen::VectorXcd back = h.adjoint() * v;
    EXPECT_LT((factored.pressure(q.cast<std::complex<float>>()).cast<Complex>() - p).norm(), 1e-4 * p.norm());
    EXPECT_LT((factored.sent_back(v.cast<std::complex<float>>()).cast<Complex>() - back).norm(), 1e-4 * back.norm());
  }
}

}  // namespace touchfield::factored_transfer_test
