#include "sim/hand/perturb.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <limits>
#include <string>
#include <tuple>
#include <vector>

#include <Eigen/Geometry>

#include "sim/hand/hand.h"
#include "sim/hand/shapes.h"
#include "sim/mesh/query/inspect.h"
#include "sim/mesh/query/self_intersections.h"
#include "tests/support/mesh_support.h"
#include "tests/support/testing.h"
#include "tests/support/threads_support.h"

namespace touchfield::perturb_test {

using Index = Eigen::Index;

constexpr double kMm = 1e-3;
constexpr double kRounding = 1e-15;  // [m], of coordinates of some cm
// Statistics are to lie within this many of their standard deviations: by chance one in 150,000 does not.
constexpr double kDeviations = 4.5;

SensingNoise noise(double rms, double correlation, unsigned seed) {
  SensingNoise result;
  result.rms = rms;
  result.correlation = correlation;
  result.seed = seed;
  return result;
}

/// The sum of area times normal over the faces round each vertex, made a unit vector.
Points smooth_normals(const TriangleMesh& mesh) {
  Points normals = Points::Zero(3, mesh.vertex_count());
  for (Index f = 0; f < mesh.face_count(); ++f) {
    for (const int v : mesh.triangles().col(f)) {
      normals.col(v) += (mesh.corner(f, 1) - mesh.corner(f, 0)).cross(mesh.corner(f, 2) - mesh.corner(f, 0));
    }
  }
  return normals.colwise().normalized();
}

Eigen::VectorXd field(const TriangleMesh& mesh, const SensingNoise& noise) {
  return RandomField(noise.rms, noise.correlation, noise.seed).at(mesh.vertices());
}

/// Values at the points, a column a seed.
Eigen::MatrixXd ensemble(const Points& points, double rms, double correlation, int seeds) {
  Eigen::MatrixXd values(points.cols(), seeds);
#pragma omp parallel for schedule(static)
  for (int s = 0; s < seeds; ++s) {
    values.col(s) = RandomField(rms, correlation, static_cast<std::uint64_t>(s)).at(points);
  }
  return values;
}

// Over N seeds, values of variance 1 have a mean of deviation 1 / sqrt(N), a mean square of deviation sqrt(2 / N), a
// fourth moment of deviation sqrt(96 / N) and products of correlation rho of deviation sqrt((1 + rho^2) / N).
TEST(RandomField, HasTheMeanVarianceAndCovarianceAsked) {
  constexpr int kSeeds = 3000;
  const double rms = 0.7 * kMm;
  const double correlation = 4 * kMm;
  const Vector3 start(0.31, -0.22, 0.17);
  Points points(3, 8);
  points.col(0) = start;
  const std::vector<double> distances = {0, 0.3, 0.7, 1, 1.5, 2, 3, 50};
  for (int i = 1; i < points.cols(); ++i) {  // each in a direction of its own
    points.col(i) = start + distances[static_cast<std::size_t>(i)] * correlation *
                                Vector3(std::cos(i), std::sin(i), 0.7 * std::cos(2 * i)).normalized();
  }
  const Eigen::ArrayXXd values = ensemble(points, rms, correlation, kSeeds) / rms;
  for (Index i = 0; i < points.cols(); ++i) {
    EXPECT_NEAR(values.row(i).mean(), 0, kDeviations * std::sqrt(1.0 / kSeeds));
    EXPECT_NEAR(values.row(i).square().mean(), 1, kDeviations * std::sqrt(2.0 / kSeeds));
    EXPECT_NEAR(values.row(i).square().square().mean(), 3, kDeviations * std::sqrt(96.0 / kSeeds));
    const double d = distances[static_cast<std::size_t>(i)];
    const double rho = std::exp(-0.5 * d * d);
    EXPECT_NEAR((values.row(0) * values.row(i)).mean(), rho, kDeviations * std::sqrt((1 + rho * rho) / kSeeds)) << d;
  }
}

TEST(Perturbed, MovesAlongSmoothNormalsByTheField) {
  const TriangleMesh mesh = shifted(sphere(0.03, 3 * kMm).mesh, {0.01, 0.02, 0.2});
  const SensingNoise some = noise(0.3 * kMm, 6 * kMm, 5);
  const Perturbed moved = perturbed(mesh, some);
  const Eigen::VectorXd expected = field(mesh, some);
  EXPECT_GT(expected.cwiseAbs().maxCoeff(), 0.3 * kMm);
  const Points at = mesh.vertices() + smooth_normals(mesh) * expected.asDiagonal();
  EXPECT_LT((moved.mesh.vertices() - at).cwiseAbs().maxCoeff(), kRounding);
  EXPECT_EQ(moved.mesh.triangles(), mesh.triangles());
  EXPECT_EQ(moved.damped_area, 0);
  EXPECT_EQ(moved.rms, moved.drawn_rms);
  // A sphere's vertices have about the same area each: within 20 %, so this is the mean over the skin within 10 %.
  EXPECT_NEAR(moved.rms / std::sqrt(expected.squaredNorm() / static_cast<double>(expected.size())), 1.0, 0.1);
}

TEST(Perturbed, IsTheSameForASeedOnAnyNumberOfThreads) {
  // A hand and a seed that bring two parts of the skin together.
  const TriangleMesh mesh = hand({.side = HandSide::kLeft, .edge = 5 * kMm}).mesh;
  const Perturbed alone = with_threads(1, [&] { return perturbed(mesh, noise(1.5 * kMm, 5 * kMm, 2)); });
  const Perturbed together = with_threads(4, [&] { return perturbed(mesh, noise(1.5 * kMm, 5 * kMm, 2)); });
  EXPECT_GT(alone.damped_area, 0);
  EXPECT_TRUE(alone.mesh.vertices() == together.mesh.vertices());
  EXPECT_EQ(alone.rms, together.rms);
  const Perturbed other = perturbed(mesh, noise(1.5 * kMm, 5 * kMm, 3));
  EXPECT_GT((alone.mesh.vertices() - other.mesh.vertices()).cwiseAbs().maxCoeff(), 1 * kMm);
}

TEST(Perturbed, HandsStayClosedAndClearOfThemselves) {
  const TriangleMesh mesh = hand({.edge = 4 * kMm}).mesh;
  int damped = 0;
  for (unsigned seed = 1; seed <= 4; ++seed) {
    SCOPED_TRACE(seed);
    const Perturbed moved = perturbed(mesh, noise(1 * kMm, 5 * kMm, seed));
    EXPECT_THAT(self_intersections(moved.mesh), IsEmpty());
    EXPECT_THAT(inspect(moved.mesh).faults, IsEmpty());
    EXPECT_EQ(moved.mesh.triangles(), mesh.triangles());
    EXPECT_GT(moved.mesh.areas().minCoeff(), 0);
    EXPECT_GT(moved.mesh.normals().cwiseProduct(mesh.normals()).colwise().sum().minCoeff(), 0.1);
    // 450 cm2 hold 570 areas of pi L^2: the drawn rms is within 4.5 times 3 % of the one asked for.
    EXPECT_NEAR(moved.drawn_rms / kMm, 1.0, 0.14);
    EXPECT_GT(moved.rms, 0.95 * moved.drawn_rms);
    EXPECT_LT(moved.damped_area, 0.1);
    damped += moved.damped_area > 0 ? 1 : 0;
  }
  EXPECT_GT(damped, 0);  // some of them would have cut themselves
}

/// Two plates 20 mm wide, 4 mm thick, 0.6 mm apart, with thick ends far from the gap.
TriangleMesh two_plates() {
  const TriangleMesh plate = box({0.06, 0.02, 0.004}, 2 * kMm).mesh;
  const Eigen::Matrix3d tilt = Eigen::AngleAxisd(0.35, Vector3::UnitY()).toRotationMatrix();
  // Its end comes down to the other's top.
  const TriangleMesh tilted = transformed(plate, tilt, {0, 0, 0});
  const double low = tilted.vertices().row(2).minCoeff();
  return together(shifted(plate, {0, 0, -0.002 - 0.6 * kMm}), shifted(tilted, {0, 0, -low}));
}

// Where the noise would close the gap it is damped, gently; elsewhere it stays as drawn.
TEST(Perturbed, DampsTheNoiseInNarrowGapsOnly) {
  const TriangleMesh mesh = two_plates();
  const SensingNoise some = noise(0.6 * kMm, 3 * kMm, 4);
  const Eigen::VectorXd drawn = field(mesh, some);
  const TriangleMesh undamped(mesh.vertices() + smooth_normals(mesh) * drawn.asDiagonal(), mesh.triangles());
  const auto cuts = self_intersections(undamped);
  ASSERT_FALSE(cuts.empty());

  const Perturbed moved = perturbed(mesh, some);
  EXPECT_THAT(self_intersections(moved.mesh), IsEmpty());
  EXPECT_THAT(inspect(moved.mesh).faults, IsEmpty());
  EXPECT_GT(moved.damped_area, 0);
  EXPECT_LT(moved.damped_area, 0.3);
  EXPECT_LT(moved.rms, moved.drawn_rms);

  // Beyond four reaches (here two edges) from any face at fault nothing changes. The faults lie at the gap's narrow
  // end.
  const double reach = std::max(some.correlation, 2 * mesh.mean_edge());
  Index far = 0;
  const Vector3 end = mesh.centroids().col(cuts.front().first);
  for (Index v = 0; v < mesh.vertex_count(); ++v) {
    if (std::abs(mesh.vertices()(0, v) - end.x()) > 6 * reach) {
      ++far;
      EXPECT_LT((moved.mesh.vertices() - undamped.vertices()).col(v).norm(), kRounding);
    }
  }
  EXPECT_GT(far, 100);
}

// A plate of 1 mm cannot carry a noise of 3 mm: half of its sides would go through each other, and to take the noise
// away there leaves the other half: sqrt(1/2) of its rms.
TEST(Perturbed, SaysWhichNoiseWouldDo) {
  const TriangleMesh mesh = shifted(box({0.02, 0.02, 0.001}, 1 * kMm).mesh, {0.1, 0.2, 0.3});
  for (unsigned seed = 1; seed <= 2; ++seed) {
    SensingNoise some = noise(3 * kMm, 3 * kMm, seed);
    const std::string message = message_of<InputError>([&] { perturbed(mesh, some); });
    ASSERT_THAT(message, AllOf(HasSubstr("noise of 3 mm rms over 3 mm"), HasSubstr("worst place is near ("),
                               HasSubstr(" mm rms would do")));
    some.rms =
        std::strtod(message.substr(message.rfind(' ', message.find(" mm rms would do") - 1)).c_str(), nullptr) * kMm;
    ASSERT_GT(some.rms, 0.1 * kMm);
    const Perturbed moved = perturbed(mesh, some);
    EXPECT_THAT(self_intersections(moved.mesh), IsEmpty());
    EXPECT_GT(moved.mesh.signed_volume(), 0);
    EXPECT_GE(moved.rms, 0.8 * moved.drawn_rms);
  }
}

TEST(Perturbed, RefusesWhatIsNoNoise) {
  const TriangleMesh mesh = sphere(0.02, 5 * kMm).mesh;
  const double nan = std::numeric_limits<double>::quiet_NaN();
  for (const auto& [rms, correlation, offset, phrase] :
       {std::tuple{4 * kMm, 5 * kMm, 0.0, "noise rms = 4 mm must be 0 to 3 mm"},
        {nan, 5 * kMm, 0.0, "must be 0 to 3 mm"},
        {0.5 * kMm, 0.5 * kMm, 0.0, "correlation = 0.5 mm must be 1 to 100 mm"},
        {0.5 * kMm, 5 * kMm, nan, "must be finite"},
        {0.5 * kMm, 5 * kMm, 1 / 0.0, "must be finite"}}) {
    SensingNoise some = noise(rms, correlation, 1);
    some.offset.y() = offset;
    EXPECT_THAT(message_of<InputError>([&] { perturbed(mesh, some); }), HasSubstr(phrase));
  }
}

TEST(Perturbed, RefusesASkinThatCutsItself) {
  const TriangleMesh one = sphere(0.02, 5 * kMm).mesh;
  const TriangleMesh both = together(one, shifted(one, {0.03, 0.001, 0.002}));
  EXPECT_THAT(message_of<InputError>([&] { perturbed(both, noise(0.1 * kMm, 5 * kMm, 1)); }),
              HasSubstr("intersect near ("));
}

}  // namespace touchfield::perturb_test
