// Reciprocity, energy and momentum on a whole hand at 20 kHz: 4.3 edges a wavelength.
#include <cmath>
#include <memory>

#include <gtest/gtest.h>

#include "sim/acoustics/incident_field.h"
#include "sim/field/evaluate.h"
#include "sim/hand/hand.h"
#include "tests/support/momentum_support.h"
#include "tests/support/sphere_support.h"

namespace touchfield::hand_physics_test {

class HandPhysics : public ::testing::Test {
 protected:
  HandPhysics()
      : wave_(air(293.15), 20e3),
        mesh_(hand({.pose = "index_up", .edge = 4e-3}).mesh),
        middle_(mesh_.vertices().rowwise().mean()),
        reach_((mesh_.vertices().colwise() - middle_).colwise().norm().maxCoeff()),
        system_(mesh_, wave_, Scheme::kBurtonMillerPolished),
        solver_(make_solver(system_, {.kind = SolverKind::kMatrixFree, .tolerance = 1e-5})) {}

  Eigen::VectorXcd solve(const TransducerArray& array) const {
    const IncidentField field = system_.incident(array);
    return system_.pressure(solver_->solve(system_.right_hand_side(field)).x, field);
  }

  Eigen::VectorXcd field(const TransducerArray& array, const Points& x, const Eigen::VectorXcd& p) const {
    return boundary_integral(mesh_, array, wave_, x, p, Eigen::MatrixXcd::Ones(1, 1)).pressure;
  }

  Wave wave_;
  TriangleMesh mesh_;
  Vector3 middle_;
  double reach_;
  ScatteringSystem system_;
  std::unique_ptr<ScatteringSolver> solver_;
};

TEST_F(HandPhysics, OmniSourceAndReceiverExchange) {
  const Points a = middle_ + 0.8 * reach_ * Vector3(0.1, 0.2, -1.0);
  const Points b = middle_ + 0.9 * reach_ * Vector3(0.2, -0.1, 1.0);
  const auto received = [&](const Points& from, const Points& at) {
    const TransducerArray array = omni_at(from);
    return field(array, at, solve(array))(0);
  };
  const Complex ab = received(a, b);
  const Complex ba = received(b, a);
  const Complex direct = incident_matrix(omni_at(a), wave_, b)(0, 0);
  ASSERT_GT(std::abs(ab - direct), 0.1 * std::abs(direct));
  // The hand shades the one from the other: what arrives is a tenth of the incident pressure.
  std::printf("%d faces: reciprocal to %.2e of the incident pressure\n", static_cast<int>(mesh_.face_count()),
              std::abs(ab - ba) / std::abs(direct));
  EXPECT_LT(std::abs(ab - ba), 0.02 * std::abs(direct));
}

TEST_F(HandPhysics, NetPowerThroughASphereAroundItIsSmall) {
  const TransducerArray array = omni_at(middle_ + Vector3(0, 0, -(reach_ + 0.1)));
  const Eigen::VectorXcd p = solve(array);
  const TriangleMesh ball = icosphere(reach_ + 0.01, 24);
  const TriangleMesh shell = transformed(ball, Eigen::Matrix3d::Identity(), middle_);
  constexpr double kStep = 2e-5;
  const auto at = [&](double offset) -> Eigen::VectorXcd {
    return field(array, shell.centroids() + offset * shell.normals(), p);
  };
  const Eigen::VectorXcd slope = (at(kStep) - at(-kStep)) / (2 * kStep);
  const Eigen::VectorXcd velocity = slope / Complex(0, wave_.omega() * wave_.medium().density);
  const Eigen::VectorXd intensity = 0.5 * (at(0.0).array() * velocity.conjugate().array()).real();
  const double net = shell.areas().dot(intensity);
  const double through = shell.areas().dot(intensity.cwiseAbs());
  std::printf("%d faces: net power %.2e of what goes through\n", static_cast<int>(mesh_.face_count()), net / through);
  EXPECT_LT(std::abs(net), 0.001 * through);
}

TEST_F(HandPhysics, MomentumThroughASphereAroundItIsTheForceOnItsFaces) {
  const TransducerArray array = omni_at(middle_ + Vector3(0.02, 0.03, -(reach_ + 0.1)));
  const Eigen::VectorXcd p = solve(array);
  const Vector3 on_faces = force_on_faces(mesh_, wave_, p);
  const TriangleMesh shell = transformed(icosphere(reach_ + 0.01, 24), Eigen::Matrix3d::Identity(), middle_);
  const Vector3 inflow = momentum_inflow(shell, wave_, [&](const Points& x) { return field(array, x, p); });
  std::printf("%d faces: force on them %.3g N, %.2f %% from the momentum\n", static_cast<int>(mesh_.face_count()),
              on_faces.norm(), 100.0 * (on_faces - inflow).norm() / inflow.norm());
  EXPECT_LT((on_faces - inflow).norm(), 0.03 * inflow.norm());
}

}  // namespace touchfield::hand_physics_test
