#include <optional>

#include <gtest/gtest.h>

#include "sim/core/errors.h"
#include "sim/field/skin_problems.h"
#include "sim/gpu/on_card.h"
#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "solvers/linear/blas_product.h"
#include "tests/gpu/card.h"
#include "tests/support/mesh_support.h"

namespace touchfield {
namespace {

Wave wave(double absorption = 0.0) {
  Medium medium = air(293.15);
  medium.absorption = absorption;
  return {medium, 40e3};
}

constexpr double kTolerance = kFinestOnCard;

/// A small array 120 mm below the body.
TransducerArray array(int side = 8, double pitch = 10.16e-3) {
  ArrayLayout layout = grid_layout(side, side, pitch);
  layout = transformed(layout, Eigen::Matrix3d::Identity(), Vector3(0.0, 0.0, -0.12));
  return make_array(layout, Directivity::t4010a1(), 1.0, kAutd3SourceStrength);
}

Eigen::MatrixXcd drives(Eigen::Index channels, Eigen::Index columns) {
  Eigen::MatrixXcd q(channels, columns);
  for (Eigen::Index s = 0; s < columns; ++s) {
    for (Eigen::Index n = 0; n < channels; ++n) {
      q(n, s) = std::polar(1.0, 0.37 * static_cast<double>((n * n + 5 * n * s + 3 * s) % 97));
    }
  }
  return q;
}

/// Round, 24 mm across, so much of that thick.
TriangleMesh plate(double thickness) {
  const TriangleMesh ball = sphere(12e-3, 2e-3).mesh;
  Eigen::Matrix3Xd vertices = ball.vertices();
  vertices.row(2) *= thickness;
  return {vertices, ball.triangles()};
}

/// Two plates a third of a wavelength apart: what is between them resonates.
TriangleMesh gap() {
  return together(shifted(plate(0.25), Vector3(0.0, 0.0, -4.5e-3)), shifted(plate(0.25), Vector3(0.0, 0.0, 4.5e-3)));
}

TriangleMesh small_hand() {
  HandOptions options;
  options.edge = 5.3e-3;  // at which no plain scheme is near a resonance
  return hand(options).mesh;
}

struct Reference {
  Reference(const TriangleMesh& mesh, const Wave& w, Scheme scheme) : system(mesh, w, scheme) {
    SolverOptions options;
    options.kind = SolverKind::kLu;
    options.precision = Precision::kDouble;
    options.tolerance = 1e-10;
    solver = make_solver(system, options);
  }
  Eigen::MatrixXcd pressure(const TransducerArray& sources, const Eigen::MatrixXcd& q) const {
    const IncidentField field = system.incident(sources, q);
    return system.pressure(solver->solve(system.right_hand_side(field)).x, field);
  }
  ScatteringSystem system;
  std::unique_ptr<ScatteringSolver> solver;
};

double largest_difference(const Eigen::MatrixXcd& a, const Eigen::MatrixXcd& b) {
  return (a - b).cwiseAbs().maxCoeff() / b.cwiseAbs().maxCoeff();
}

std::shared_ptr<const Eigen::MatrixXcd> shared(const Eigen::MatrixXcd& drives) {
  return std::make_shared<const Eigen::MatrixXcd>(drives);
}

class BodyOnCardTest : public CardTest {
 protected:
  BodyOnCard body(const ScatteringSystem& system, double tolerance = kTolerance,
                  std::optional<SolverKind> kind = std::nullopt) {
    SolverOptions options;
    options.tolerance = tolerance;
    options.kind = kind.value_or(SolverKind::kLu);
    return {shared_gpu(0), system, options, !kind};
  }
};

class CardPressures : public BodyOnCardTest, public ::testing::WithParamInterface<std::tuple<int, Scheme>> {};

// The card's promise.
TEST_P(CardPressures, AreThoseInDouble) {
  const auto [shape, scheme] = GetParam();
  const TriangleMesh mesh = shape == 0   ? icosphere(12e-3, 8)
                            : shape == 1 ? gap()
                            : shape == 2 ? small_hand()
                                         : plate(0.125);
  const bool cured = traits(scheme).burton_miller;
  const Reference reference(mesh, wave(), scheme);
  const TransducerArray sources = array();
  for (const Eigen::Index columns : {1, 20}) {
    const Eigen::MatrixXcd q = drives(sources.size(), columns);
    BodyOnCard card = body(reference.system, cured ? kTolerance : 3e-5);
    const Solved solved = card.pressure(sources, q);
    EXPECT_TRUE(solved.report.converged) << solved.report.residual;
    EXPECT_LT(largest_difference(solved.x, reference.pressure(sources, q)), cured ? 1e-4 : 1e-3)
        << columns << " columns";
  }
}

INSTANTIATE_TEST_SUITE_P(Bodies, CardPressures,
                         ::testing::Combine(::testing::Values(0, 1, 2, 3),
                                            ::testing::Values(Scheme::kPaper, Scheme::kPaperCorrected,
                                                              Scheme::kBurtonMiller, Scheme::kBurtonMillerPolished)));

TEST_F(BodyOnCardTest, EverySolverGivesTheSame) {
  const Reference reference(icosphere(12e-3, 8), wave(0.3), Scheme::kBurtonMillerPolished);
  const TransducerArray sources = array();
  const Eigen::MatrixXcd q = drives(sources.size(), 11);
  const Eigen::MatrixXcd expected = reference.pressure(sources, q);
  for (const SolverKind kind : {SolverKind::kLu, SolverKind::kGmres, SolverKind::kMatrixFree}) {
    BodyOnCard card = body(reference.system, kTolerance, kind);
    const Solved solved = card.pressure(sources, q);
    EXPECT_TRUE(solved.report.converged) << to_string(kind);
    EXPECT_EQ(card.kind(), kind);
    EXPECT_LT(largest_difference(solved.x, expected), 1e-4) << to_string(kind);
    const Solved again = card.pressure(sources, q);
    EXPECT_EQ(again.x, solved.x) << to_string(kind) << ": not to the last bit";
  }
}

TEST_F(BodyOnCardTest, SpansAllChannels) {
  const Reference reference(icosphere(12e-3, 8), wave(), Scheme::kBurtonMillerPolished);
  const TransducerArray sources = array();
  const std::vector<Eigen::Index> faces = {3, 500, 17};
  const Eigen::VectorXd weights = reference.system.mesh().areas();
  BodyOnCard card = body(reference.system);
  const BodyOnCard::Wanted wanted{faces, &weights, 1e-4};
  const BodyOnCard::Spanned spanned = card.spanned(sources, 1e-4, wanted);
  EXPECT_LT(spanned.drives, sources.size());
  EXPECT_LE(spanned.left_out, 1e-4);
  EXPECT_EQ(card.spanned_pressure().cols(), spanned.drives);
  const Eigen::Index channels = sources.size();
  const auto one = Eigen::MatrixXcd::Identity(channels, channels);
  const Eigen::MatrixXcd h = reference.pressure(sources, one);
  // What V leaves out of all channels together may be of one.
  EXPECT_LT(largest_difference(spanned.target, h(faces, Eigen::all)), 1e-3);
  const Eigen::MatrixXcd gram = h.adjoint() * weights.asDiagonal() * h;
  EXPECT_LT(largest_difference(spanned.outside.adjoint() * spanned.outside, gram), 3e-4);
  EXPECT_LE(spanned.outside_left_out, 1e-4 * std::sqrt(static_cast<double>(channels)));
  const Eigen::VectorXd strengths = spanned.outside.rowwise().norm();
  EXPECT_TRUE(std::is_sorted(strengths.begin(), strengths.end(), std::greater<>()));
  // Of drives that are given.
  const Eigen::MatrixXcd drives =
      Eigen::HouseholderQR<Eigen::MatrixXcd>(one.leftCols(9) + 0.3 * one.middleCols(1, 9)).householderQ() *
      one.leftCols(9);
  const Eigen::MatrixXcd p = reference.pressure(sources, drives);
  const auto kept = shared(drives);
  const BodyOnCard::Spanned given = card.spanned(sources, kept, wanted);
  EXPECT_LT(largest_difference(card.spanned_pressure(), p), 1e-4);
  EXPECT_LT(largest_difference(given.target, p(faces, Eigen::all) * drives.adjoint()), 1e-4);
  EXPECT_LT(largest_difference(given.outside.adjoint() * given.outside,
                               drives * (p.adjoint() * weights.asDiagonal() * p) * drives.adjoint()),
            2e-4);
  const BodyOnCard::Spanned all_rows = card.spanned(sources, kept, {faces, &weights, 0.0});
  EXPECT_EQ(all_rows.outside.rows(), drives.cols());
  EXPECT_EQ(all_rows.outside_left_out, 0.0);
  EXPECT_LT(largest_difference(all_rows.outside.adjoint() * all_rows.outside,
                               drives * (p.adjoint() * weights.asDiagonal() * p) * drives.adjoint()),
            2e-4);
  // No Cholesky factor: no more rows than faces that count.
  Eigen::VectorXd few = Eigen::VectorXd::Zero(weights.size());
  few.head(4) = weights.head(4);
  const BodyOnCard::Spanned few_rows = card.spanned(sources, kept, {faces, &few, 0.0});
  EXPECT_LT(largest_difference(few_rows.outside.adjoint() * few_rows.outside,
                               drives * (p.adjoint() * few.asDiagonal() * p) * drives.adjoint()),
            2e-4);
  const BodyOnCard::Spanned again = card.spanned(sources, kept, wanted);
  EXPECT_LE(again.report.steps, 2);  // by the factors at hand
  EXPECT_LT(largest_difference(again.target, given.target), 1e-6);
}

TEST_F(BodyOnCardTest, RowsByReciprocityAreThoseForwards) {
  for (const Scheme scheme : {Scheme::kPaper, Scheme::kBurtonMillerPolished}) {
    const Reference reference(icosphere(12e-3, 8), wave(), scheme);
    const TransducerArray sources = array(5);
    const std::vector<Eigen::Index> faces = {3, 500, 17, 600};
    BodyOnCard card = body(reference.system);
    const Solved rows = card.transfer_rows(sources, faces);
    const Eigen::MatrixXcd h = reference.pressure(sources, Eigen::MatrixXcd::Identity(25, 25));
    EXPECT_LT(largest_difference(rows.x, h(faces, Eigen::all)), 1e-4) << to_string(scheme);
  }
}

TEST_F(BodyOnCardTest, FollowsABodyThatMoves) {
  const TriangleMesh mesh = icosphere(12e-3, 8);
  Eigen::Matrix3Xd vertices = mesh.vertices();
  vertices.row(0) *= 1.1;
  vertices.colwise() += Vector3(1e-3, -2e-3, 3e-3);
  const TriangleMesh moved(vertices, mesh.triangles());
  const Reference reference(moved, wave(), Scheme::kBurtonMillerPolished);
  const ScatteringSystem before(mesh, wave(), Scheme::kBurtonMillerPolished);
  const TransducerArray sources = array();
  const Eigen::MatrixXcd q = drives(sources.size(), 9);
  BodyOnCard card = body(before);
  card.spanned(sources, shared(q), {});
  card.move(moved);
  card.spanned(sources, shared(q), {});
  EXPECT_LT(largest_difference(card.spanned_pressure(), reference.pressure(sources, q)), 1e-4);
}

// The matrix of one frame, inverted, is near the inverse of the next ones.
TEST_F(BodyOnCardTest, FramesTakeFewSteps) {
  const TriangleMesh mesh = gap();
  const TransducerArray sources = array();
  const Eigen::MatrixXcd q = drives(sources.size(), mesh.face_count() / 40);
  const ScatteringSystem before(mesh, wave(), Scheme::kBurtonMillerPolished);
  BodyOnCard card = body(before);
  card.spanned(sources, shared(q), {});
  EXPECT_EQ(card.kind(), SolverKind::kLu);
  TriangleMesh moved = mesh;
  int steps = 0;
  for (int frame = 1; frame <= 4; ++frame) {
    Eigen::Matrix3Xd vertices = mesh.vertices();
    vertices.row(0) *= 1.0 + 0.02 * frame;
    moved = TriangleMesh(vertices, mesh.triangles());
    card.move(moved);
    const SolveReport report = card.spanned(sources, shared(q), {}).report;
    EXPECT_TRUE(report.converged);
    EXPECT_EQ(card.kind(), SolverKind::kGmres);
    steps = report.steps;
  }
  const ScatteringSystem after(moved, wave(), Scheme::kBurtonMillerPolished);
  EXPECT_LT(2 * steps, body(after, kTolerance, SolverKind::kGmres).pressure(sources, q).report.steps);
  const Reference reference(moved, wave(), Scheme::kBurtonMillerPolished);
  EXPECT_LT(largest_difference(card.spanned_pressure(), reference.pressure(sources, q)), 1e-4);
}

// Weak drives of a basis, which come first, are multiplied in TF32: what that leaves is as small, of all, as the
// tolerance.
TEST_F(BodyOnCardTest, FramesOfABasisAreWithinTheTolerance) {
  constexpr double kUsual = 1e-4;
  const TriangleMesh mesh = small_hand();
  Eigen::Matrix3Xd vertices = mesh.vertices();
  vertices.row(0) *= 1.01;
  const TriangleMesh moved(vertices, mesh.triangles());
  const ScatteringSystem before(mesh, wave(), Scheme::kBurtonMillerPolished);
  const Reference reference(moved, wave(), Scheme::kBurtonMillerPolished);
  const TransducerArray sources = array(12, 4e-3);
  const Eigen::Index channels = sources.size();
  const auto all = Eigen::MatrixXcd::Identity(channels, channels);
  const Eigen::MatrixXcd b = before.right_hand_side(before.incident(sources, all));
  const Eigen::MatrixXcd basis = Eigen::SelfAdjointEigenSolver<Eigen::MatrixXcd>(b.adjoint() * b).eigenvectors();
  const Eigen::VectorXd strengths = (b * basis).colwise().norm();
  ASSERT_LT(strengths(channels / 4), 0.1 * strengths.maxCoeff());
  BodyOnCard card = body(before, kUsual);
  card.spanned(sources, shared(basis), {});
  card.move(moved);
  const SolveReport report = card.spanned(sources, shared(basis), {}).report;
  EXPECT_TRUE(report.converged);
  EXPECT_EQ(card.kind(), SolverKind::kGmres);
  const Eigen::MatrixXcd expected = reference.pressure(sources, basis);
  EXPECT_LT((card.spanned_pressure() - expected).norm(), 2.0 * kUsual * expected.norm());
}

TEST_F(BodyOnCardTest, ThePapersProblemIsTheProcessors) {
  const TriangleMesh mesh = icosphere(12e-3, 8);
  const TransducerArray sources = array();
  const std::vector<Eigen::Index> faces = {3, 500, 17, 600, 601};
  const Eigen::VectorXd amplitudes = Eigen::VectorXd::LinSpaced(5, 100.0, 300.0);
  for (const Scheme scheme : {Scheme::kPaper, Scheme::kPaperCorrected, Scheme::kBurtonMillerPolished}) {
    const ScatteringSystem system(mesh, wave(0.3), scheme);
    const IncidentField field = system.incident(sources);
    const Eigen::MatrixXcd b = system.right_hand_side(field);
    BodyOnCard card = body(system, 3e-5);
    for (const FaceWeights kind : {FaceWeights::kEqual, FaceWeights::kArea}) {
      const Eigen::VectorXd weights = row_weights(kind, mesh.areas(), mesh.face_count());
      for (const bool scattered : {true, false}) {
        SCOPED_TRACE(testing::Message() << to_string(scheme) << ", " << scattered);
        const IncidentProblem expected =
            scattered ? scattered_problem(system.columns(faces), b, weighted_gram(b, weights), amplitudes, weights)
                      : unscattered_problem(faces, field.pressure, weighted_gram(field.pressure, weights), amplitudes,
                                            weights);
        const IncidentProblem found = card.incident_problem(sources, faces, amplitudes, weights, {}, scattered);
        ASSERT_EQ(found.size(), expected.size());
        const Eigen::VectorXd start = Eigen::VectorXd::LinSpaced(found.size(), 0.0, 40.0);
        EXPECT_NEAR(incident_cost(found, start) / incident_cost(expected, start), 1.0, 1e-5);
        const Eigen::VectorXd gradient = incident_half_gradient(expected, start);
        EXPECT_LT((incident_half_gradient(found, start) - gradient).norm(), 1e-4 * gradient.norm());
        LevenbergMarquardtOptions options;
        options.iterations = 30;
        const double cost = solve_incident(expected, start, options).cost_history.back();
        EXPECT_NEAR(solve_incident(found, start, options).cost_history.back() / cost, 1.0, 5e-3);
      }
    }
  }
}

TEST_F(BodyOnCardTest, LittleMemoryGivesTheSame) {
  const ScatteringSystem system(icosphere(12e-3, 12), wave(), Scheme::kBurtonMillerPolished);
  const TransducerArray sources = array();
  const Eigen::MatrixXcd q = drives(sources.size(), 64);
  SolverOptions options;
  options.tolerance = kTolerance;
  BodyOnCard free(shared_gpu(0), system, options, true);
  const Eigen::MatrixXcd expected = free.pressure(sources, q).x;
  EXPECT_EQ(free.kind(), SolverKind::kLu);
  GpuLimits limits;
  limits.memory = std::size_t{60} << 20U;  // the matrix takes 66 MB
  BodyOnCard capped(open_gpu(0, limits), system, options, true);
  EXPECT_LT(largest_difference(capped.pressure(sources, q).x, expected), 1e-4);
  EXPECT_EQ(capped.kind(), SolverKind::kMatrixFree);
  limits.memory = std::size_t{1} << 20U;
  EXPECT_THROW(BodyOnCard(open_gpu(0, limits), system, options, true).pressure(sources, q), GpuMemoryFailure);
}

// Wherever the card fails: an error, and no result.
TEST_F(BodyOnCardTest, FailsWholeOrNotAtAll) {
  const ScatteringSystem system(icosphere(12e-3, 4), wave(), Scheme::kBurtonMillerPolished);
  const TransducerArray sources = array(4);
  const Eigen::MatrixXcd q = drives(sources.size(), 5);
  SolverOptions options;
  GpuLimits limits;
  for (limits.fail_after = 0; limits.fail_after < 200; limits.fail_after += 7) {
    try {
      BodyOnCard card(open_gpu(0, limits), system, options, true);
      EXPECT_TRUE(card.pressure(sources, q).x.allFinite());
    } catch (const DeviceError&) {
    }
  }
}

TEST_F(BodyOnCardTest, MemoryDoesNotGrow) {
  const ScatteringSystem system(icosphere(12e-3, 6), wave(), Scheme::kBurtonMillerPolished);
  const TransducerArray sources = array(4);
  const Eigen::MatrixXcd q = drives(sources.size(), 8);
  const Eigen::VectorXd weights = system.mesh().areas();
  const BodyOnCard::Wanted wanted{{1, 2}, &weights, 1e-4};
  BodyOnCard card = body(system);
  card.spanned(sources, shared(q), wanted);
  card.move(system.mesh());
  card.spanned(sources, shared(q), wanted);
  const std::size_t taken = card.gpu().taken();
  for (int frame = 0; frame < 1000; ++frame) {
    card.move(system.mesh());
    card.spanned(sources, shared(q), wanted);
  }
  EXPECT_EQ(card.gpu().taken(), taken);
}

TEST_F(BodyOnCardTest, SaysWhatIsNotFinite) {
  const ScatteringSystem system(icosphere(12e-3, 4), wave(), Scheme::kBurtonMiller);
  const TransducerArray sources = array(4);
  Eigen::MatrixXcd q = drives(sources.size(), 5);
  q(3, 2) = std::nan("");
  BodyOnCard card = body(system);
  EXPECT_THROW(card.pressure(sources, q), NumericalError);
}

}  // namespace
}  // namespace touchfield
