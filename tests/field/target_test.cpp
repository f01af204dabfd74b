#include "sim/field/target.h"

#include "sim/core/rigid_motion.h"
#include "sim/core/units.h"
#include "sim/field/metrics.h"
#include "sim/field/skin_problems.h"
#include "sim/hand/shapes.h"
#include "tests/support/mesh_support.h"
#include "tests/support/output_support.h"
#include "tests/support/testing.h"

namespace touchfield::target_test {

TriangleMesh ball() { return icosphere(10e-3, 8); }

/// The share of a flat triangle that a box holds, from many points of it.
double counted_share(const TriangleMesh& mesh, Eigen::Index face, const TargetBox& box) {
  constexpr int kSteps = 200;
  int held = 0;
  for (int i = 0; i < kSteps; ++i) {
    for (int j = 0; i + j < kSteps; ++j) {
      const double u = (i + 1.0 / 3.0) / kSteps;
      const double v = (j + 1.0 / 3.0) / kSteps;
      held +=
          holds(box, (1 - u - v) * mesh.corner(face, 0) + u * mesh.corner(face, 1) + v * mesh.corner(face, 2)) ? 1 : 0;
    }
  }
  return 2.0 * held / (kSteps * (kSteps + 1.0));
}

TEST(Target, HasOfEachFaceTheShareInTheBox) {
  const TriangleMesh mesh = ball();
  for (const TargetShape shape : {TargetShape::kBox, TargetShape::kCylinder}) {
    const TargetBox box{{0.3e-3, 0.1e-3, -10e-3}, {8e-3, 6e-3, 4e-3}, extrinsic_rotation({0.1, 0.2, 0.3}), shape};
    const Target target = make_target(mesh, {box}, TargetProfile::kUniform, 3000.0);
    Eigen::VectorXd shares = Eigen::VectorXd::Zero(mesh.face_count());
    shares(target.faces) = target.shares;
    for (Eigen::Index f = 0; f < mesh.face_count(); ++f) {
      EXPECT_NEAR(shares(f), counted_share(mesh, f, box), 0.015) << "face " << f;
    }
    EXPECT_TRUE((target.amplitudes.array() == 3000.0).all());
    EXPECT_GT((target.shares.array() < 1.0).count(), 20);
  }
}

/// A flat sheet in the plane z = 0 with edges of `edge` [m], 30 x 30 mm about the origin, turned by 17 degrees.
TriangleMesh turned_sheet(double edge) {
  const auto count = static_cast<int>(std::ceil(30e-3 / edge));
  const TriangleMesh flat = sheet(count, count, edge);
  const Vector3 middle = 0.5 * (flat.vertices().rowwise().minCoeff() + flat.vertices().rowwise().maxCoeff());
  const Eigen::Matrix3d turn = extrinsic_rotation({0, 0, 0.3});
  return transformed(flat, turn, -turn * middle);
}

TEST(Target, HasTheAreaAndWidthThatWereAskedOnAnyMesh) {
  TargetBox tall{{0, 0, 0}, {8e-3, 6e-3, 2e-3}};
  TargetBox round{{0.4e-3, 0, 0}, {7e-3, 7e-3, 2e-3}};
  round.shape = TargetShape::kCylinder;
  const TargetBox beside{{8e-3, 0, 0}, {10e-3, 2e-3, 2e-3}};
  for (const double edge : {0.8e-3, 1.2e-3, 2.4e-3}) {
    const TriangleMesh mesh = turned_sheet(edge);
    const auto area_of = [&](const std::vector<TargetBox>& boxes) {
      return make_target(mesh, boxes, TargetProfile::kUniform, 1.0).areas(mesh.areas()).sum();
    };
    EXPECT_NEAR(area_of({tall}), 48e-6, 1e-9);
    EXPECT_NEAR(area_of({round}), 0.25 * M_PI * 49e-6, 0.002 * 0.25 * M_PI * 49e-6);
    EXPECT_NEAR(area_of({tall, beside}), 48e-6 + 9e-3 * 2e-3, 0.05e-6);  // what both hold counts once
    EXPECT_NEAR(wanted_width(mesh, tall, make_target(mesh, {tall}, TargetProfile::kUniform, 1.0)), 8e-3, 1e-9);
    EXPECT_NEAR(wanted_width(mesh, round, make_target(mesh, {round}, TargetProfile::kUniform, 1.0)), 7e-3, 0.02e-3);
  }
}

// A face that two boxes share is one face, with the mean of what they want of it.
TEST(Target, MixesTwoPressuresOnAFaceByArea) {
  const Points corners{{0, 1e-2, 0}, {0, 0, 1e-2}, {0, 0, 0}};
  const TriangleMesh mesh(corners, Eigen::Vector3i(0, 1, 2));
  TargetBox left{{1e-3, 5e-3, 0}, {2e-3, 20e-3, 1e-3}};     // x from 0 to 2 mm: 18 of 50 mm2
  TargetBox right{{2.5e-3, 5e-3, 0}, {5e-3, 20e-3, 1e-3}};  // to 5 mm: 19.5 mm2 more
  right.level = 0.5;
  left.key = right.key = "target.lines[0]";
  const Target target = make_target(mesh, {left, right}, TargetProfile::kUniform, 100.0);
  ASSERT_EQ(target.size(), 1);
  EXPECT_NEAR(target.shares(0), 37.5 / 50.0, 1e-9);
  EXPECT_NEAR(target.amplitudes(0), (18.0 * 100.0 + 19.5 * 50.0) / 37.5, 1e-6);
  EXPECT_EQ(target.box[0], 1);
}

TEST(Target, PenetrationGrowsWithTheDepthBelowTheEntryFace) {
  const TriangleMesh mesh = ball();
  // The lower pole dips 2 mm into a box whose upper face lies at z = -8 mm: skin that faces down came in from above.
  const TargetBox box{{0, 0, -11e-3}, {20e-3, 20e-3, 6e-3}};
  const Target target = make_target(mesh, {box}, TargetProfile::kPenetration, 500.0);
  const double deepest = -8e-3 - mesh.vertices().row(2).minCoeff();
  for (Eigen::Index i = 0; i < target.size(); ++i) {
    if (target.shares(i) == 1.0) {
      const double depth = -8e-3 - mesh.centroids()(2, target.faces[static_cast<std::size_t>(i)]);
      EXPECT_NEAR(target.amplitudes(i), 500.0 * depth / deepest, 1e-9);
    }
    EXPECT_GT(target.amplitudes(i), 0.0);
  }
  EXPECT_LT(target.amplitudes.maxCoeff(), 500.0);
}

TEST(Target, PenetrationFromBelowIsItsMirrorImage) {
  const TargetBox below{{0, 0, -11e-3}, {20e-3, 20e-3, 6e-3}};
  const TargetBox above{{0, 0, 11e-3}, {20e-3, 20e-3, 6e-3}};
  const auto down = make_target(ball(), {below}, TargetProfile::kPenetration, 500.0);
  const auto up = make_target(ball(), {above}, TargetProfile::kPenetration, 500.0);
  EXPECT_NEAR(down.amplitudes.mean(), up.amplitudes.mean(), 1e-9);  // the icosphere is symmetric in z
}

std::string refusal(const std::vector<TargetBox>& boxes) {
  return message_of<InputError>([&] { make_target(ball(), boxes, TargetProfile::kUniform, 1.0); });
}

TEST(Target, ABoxThatMissesTheSkinSaysByHowMuch) {
  EXPECT_THAT(refusal({{{0, 0, -20e-3}, {8e-3, 8e-3, 4e-3}}}), HasSubstr("target.box: the box about"));
  // The lowest centroid of this sphere lies near z = -10 mm, 8 mm from the box's upper face at -18 mm.
  EXPECT_THAT(refusal({{{0, 0, -20e-3}, {8e-3, 8e-3, 4e-3}}}), HasSubstr("of a face is 8."));
  const TargetBox good{{0, 0, -10e-3}, {8e-3, 8e-3, 4e-3}};
  EXPECT_THAT(refusal({good, {{0, 0, 0}, {1e-3, 1e-3, 1e-3}}}), HasSubstr("target.boxes[1]"));
}

TEST(Target, ABoxAroundTheWholeBodyIsRefused) {
  EXPECT_THAT(refusal({{{0, 0, 0}, {30e-3, 30e-3, 30e-3}}}),
              HasSubstr("target.box covers the whole body (20.1 x 20.1 x 20.1 mm)"));
  EXPECT_THROW(make_target(ball(), {}, TargetProfile::kUniform, 0.0), InputError);
}

TEST(Target, EveryBoxHasItsShareOfThePressure) {
  const TargetBox low{{0, 0, -10e-3}, {8e-3, 8e-3, 4e-3}};
  TargetBox beside{{4e-3, 0, -10e-3}, {8e-3, 8e-3, 6e-3}};
  beside.level = 0.25;
  const TriangleMesh mesh = ball();
  const Target target = make_target(mesh, {low, beside}, TargetProfile::kUniform, 400.0);
  ASSERT_GT(std::ranges::count(target.box, 1), 0);
  for (std::size_t i = 0; i < target.faces.size(); ++i) {
    const Eigen::Index f = target.faces[i];
    const double first = counted_share(mesh, f, low);
    const double pressure = target.amplitudes(static_cast<Eigen::Index>(i));
    if (first == 0.0 || first == 1.0) {
      EXPECT_EQ(target.box[i], first == 1.0 ? 0 : 1);  // a face in both belongs to the first
      EXPECT_NEAR(pressure, target.box[i] == 0 ? 400.0 : 100.0, 10.0);
    }
  }
  // With levels of P, p' is the largest one times the root of the level, also of a mean over parts of a face.
  for (const TargetProfile profile : {TargetProfile::kUniform, TargetProfile::kPenetration}) {
    const Target of_pressure = make_target(mesh, {low, beside}, profile, 400.0);
    const Target of_radiation = make_target(mesh, {low, beside}, profile, 400.0, TargetQuantity::kRadiation);
    EXPECT_TRUE(of_radiation.amplitudes.cwiseAbs2().isApprox(400.0 * of_pressure.amplitudes, 1e-12));
    EXPECT_EQ(of_radiation.shares, of_pressure.shares);
  }
  TargetBox deep = low;
  deep.level = 0.5;
  const auto whole = make_target(mesh, {low}, TargetProfile::kPenetration, 400.0);
  EXPECT_TRUE(
      make_target(mesh, {deep}, TargetProfile::kPenetration, 400.0).amplitudes.isApprox(0.5 * whole.amplitudes));
}

TEST(Target, APartNeedsAFaceButNotEachOfItsBoxes) {
  TargetBox good{{0, 0, -10e-3}, {8e-3, 8e-3, 4e-3}};
  TargetBox empty{{0, 0, 0}, {1e-3, 1e-3, 1e-3}};
  good.key = empty.key = "target.lines[0]";
  EXPECT_TRUE(hold_faces(ball(), {empty, good}));
  EXPECT_NO_THROW(make_target(ball(), {empty, good}, TargetProfile::kUniform, 1.0));
  empty.key = "target.lines[1]";
  EXPECT_FALSE(hold_faces(ball(), {good, empty, empty}));
  EXPECT_THAT(refusal({good, empty, empty}), HasSubstr("target.lines[1]: the box about"));
}

TEST(Target, ARoundBoxIsACylinder) {
  TargetBox round{{0, 0, -10e-3}, {8e-3, 8e-3, 4e-3}};
  round.shape = TargetShape::kCylinder;
  EXPECT_TRUE(holds(round, {3.9e-3, 0, -11.9e-3}));
  EXPECT_FALSE(holds(round, {3e-3, 3e-3, -10e-3}));
  EXPECT_FALSE(holds(round, {0, 0, -12.1e-3}));
  round.centre.z() = -20e-3;
  EXPECT_THAT(refusal({round}), HasSubstr("of a face is 8."));
}

TEST(Target, CentralFaceIsTheOneUnderTheMiddle) {
  const TriangleMesh mesh = ball();
  const Target target = make_target(mesh, {{{0, 0, -10e-3}, {8e-3, 8e-3, 4e-3}}}, TargetProfile::kUniform, 1.0);
  const Vector3 x = mesh.centroids().col(central_face(mesh, target));
  EXPECT_LT(std::hypot(x.x(), x.y()), mesh.mean_edge());
}

TEST(Gram, BlocksEqualTheProductOfTheStackedMatrix) {
  std::srand(5);
  const Eigen::MatrixXcd g = Eigen::MatrixXcd::Random(30, 7);
  const Eigen::MatrixXcd columns = Eigen::MatrixXcd::Random(30, 4);
  const Eigen::VectorXd amplitudes = Eigen::VectorXd::LinSpaced(4, 1.0, 2.5);
  const std::vector<Eigen::Index> faces = {3, 8, 9, 29};
  Eigen::MatrixXcd identity = Eigen::MatrixXcd::Zero(30, 4);
  for (int i = 0; i < 4; ++i) {
    identity(faces[static_cast<std::size_t>(i)], i) = 1.0;
  }
  for (const Eigen::VectorXd& weights :
       {Eigen::VectorXd(Eigen::VectorXd::Ones(30)), Eigen::VectorXd(Eigen::VectorXd::LinSpaced(30, 0.1, 3.0))}) {
    const Eigen::MatrixXcd gram_g = weighted_gram(g, weights);
    const auto roots = weights.cwiseSqrt().asDiagonal();
    Eigen::MatrixXcd c(30, 11);
    c << columns * amplitudes.asDiagonal(), -g;
    c = roots * c;
    const IncidentProblem scattered = scattered_problem(columns, g, gram_g, amplitudes, weights);
    EXPECT_LT((scattered.gram - c.adjoint() * c).norm(), 1e-13 * scattered.gram.norm());
    EXPECT_EQ(scattered.target_count, 4);
    c << identity * amplitudes.asDiagonal(), -g;
    c = roots * c;
    const IncidentProblem unscattered = unscattered_problem(faces, g, gram_g, amplitudes, weights);
    EXPECT_LT((unscattered.gram - c.adjoint() * c).norm(), 1e-13 * unscattered.gram.norm());
  }
}

TEST(Gram, WeighsManyRowsInBlocks) {
  std::srand(6);
  const Eigen::MatrixXcd g = Eigen::MatrixXcd::Random(5000, 3);
  const Eigen::VectorXd weights = Eigen::VectorXd::LinSpaced(5000, 0.5, 1.5);
  const Eigen::MatrixXcd expected = g.adjoint() * weights.asDiagonal() * g;
  EXPECT_LT((weighted_gram(g, weights) - expected).norm(), 1e-13 * expected.norm());
}

TEST(Gram, AreaWeighsFacesByTheirShareAndInteriorPointsAsOneFace) {
  const Eigen::VectorXd areas = (Eigen::VectorXd(3) << 1e-6, 2e-6, 6e-6).finished();
  const Eigen::VectorXd weights = row_weights(FaceWeights::kArea, areas, 5);
  EXPECT_LT((weights - (Eigen::VectorXd(5) << 1.0 / 3, 2.0 / 3, 2.0, 1.0, 1.0).finished()).norm(), 1e-15);
  EXPECT_EQ(row_weights(FaceWeights::kEqual, areas, 5), Eigen::VectorXd::Ones(5));
}

Target held(const TriangleMesh& mesh, const std::vector<TargetBox>& boxes) {
  return make_target(mesh, boxes, TargetProfile::kUniform, 1.0);
}

TEST(OppositeSides, OfABoxThroughAPlate) {
  const TriangleMesh plate = touchfield::box({40e-3, 40e-3, 6e-3}, 1.5e-3).mesh;  // about its own middle
  const double top = plate.vertices().row(2).maxCoeff();
  const Vector3 middle(0, 0, top - 3e-3);
  const OppositeSides through = opposite_sides(plate, held(plate, {{middle, {20e-3, 20e-3, 10e-3}}}));
  EXPECT_NEAR(through.share, 1.0, 1e-12);
  EXPECT_NEAR(through.thickness, 6e-3, 0.2e-3);
  EXPECT_NEAR(std::abs(through.at.z() - middle.z()), 3e-3, 1e-9);
  EXPECT_EQ(opposite_sides(plate, held(plate, {{{0, 0, top}, {20e-3, 20e-3, 4e-3}}})).share, 0.0);
  // A box a side: each is right by itself.
  const std::vector<TargetBox> sides = {{{0, 0, top}, {20e-3, 20e-3, 4e-3}},
                                        {{0, 0, top - 6e-3}, {20e-3, 20e-3, 4e-3}}};
  EXPECT_EQ(opposite_sides(plate, held(plate, sides)).share, 0.0);
}

TEST(OppositeSides, AreNoneOfACapNorOfPadsThatFaceEachOther) {
  EXPECT_EQ(opposite_sides(ball(), held(ball(), {{{0, 0, -10e-3}, {20e-3, 20e-3, 12e-3}}})).share, 0.0);
  const TriangleMesh pads = together(ball(), shifted(ball(), {30e-3, 0, 0}));
  EXPECT_EQ(opposite_sides(pads, held(pads, {{{15e-3, 0, 0}, {16e-3, 10e-3, 10e-3}}})).share, 0.0);
}

}  // namespace touchfield::target_test
