#include "sim/motion/seen_error.h"

#include "sim/mesh/query/surface_fit.h"

namespace touchfield {

namespace {

constexpr double kSkinRound = 25e-3;  // [m]
constexpr double kPatchRound = 5e-3;  // [m]

}  // namespace

SkinOff seen_error(const Model& truth, const Model& seen) {
  const TriangleMesh& mesh = truth.body.mesh;
  Eigen::VectorXd away = Eigen::VectorXd::Constant(mesh.face_count(), std::numeric_limits<double>::infinity());
  for (const TargetBox& box : truth.boxes) {
    away = away.cwiseMin((mesh.centroids().colwise() - box.centre).colwise().norm().transpose());
  }
  const Eigen::VectorXd distances = signed_distances(mesh, seen.body.mesh);
  const auto rms_within = [&](double reach) {
    std::vector<bool> keep(static_cast<std::size_t>(away.size()));
    for (std::size_t f = 0; f < keep.size(); ++f) {
      keep[f] = away(static_cast<Eigen::Index>(f)) <= reach;
    }
    const SkinDistance distance = skin_distance(mesh, distances, keep);
    return distance.area > 0 ? distance.rms : kNotComputed;
  };
  return {rms_within(kSkinRound), rms_within(kPatchRound)};
}

double target_off(const MovingModel& truth, const MotionFrame& frame) {
  if (!frame.target.allFinite()) {
    return kNotComputed;
  }
  return (truth.patch(truth.at(truth.state(frame.pose_time))) - frame.target).norm();
}

}  // namespace touchfield
