#include <cmath>

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/field/skin_problems.h"
#include "sim/hand/shapes.h"
#include "solvers/linear/low_rank.h"
#include "solvers/phase/skin_problem.h"

namespace touchfield::skin_reduction_test {

using Eigen::Index;
using Eigen::MatrixXcd;
using Eigen::VectorXcd;

struct Skin {
  MatrixXcd h;
  Eigen::VectorXd areas;
  Target target;
};

/// A transfer matrix whose singular values fall like those of a field seen from far.
Skin make_skin(Index faces, Index channels) {
  std::srand(5);
  const Index rank = std::min(faces, channels);
  Eigen::VectorXd fall(rank);
  for (Index i = 0; i < rank; ++i) {
    fall(i) = std::pow(0.7, static_cast<double>(i));
  }
  Skin skin;
  skin.h = MatrixXcd::Random(faces, rank) * fall.asDiagonal() * MatrixXcd::Random(rank, channels);
  skin.areas = Eigen::VectorXd::Random(faces).array() + 1.5;
  skin.target.faces = {2, 3, 7};
  skin.target.amplitudes = Eigen::Vector3d(1.0, 0.0, 2.5);
  skin.target.shares = Eigen::Vector3d(1.0, 0.25, 0.6);
  return skin;
}

/// sum s A (|p| - p')^2 + w_Z (1 - s) A |p|^2, from its definition.
double cost_of(const Skin& skin, double outside_weight, const VectorXcd& q) {
  const VectorXcd p = skin.h * q;
  double cost = 0;
  for (Index f = 0; f < p.size(); ++f) {
    Index k = 0;
    while (k < 3 && skin.target.faces[static_cast<std::size_t>(k)] != f) {
      ++k;
    }
    const double share = k < 3 ? skin.target.shares(k) : 0.0;
    const double off = k < 3 ? std::abs(p(f)) - skin.target.amplitudes(k) : 0.0;
    cost += skin.areas(f) * (share * off * off + outside_weight * (1.0 - share) * std::norm(p(f)));
  }
  return cost;
}

Eigen::VectorXd outside_of(const Skin& skin, double outside_weight) {
  return OutsideSkin().face_weights(skin.areas, skin.target, outside_weight);
}

TEST(SkinReduction, KeepsTheCost) {
  const Skin skin = make_skin(80, 30);
  for (const double weight : {1.0, 0.1}) {
    const SkinReduction reduction = reduced_skin_problem(skin.h, MatrixXcd::Identity(30, 30), skin.areas, skin.target,
                                                         outside_of(skin, weight), 1e-9);
    for (int i = 0; i < 5; ++i) {
      const VectorXcd q = VectorXcd::Random(30);
      const double expected = cost_of(skin, weight, q);
      EXPECT_NEAR(skin_cost(reduction.problem, q), expected, 1e-10 * expected);
    }
  }
}

TEST(SkinReduction, LeavesOutWhatItSays) {
  const Skin skin = make_skin(80, 30);
  for (const double tolerance : {1e-1, 1e-2, 1e-3}) {
    const SkinReduction reduction = reduced_skin_problem(skin.h, MatrixXcd::Identity(30, 30), skin.areas, skin.target,
                                                         outside_of(skin, 1.0), tolerance);
    const Eigen::VectorXd outside = outside_of(skin, 1.0);
    const double all = (outside.cwiseSqrt().asDiagonal() * skin.h).squaredNorm();
    const double kept = reduction.problem.outside.squaredNorm();
    EXPECT_NEAR(std::sqrt((all - kept) / all), reduction.left_out, 1e-9);
    // Each dropped direction has at most tolerance of the largest; 30 of them in all.
    EXPECT_LE(reduction.left_out, tolerance * std::sqrt(30.0));
    EXPECT_LT(reduction.problem.outside.rows(), 30);
    // Dropping rows only lowers the cost.
    const VectorXcd q = VectorXcd::Random(30);
    EXPECT_LE(skin_cost(reduction.problem, q), cost_of(skin, 1.0, q) * (1 + 1e-12));
  }
}

TEST(SkinReduction, DrivesThatSpanAllWillDo) {
  const Skin skin = make_skin(60, 90);  // rank 60 at most
  const LowRank low = compressed(skin.h.adjoint(), 1e-7);
  const SkinReduction reduction =
      reduced_skin_problem(skin.h * low.basis, low.basis, skin.areas, skin.target, outside_of(skin, 1.0), 1e-9);
  const VectorXcd q = VectorXcd::Random(90);
  // What the basis leaves out, 1e-7 of the largest pressures, enters linearly at the target.
  EXPECT_NEAR(skin_cost(reduction.problem, q), cost_of(skin, 1.0, q), 1e-5 * cost_of(skin, 1.0, q));
}

TEST(SkinReduction, RowsThatAreAddedKeepTheCost) {
  const Skin skin = make_skin(80, 30);
  for (const Index count : {4, 60}) {  // fewer rows than channels in all, and more
    const MatrixXcd rows = MatrixXcd::Random(count, 30);
    SkinReduction reduction =
        reduced_skin_problem(skin.h, MatrixXcd::Identity(30, 30), skin.areas, skin.target, outside_of(skin, 1.0), 1e-2);
    const MatrixXcd before = reduction.problem.outside;
    const double dropped =
        std::pow(reduction.left_out, 2) / (1 - std::pow(reduction.left_out, 2)) * before.squaredNorm();
    add_outside_rows(rows, 1e-9, reduction);
    const MatrixXcd& outside = reduction.problem.outside;
    EXPECT_LE(outside.rows(), std::min<Index>(30, before.rows() + count));
    const VectorXcd q = VectorXcd::Random(30);
    const double expected = (before * q).squaredNorm() + (rows * q).squaredNorm();
    EXPECT_NEAR((outside * q).squaredNorm(), expected, 1e-10 * expected);
    const MatrixXcd mutual = outside * outside.adjoint();
    EXPECT_LT((mutual - MatrixXcd(mutual.diagonal().asDiagonal())).norm(), 1e-10 * mutual.norm());
    const double all = before.squaredNorm() + rows.squaredNorm() + dropped;
    EXPECT_NEAR(reduction.left_out, std::sqrt(dropped / all), 1e-9);
  }
}

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

}  // namespace touchfield::skin_reduction_test
