// How near a fitted hand comes to the true one, and what the fit takes, stage by stage, on one core.

#include <chrono>
#include <cstdio>
#include <memory>
#include <string>
#include <vector>

#include "sim/body/hand.h"
#include "sim/core/rotation.h"
#include "sim/core/units.h"
#include "sim/mesh/query/face_tree.h"
#include "sim/tracking/hand_learning.h"
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

/// A hand that moves at 50 mm/s while its index finger flexes by 30 degrees a second.
class TrueHand {
 public:
  TrueHand(const HandShape& shape, const HandProportions& by, double bump)
      : hand_(shape, 2e-3), shape_(hand_.shaped(by)) {
    const Body own = hand(options_of(shape, 3e-3));
    const Vector3 pad = position(own.mesh, find_landmark(own, "index_pad"));
    Points one = pad;
    Points moved_pad;
    hand_.carry(shape_, shape_.skeleton, hand_.carrier(one), moved_pad);
    pad_ = moved_pad.col(0);
    if (bump > 0) {
      Eigen::VectorXd offset(shape_.rest.cols());
      for (Eigen::Index v = 0; v < offset.size(); ++v) {
        offset(v) = bump * std::exp(-0.5 * (shape_.rest.col(v) - pad_ + Vector3(0, 0.06, 0)).squaredNorm() / 1e-4);
      }
      shape_ = hand_.shaped(by, offset);
    }
    carrier_ = std::make_unique<HandTemplate::Carrier>(hand_.carrier(one));
  }

  HandState state(double t) const {
    HandState s{{extrinsic_rotation(Vector3(5, -10, 15) * kDegree), {}}, joint_angles(hand_.pose())};
    const double w = 2 * std::numbers::pi * 0.6;
    const Vector3 way(0.05 / w * std::sin(w * t), 0.05 / w * std::cos(w * t), 0.2 + 0.01 * std::sin(w * t));
    s.place.shift = way - s.place.rotation * pad_;
    const double a = 30 * kDegree / w * std::sin(w * t);
    s.joints(6) += a + 30 * kDegree / w * 0.5;
    s.joints(7) += a + 30 * kDegree / w;
    return s;
  }
  TriangleMesh mesh(double t) const {
    const HandState s = state(t);
    Points v;
    hand_.carry(shape_, hand_.skeleton_at(shape_.proportions, s.joints), v);
    return {s.place(v), hand_.mesh().triangles()};
  }
  Vector3 pad(double t) const {
    const HandState s = state(t);
    Points v;
    hand_.carry(shape_, hand_.skeleton_at(shape_.proportions, s.joints), *carrier_, v);
    return s.place(Vector3(v.col(0)));
  }

 private:
  HandTemplate hand_;
  ShapedHand shape_;
  Vector3 pad_;
  std::unique_ptr<HandTemplate::Carrier> carrier_;
};

void run(const char* name, const HandShape& fit_shape, const TrueHand& truth, bool noise) {
  std::printf("== %s%s\n", name, noise ? ", noise" : "");
  double t = now();
  const HandTemplate hand_template(fit_shape, 4.5e-3);
  std::printf("template %ld vertices, %.2f s; held joints %ld\n", hand_template.mesh().vertex_count(), now() - t,
              21 - static_cast<long>(hand_template.free_joints().sum()));
  const TriangleMesh fine = hand(options_of(fit_shape, 2e-3)).mesh;
  const HandTemplate::Carrier carrier = hand_template.carrier(fine.vertices());
  const auto cameras = cameras_round({0, -0.04, 0.2}, 0.28, 0.2, 3);
  const PointReader reader(cameras);
  const Box box(Vector3(-0.3, -0.3, 0.05), Vector3(0.3, 0.3, 0.6));
  std::vector<HandPoints> points;
  std::vector<HandState> states;
  const auto points_at = [&](double seconds, unsigned seed) {
    DepthFrame frame = exact_frame(cameras, truth.mesh(seconds));
    if (noise) add_stereo_noise(frame, cameras, seed);
    return reader.read(frame, box);
  };
  ShapedHand shape = hand_template.shaped(HandProportions::Zero());
  PoseFit fit(hand_template);
  for (unsigned f = 0; f < 10; ++f) {
    points.push_back(points_at(0.1 * f, f));
    states.push_back(truth.state(0.1 * f));
    HandState& state = states.back();
    state.place.shift += Vector3(5e-3, -5e-3, 5e-3);
    state.joints = joint_angles(hand_template.pose());
    const PosePrior stiff{state.joints, JointAngles::Constant(5 * kDegree)};
    state = fit.fit(shape, points.back(), state, stiff, {8, 20e-3, 10e-3, 3e-3, 3, true}).state;
    const PosePrior loose{state.joints, JointAngles::Constant(15 * kDegree)};
    const PoseFitResult found = fit.fit(shape, points.back(), state, loose, {8, 20e-3, 10e-3, 3e-3, 3, false});
    std::printf("%.2f/%.2f ", 1e3 * found.residual, found.explained);
    state = found.state;
  }
  std::printf("\n");
  t = now();
  shape = learnt_shape(hand_template, shape, points, states);
  std::printf("learnt in %.2f s: ", now() - t);
  for (const double p : shape.proportions) std::printf("%.3f ", p);
  std::printf(" offset rms %.3f most %.2f mm\n", 1e3 * std::sqrt(shape.offset.squaredNorm() / static_cast<double>(shape.offset.size())), 1e3 * shape.offset.cwiseAbs().maxCoeff());
  for (const double seconds : {0.45, 1.25}) {
    const HandPoints seen = points_at(seconds, 77);
    const HandState& near = states[seconds < 1 ? 4 : 9];
    t = now();
    PoseFitResult result = fit.fit(shape, seen, near, {near.joints, JointAngles::Constant(20 * kDegree)}, {8, 20e-3, 6e-3, 2e-3, 3, false});
    const double took = now() - t;
    result = fit.fit(shape, seen, result.state, {result.state.joints, JointAngles::Constant(20 * kDegree)}, {3, 5e-3, 5e-3, 2e-3, 1, false});
    std::printf("at %.2f s: fit %.1f + %.1f ms, residual %.3f mm, explained %.3f\n", seconds, 1e3 * took, 1e3 * (now() - t - took), 1e3 * result.residual, result.explained);
    Points skin;
    hand_template.carry(shape, hand_template.skeleton_at(shape.proportions, result.state.joints), carrier, skin);
    judge(cameras, truth.mesh(seconds), truth.pad(seconds), TriangleMesh(result.state.place(skin), fine.triangles()));
  }
}

}  // namespace
}  // namespace touchfield

int main() {
  using namespace touchfield;
  for (const char* pose : {"index_up", "flat"}) {
    HandShape mean;
    mean.pose = pose;
    HandShape other = mean;
    other.joints.index.mcp = 12 * kDegree;
    other.joints.index.pip = 15 * kDegree;
    other.joints.index.dip = 8 * kDegree;
    other.length = 0.181;
    other.breadth = 0.082;
    HandProportions none = HandProportions::Zero();
    HandProportions beyond = none;
    beyond << 0.03, -0.04, 0.05, 0.06, -0.05, 0.06, 0.04, -0.06, 0.04, -0.05, 0.04, 0.03, -0.05;
    const TrueHand same(mean, none, 0);
    const TrueHand smaller(other, none, 0);
    const TrueHand odd(other, beyond, 2e-3);
    for (const bool noise : {false, true}) {
      run((std::string(pose) + " same").c_str(), mean, same, noise);
      run((std::string(pose) + " other size").c_str(), mean, smaller, noise);
      run((std::string(pose) + " beyond").c_str(), mean, odd, noise);
    }
  }
}
