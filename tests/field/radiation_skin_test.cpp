#include "sim/field/radiation_skin.h"

#include <algorithm>

#include "sim/field/metrics.h"
#include "sim/field/surface_gradient.h"
#include "tests/support/skin_support.h"
#include "tests/support/sphere_support.h"
#include "tests/support/testing.h"

namespace touchfield::radiation_skin_test {

using Eigen::Index;

constexpr Index kChannels = 7;

/// A ball of 2.4 wavelengths with a box on its lower side, of which border faces belong in part.
struct Ball {
  TriangleMesh mesh = icosphere(20e-3, 10);
  Target target = make_target(mesh, {{{1e-3, 0, -20e-3}, {8e-3, 6e-3, 4e-3}}}, TargetProfile::kPenetration, 3000.0);
  NearSkin near = near_skin(mesh, target, wave());
  Eigen::MatrixXcd h = [this] {
    Uniform uniform(11);
    return Eigen::MatrixXcd(1000.0 * random_matrix(mesh.face_count(), kChannels, uniform));
  }();

  double distance(Index face) const {
    double least = 1.0;
    for (const Index own : target.faces) {
      least = std::min(least, (mesh.centroids().col(face) - mesh.centroids().col(own)).norm());
    }
    return least;
  }
};

/// The integral of the cost, face by face.
double integral(const Ball& ball, const Eigen::VectorXd& faces, double outside_weight, const Eigen::VectorXcd& q) {
  const Eigen::VectorXcd p = ball.h * q;
  const Eigen::VectorXd radiation = radiation_pressure(SurfaceGradient(ball.mesh, wave().k()), wave(), p);
  const double press = radiation_per_square(wave().medium());
  const double largest = press * ball.target.amplitudes.cwiseAbs2().maxCoeff();
  double misfit = 0.0;
  double energy = 0.0;
  double area = 0.0;
  for (Index f = 0; f < ball.mesh.face_count(); ++f) {
    const auto found = std::ranges::find(ball.target.faces, f);
    const Index k = found - ball.target.faces.begin();
    const bool inside = found != ball.target.faces.end();
    const double share = inside ? ball.target.shares(k) : 0.0;
    const double wanted = inside ? press * std::pow(ball.target.amplitudes(k), 2) : 0.0;
    const double own = ball.mesh.areas()(f);
    area += share * own;
    if (ball.distance(f) <= wave().wavelength()) {
      misfit +=
          faces(f) * own * (share * std::pow(radiation(f) - wanted, 2) + (1.0 - share) * std::pow(radiation(f), 2));
    }
    energy += faces(f) * own * (1.0 - share) * press * std::norm(p(f));
  }
  return (misfit / largest + outside_weight * energy) / (largest * area);
}

TEST(RadiationSkin, CostIsTheIntegralOfEachFace) {
  const Ball ball;
  ASSERT_GT((ball.target.shares.array() < 1.0).count(), 5);
  Eigen::VectorXd cut = Eigen::VectorXd::Ones(ball.mesh.face_count());  // a lid on the near skin: no skin
  for (Index f = 0; f < cut.size(); ++f) {
    cut(f) = ball.distance(f) > 4e-3 && ball.mesh.centroids()(0, f) > 0 ? 0.0 : 1.0;
  }
  for (const Eigen::VectorXd& faces : {Eigen::VectorXd(), cut}) {
    OutsideSkin outside;
    outside.faces = faces;
    for (const double weight : {0.0, 0.1, 0.8}) {
      RadiationProblem problem{.rows = ball.h(ball.near.faces, Eigen::all)};
      const Eigen::VectorXd weights = outside.face_weights(ball.mesh.areas(), ball.target, 1.0);
      problem.outside = weights.cwiseSqrt().asDiagonal() * ball.h;
      Eigen::VectorXd counted = Eigen::VectorXd::Zero(problem.rows.rows() + problem.outside.rows());
      counted.tail(problem.outside.rows()).setOnes();
      problem.skin =
          radiation_skin(ball.near, ball.mesh, ball.target, ball.target.amplitudes, outside, wave(), weight, counted);
      EXPECT_NO_THROW(require_valid(problem, "test"));
      Uniform uniform(5);
      for (int i = 0; i < 3; ++i) {
        const Eigen::VectorXcd q = random_matrix(kChannels, 1, uniform);
        const double expected =
            integral(ball, faces.size() > 0 ? faces : Eigen::VectorXd::Ones(cut.size()).eval(), weight, q);
        EXPECT_NEAR(radiation_cost(problem, q), expected, 1e-5 * expected) << weight;
      }
    }
  }
}

}  // namespace touchfield::radiation_skin_test
