// How near a fitted hand comes to the true one, and what the fit takes, stage by stage, on one core.

#include <chrono>
#include <cstdio>
#include <vector>

#include "sim/body/hand.h"
#include "sim/core/rotation.h"
#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/tracking/pose_fit.h"
#include "tests/support/sight_support.h"

namespace touchfield {
namespace {

double now() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Error {
  double rms, p95, most, mean;
};

Error error_of(const std::vector<std::pair<double, double>>& by_area) {
  auto sorted = by_area;
  double area = 0, square = 0, sum = 0;
  for (auto& [d, a] : sorted) {
    area += a;
    square += a * d * d;
    sum += a * d;
    d = std::abs(d);
  }
  std::sort(sorted.begin(), sorted.end());
  double passed = 0, p95 = 0;
  for (const auto& [d, a] : sorted) {
    passed += a;
    p95 = d;
    if (passed >= 0.95 * area) break;
  }
  return {std::sqrt(square / area), p95, sorted.back().first, sum / area};
}

void print(const char* what, const std::vector<std::pair<double, double>>& by_area) {
  const Error e = error_of(by_area);
  std::printf("  %-8s rms %.3f  95%% %.3f  most %.2f  mean %+.3f mm\n", what, 1e3 * e.rms, 1e3 * e.p95, 1e3 * e.most, 1e3 * e.mean);
}

void judge(const std::vector<DepthCamera>& cameras, const TriangleMesh& truth, const Vector3& pad, const TriangleMesh& fitted) {
  std::vector<bool> seen(static_cast<std::size_t>(truth.face_count()));
  for (const DepthCamera& c : cameras) {
    for (const int f : rasterise(c.view, truth.vertices(), truth.triangles()).face) {
      if (f >= 0) seen[static_cast<std::size_t>(f)] = true;
    }
  }
  const FaceTree tree(fitted);
  std::vector<std::pair<double, double>> all, visible, patch;
  for (Eigen::Index f = 0; f < truth.face_count(); ++f) {
    const Vector3 x = truth.centroids().col(f);
    const SkinPoint near = tree.nearest(x);
    const double d = (x - near.at).dot(fitted.normals().col(near.face)) > 0 ? near.distance : -near.distance;
    all.emplace_back(d, truth.areas()(f));
    if (seen[static_cast<std::size_t>(f)]) visible.emplace_back(d, truth.areas()(f));
    if ((x - pad).cwiseAbs().maxCoeff() < 4e-3) patch.emplace_back(d, truth.areas()(f));
  }
  print("seen", visible);
  print("patch", patch);
  print("all", all);
}

HandOptions options_of(const HandShape& h, double edge) { return {h.pose, h.breadth, h.length, h.side, edge, h.joints}; }

void run(const HandShape& fit_shape, const HandShape& true_shape, bool noise) {
  double t = now();
  const HandTemplate hand_template(fit_shape, 4.5e-3);
  std::printf("template %ld vertices, %.2f s; held joints %ld\n", hand_template.mesh().vertex_count(), now() - t,
              21 - static_cast<long>(hand_template.free_joints().sum()));
  const TriangleMesh fine = hand(options_of(fit_shape, 2e-3)).mesh;
  const HandTemplate::Carrier carrier = hand_template.carrier(fine.vertices());
  const Body truth_own = hand(options_of(true_shape, 2e-3));
  const Vector3 pad = position(truth_own.mesh, find_landmark(truth_own, "index_pad"));
  const Body truth = placed(truth_own, pad, {0, 0, 0.2}, Vector3(5, -10, 15) * kDegree);
  const auto cameras = cameras_round({0, -0.04, 0.2}, 0.28, 0.2, 3);
  DepthFrame frame = exact_frame(cameras, truth.mesh);
  if (noise) add_stereo_noise(frame, cameras, 1);
  const PointReader reader(cameras);
  const Box box(Vector3(-0.3, -0.3, 0.05), Vector3(0.3, 0.3, 0.6));
  t = now();
  const HandPoints points = reader.read(frame, box);
  std::printf("points %ld, %.1f ms\n", points.size(), 1e3 * (now() - t));
  const RigidMotion true_place{extrinsic_rotation(Vector3(5, -10, 15) * kDegree), Vector3::Zero()};
  HandState start{{extrinsic_rotation(Vector3(10, -5, 10) * kDegree), {}}, joint_angles(hand_template.pose())};
  start.place.shift = Vector3(0.005, -0.005, 0.205) - true_place.rotation * pad;
  PosePrior prior{start.joints, JointAngles::Constant(30 * kDegree)};
  PoseFit fit(hand_template);
  for (int stage = 0; stage < 2; ++stage) {
    HandProportions by = HandProportions::Zero();
    if (stage == 1) {
      by(kLengthRatio) = std::log(true_shape.length / fit_shape.length);
      by(kBreadthRatio) = std::log(true_shape.breadth / fit_shape.breadth);
    }
    const ShapedHand shape = hand_template.shaped(by);
    t = now();
    const PoseFitResult result = fit.fit(shape, points, start, prior, {15, 25e-3, 6e-3, 2e-3, 1, false});
    const double took = now() - t;
    std::printf("fit %.1f ms, residual %.3f mm, explained %.3f\n", 1e3 * took, 1e3 * result.residual, result.explained);
    t = now();
    fit.match(shape, points, result.state, 6e-3, 2e-3);
    std::printf("match %.2f ms, ", 1e3 * (now() - t));
    t = now();
    fit.differentiate(shape, result.state, Vector3::Zero());
    std::printf("derivatives %.2f ms\n", 1e3 * (now() - t));
    const HandPose posed = with_angles(hand_template.pose(), result.state.joints);
    std::printf("index %.1f %.1f %.1f %.1f deg\n", posed.fingers[0].abduction / kDegree, posed.fingers[0].mcp / kDegree,
                posed.fingers[0].pip / kDegree, posed.fingers[0].dip / kDegree);
    Points skin;
    hand_template.carry(shape, hand_template.skeleton_at(by, result.state.joints), carrier, skin);
    judge(cameras, truth.mesh, {0, 0, 0.2}, TriangleMesh(result.state.place(skin), fine.triangles()));
  }
}

}  // namespace
}  // namespace touchfield

int main() {
  using namespace touchfield;
  HandShape same;
  HandShape bent;
  bent.joints.index.mcp = 12 * kDegree;
  bent.joints.index.pip = 15 * kDegree;
  bent.joints.index.dip = 8 * kDegree;
  HandShape other = bent;
  other.length = 0.181;
  other.breadth = 0.082;
  for (const char* pose : {"index_up", "flat"}) {
    same.pose = bent.pose = other.pose = pose;
    std::printf("== %s same\n", pose);
    run(same, same, false);
    std::printf("== %s bent\n", pose);
    run(same, bent, false);
    std::printf("== %s other size\n", pose);
    run(same, other, false);
    std::printf("== %s other size, noise\n", pose);
    run(same, other, true);
  }
}
