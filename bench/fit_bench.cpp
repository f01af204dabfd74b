// How near the fitted hand comes to the true one as simulated depth cameras see it, and what a frame of the fit takes.
// usage: fit_bench [FRAMES]   Times are of one core: wall clock, and the thread's own time, which other programs leave
// alone.

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <string>
#include <vector>

#include "sim/cameras/hand_tracker.h"
#include "tests/support/moving_hand_support.h"
#include "tests/support/skin_error.h"

namespace touchfield {
namespace {

double wall() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

double own() {
  timespec time{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

/// [ms]
double percentile_95(std::vector<double> seconds) {
  std::sort(seconds.begin(), seconds.end());
  return 1e3 * seconds[static_cast<std::size_t>(0.95 * static_cast<double>(seconds.size() - 1))];
}

struct Times {
  std::vector<double> wall, own, points, pose, check, deformation;
};

struct Case {
  std::string name;
  const MovingHand* truth;
  StereoEffects effects;
  std::size_t cameras;
  double node_spacing;
};

void run(const Case& what, const HandTemplate& hand_template, const TriangleMesh& fine, int frames) {
  std::vector<CameraSpec> specs = cameras_beside_array();
  specs.resize(what.cameras);
  const SimulatedCameras cameras(specs, 1);
  const auto frame_at = [&](int f) {
    return cameras.sees(what.truth->mesh(f / 30.0), f / 30.0, static_cast<std::uint64_t>(f), what.effects);
  };
  FitOptions options;
  options.node_spacing = what.node_spacing;
  HandTracker tracker(hand_template, cameras.told(), workspace_above_array(), options);
  const HandTemplate::Carrier carrier = hand_template.carrier(fine.vertices());

  std::vector<DepthFrame> first_second;
  for (int f = 0; f < 30; f += 2) {
    first_second.push_back(frame_at(f));
  }
  const double before = wall();
  const bool learnt = tracker.learn(first_second);
  const double took = wall() - before;

  Times times;
  int lost = 0;
  double least_share = 1;
  double least_explained = 1;
  SkinError worst;
  for (int f = 30; f < 30 + frames; ++f) {
    const DepthFrame frame = frame_at(f);
    const double wall_before = wall();
    const double own_before = own();
    const HandFit fit = tracker.track(frame);
    times.own.push_back(own() - own_before);
    times.wall.push_back(wall() - wall_before);
    times.points.push_back(tracker.times().points);
    times.pose.push_back(tracker.times().pose);
    times.check.push_back(tracker.times().check);
    times.deformation.push_back(tracker.times().deformation);
    least_share = std::min(least_share, fit.share);
    least_explained = std::min(least_explained, fit.explained);
    lost += fit.lost ? 1 : 0;
    if (fit.lost || f % 10 != 0) {
      continue;
    }
    Points skin;
    tracker.skin(fit, carrier, skin);
    const TriangleMesh truth = what.truth->mesh(f / 30.0);
    const SkinError error = skin_error(truth, {skin, fine.triangles()}, faces_seen(cameras.told(), truth),
                                       {what.truth->index_pad(f / 30.0), 4e-3});
    worst.seen.rms = std::max(worst.seen.rms, error.seen.rms);
    worst.seen.p95 = std::max(worst.seen.p95, error.seen.p95);
    worst.patch.rms = std::max(worst.patch.rms, error.patch.rms);
    worst.all.rms = std::max(worst.all.rms, error.all.rms);
  }
  std::printf(
      "%-44s learnt %d in %.1f s; seen %.3f mm, 95 %% %.3f, patch %.3f, all %.3f; lost %d, share %.2f, explained "
      "%.2f\n",
      what.name.c_str(), learnt ? 1 : 0, took, 1e3 * worst.seen.rms, 1e3 * worst.seen.p95, 1e3 * worst.patch.rms,
      1e3 * worst.all.rms, lost, least_share, least_explained);
  std::printf("%-44s 95 %% of frames within %.1f ms (own %.1f): points %.1f, pose %.1f, check %.1f, deformation %.1f\n",
              "", percentile_95(times.wall), percentile_95(times.own), percentile_95(times.points),
              percentile_95(times.pose), percentile_95(times.check), percentile_95(times.deformation));
  std::fflush(stdout);
}

void run_all(int frames) {
  HandShape mean;
  HandShape other;
  other.joints.index.mcp = 12 * kDegree;
  other.joints.index.pip = 15 * kDegree;
  other.joints.index.dip = 8 * kDegree;
  other.length = 0.181;
  other.breadth = 0.082;
  HandProportions beyond;
  beyond << 0.03, -0.04, 0.05, 0.06, -0.05, 0.06, 0.04, -0.06, 0.04, -0.05, 0.04, 0.03, -0.05;
  const HandTemplate hand_template(mean, HandTemplate::kUsualEdge);
  const TriangleMesh fine = hand(hand_options(mean, 2.5e-3)).mesh;
  const MovingHand smaller(other, 2.5e-3);
  const MovingHand odd(other, 2.5e-3, beyond, 2e-3);
  const StereoEffects all;
  const StereoEffects none{false, false, false, false, false, false, false};
  for (const double spacing : {12e-3, 0.0}) {
    const std::string with = spacing > 0 ? "" : ", skeleton alone";
    run({"another size, exact" + with, &smaller, none, 3, spacing}, hand_template, fine, frames);
    run({"another size" + with, &smaller, all, 3, spacing}, hand_template, fine, frames);
    run({"beyond the template" + with, &odd, all, 3, spacing}, hand_template, fine, frames);
    run({"another size, one camera" + with, &smaller, all, 1, spacing}, hand_template, fine, frames);
  }
}

}  // namespace
}  // namespace touchfield

int main(int argc, char** argv) { touchfield::run_all(argc > 1 ? std::max(std::atoi(argv[1]), 1) : 30); }
