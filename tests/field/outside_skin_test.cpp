#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/field/skin_problems.h"
#include "sim/hand/shapes.h"

namespace touchfield::outside_skin_test {

using Eigen::VectorXd;

class OutsideSkinTest : public testing::Test {
 protected:
  OutsideSkinTest() {
    target_.faces = {1, 4};
    target_.amplitudes = Eigen::Vector2d(1, 2);
    target_.shares = Eigen::Vector2d(1, 0.75);
    outside_.faces = VectorXd::Ones(6);
    outside_.faces(2) = 0;
    outside_.beyond = spread(pieces_of(sphere(0.01, 0.004).mesh, 2e-3, 0), 6e-3, 0);
    for (Eigen::Index c = 0; c < outside_.beyond.corners.cols(); ++c) {
      outside_.beyond.corners(2, c) += 0.06;
    }
    outside_.array = make_array(grid_layout(4, 4, 0.01), Directivity::omni(), 1.0, 4.386);
  }

  Wave wave_{air(293.15), 40e3};
  VectorXd areas_ = VectorXd::LinSpaced(6, 1e-6, 2e-6);
  Target target_;
  OutsideSkin outside_;
};

TEST_F(OutsideSkinTest, FacesThatAreNoSkinDoNotCount) {
  const VectorXd weights = outside_.face_weights(areas_, target_, 0.5);
  for (Eigen::Index f = 0; f < 6; ++f) {
    EXPECT_EQ(weights(f), f == 1 || f == 2 ? 0.0 : (f == 4 ? 0.25 : 1.0) * 0.5 * areas_(f)) << f;
  }
  const VectorXd misfit = outside_.misfit_weights(FaceWeights::kArea, areas_, 8);
  EXPECT_EQ(misfit(2), 0.0);
  EXPECT_DOUBLE_EQ(misfit(4), areas_(4) / areas_.mean());
  EXPECT_EQ(misfit(7), 1.0);  // a row of an interior point
  EXPECT_EQ(OutsideSkin().misfit_weights(FaceWeights::kEqual, areas_, 6), VectorXd::Ones(6));
}

TEST_F(OutsideSkinTest, SkinBeyondCountsByItsIncidentPressure) {
  const Eigen::MatrixXcd p = incident_matrix(outside_.array, wave_, outside_.beyond.centres());
  const Eigen::VectorXcd q = Eigen::VectorXcd::Random(p.cols());
  const VectorXd squares = (p * q).cwiseAbs2();
  const double rows = (outside_.beyond_rows(wave_, 0.3) * q).squaredNorm();
  EXPECT_NEAR(rows, 0.3 * 2 * outside_.beyond.areas.dot(squares), 1e-12 * rows);
  const auto gram = [&](FaceWeights faces) {
    return (q.adjoint() * outside_.beyond_gram(faces, wave_, 2e-6) * q)(0).real();
  };
  EXPECT_NEAR(gram(FaceWeights::kArea), outside_.beyond.areas.dot(squares) / 2e-6, 1e-10 * gram(FaceWeights::kArea));
  EXPECT_NEAR(gram(FaceWeights::kEqual), outside_.beyond.faces.dot(squares), 1e-10 * gram(FaceWeights::kEqual));
  EXPECT_EQ(OutsideSkin().beyond_gram(FaceWeights::kArea, wave_, 1.0).size(), 0);
}

}  // namespace touchfield::outside_skin_test
