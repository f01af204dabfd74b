#include <chrono>
#include <cstdio>
#include <gtest/gtest.h>
#include "sim/body/hand.h"
#include "sim/body/shapes.h"
#include "sim/tracking/hand_points.h"
#include "tests/support/mesh_support.h"
#include "tests/support/sight_support.h"
namespace touchfield {
namespace {
TEST(Probe, Points) {
  const Vector3 middle(0, 0, 0.25);
  const TriangleMesh skin = shifted(hand({.edge = 2e-3}).mesh, middle - Vector3(0, 0.09, 0));
  const std::vector<DepthCamera> cameras = cameras_round(middle, 0.25, 0.25, 3);
  DepthFrame frame = exact_frame(cameras, skin);
  add_stereo_noise(frame, cameras, 1);
  const PointReader reader(cameras);
  const Box box(middle - Vector3::Constant(0.2), middle + Vector3::Constant(0.2));
  for (int i = 0; i < 3; ++i) {
    const auto t0 = std::chrono::steady_clock::now();
    Eigen::Index n = 0;
    for (int k = 0; k < 20; ++k) n = reader.read(frame, box).size();
    std::printf("%d points %.3f ms\n", int(n), std::chrono::duration<double>(std::chrono::steady_clock::now() - t0).count() / 20 * 1e3);
  }
  const TriangleMesh ball = shifted(icosphere(8e-3, 60), middle);
  const HandPoints p = reader.read(exact_frame(cameras, ball), box);
  Eigen::ArrayXd off = (p.at.colwise() - middle).colwise().norm().array() - 8e-3;
  std::printf("sphere rms %.4f mm mean %.4f n %d\n", 1e3*std::sqrt(off.square().mean()), 1e3*off.mean(), int(p.size()));
  const Eigen::ArrayXd cosines = ((p.at.colwise() - middle).colwise().normalized().array() * p.normal.array()).colwise().sum();
  std::printf("normals %.2f deg rms, worst %.1f\n", std::sqrt(cosines.min(1).acos().square().mean())/kDegree, std::acos(cosines.minCoeff())/kDegree);
  const std::vector<DepthCamera> one{depth_camera(Vector3::Zero(), middle, Vector3::UnitY())};
  DepthFrame f = exact_frame(one, shifted(touchfield::box({0.5, 0.3, 0.1}, 0.1).mesh, Vector3(0,0,0.4)));
  add_stereo_noise(f, one, 1);
  const HandPoints q = PointReader(one).read(f, Box(Vector3(-.1,-.1,.25), Vector3(.1,.1,.45)));
  std::printf("plane noise %.3f sigma %.3f normals %.2f deg\n", 1e3*std::sqrt((q.at.row(2).array()-0.35).square().mean()), 1e3*q.sigma.mean(), std::sqrt((-q.normal.row(2)).transpose().array().min(1).acos().square().mean())/kDegree);
}
}
}
