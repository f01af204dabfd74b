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
#include "sim/tracking/hand_tracker.h"
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

struct Judged {
  Error seen, patch, all;
};

Judged judge(const std::vector<DepthCamera>& cameras, const TriangleMesh& truth, const Vector3& pad, const TriangleMesh& fitted) {
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
  return {error_of(visible), error_of(patch), error_of(all)};
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

double p95(std::vector<double> values) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(0.95 * static_cast<double>(values.size() - 1))];
}

void run(const std::string& name, const HandTemplate& hand_template, const TrueHand& truth, bool noise, int camera_count, double spacing) {
  const HandShape& fit_shape = hand_template.hand();
  static const TriangleMesh fine = hand(options_of(fit_shape, 2e-3)).mesh;
  const HandTemplate::Carrier carrier = hand_template.carrier(fine.vertices());
  auto cameras = cameras_round({0, -0.04, 0.2}, 0.28, 0.2, 3);
  cameras.resize(static_cast<std::size_t>(camera_count));
  const Box box(Vector3(-0.3, -0.3, 0.05), Vector3(0.3, 0.3, 0.6));
  FitOptions options;
  options.node_spacing = spacing;
  HandTracker tracker(hand_template, cameras, box, options);
  const auto frame_at = [&](int f) {
    DepthFrame frame = exact_frame(cameras, truth.mesh(f / 30.0));
    frame.seconds = f / 30.0;
    if (noise) add_stereo_noise(frame, cameras, static_cast<unsigned>(f));
    return frame;
  };
  std::vector<DepthFrame> frames;
  for (int f = 0; f < 30; f += 2) frames.push_back(frame_at(f));
  double t = now();
  const bool learnt = tracker.learn(frames);
  std::printf("%s: learnt %d in %.2f s\n", name.c_str(), learnt, now() - t);
  std::vector<double> total, points, pose, check, deformation;
  Judged worst{};
  double square = 0, patch_square = 0, p95_most = 0, explained = 1, share = 1;
  int lost = 0, count = 0;
  for (int f = 30; f < 60; ++f) {
    const DepthFrame frame = frame_at(f);
    t = now();
    const HandFit fit = tracker.track(frame);
    total.push_back(now() - t);
    points.push_back(tracker.times().points);
    pose.push_back(tracker.times().pose);
    check.push_back(tracker.times().check);
    deformation.push_back(tracker.times().deformation);
    lost += fit.lost ? 1 : 0;
    if (fit.lost) {
      std::printf("lost %d: share %.2f explained %.2f residual %.2f\n", f, fit.share, fit.explained, 1e3 * fit.residual);
      continue;
    }
    explained = std::min(explained, fit.explained);
    share = std::min(share, fit.share);
    if (f % 5 == 0) {
      Points skin;
      tracker.skin(fit, carrier, skin);
      const Judged judged = judge(cameras, truth.mesh(f / 30.0), truth.pad(f / 30.0), TriangleMesh(skin, fine.triangles()));
      square += judged.seen.rms * judged.seen.rms;
      patch_square += judged.patch.rms * judged.patch.rms;
      p95_most = std::max(p95_most, judged.seen.p95);
      worst = judged;
      ++count;
    }
  }
  std::printf("  seen rms %.3f 95%% at most %.3f patch rms %.3f all %.3f mm, lost %d, explained >= %.2f, share >= %.2f\n", 1e3 * std::sqrt(square / count), 1e3 * p95_most,
              1e3 * std::sqrt(patch_square / count), 1e3 * worst.all.rms, lost, explained, share);
  std::printf("  95%% of frames within %.1f ms: points %.1f pose %.1f check %.1f deformation %.1f\n", 1e3 * p95(total), 1e3 * p95(points), 1e3 * p95(pose), 1e3 * p95(check), 1e3 * p95(deformation));
}

}  // namespace
}  // namespace touchfield

int main() {
  using namespace touchfield;
  for (const char* pose : {"index_up"}) {
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
    const HandTemplate hand_template(mean, 4.5e-3);
    const TrueHand smaller(other, none, 0);
    const TrueHand odd(other, beyond, 2e-3);
    for (const double spacing : {0.0, 12e-3}) {
      for (const bool noise : {false, true}) {
        const std::string with = std::string(spacing > 0 ? " graph" : " skeleton") + (noise ? " noise" : " exact");
        run(pose + with + " other size", hand_template, smaller, noise, 3, spacing);
        run(pose + with + " beyond", hand_template, odd, noise, 3, spacing);
      }
      run(std::string(pose) + " one camera, other size", hand_template, smaller, true, 1, spacing);
    }
  }
}
