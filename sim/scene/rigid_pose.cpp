#include "sim/scene/rigid_pose.h"

#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <fmt/format.h>

#include "sim/scene/scene_table.h"

namespace touchfield::schema {

namespace {

constexpr double kRotation = 1e-4;

struct Pose {
  std::optional<std::array<Vector3, 3>> rows;
  std::optional<std::array<double, 4>> quaternion;  // w, x, y, z
  Vector3 translation = Vector3::Zero();            // [m]
};

/// The rotation of what the file has; reports and returns nothing for what is none.
std::optional<Eigen::Matrix3d> rotation_of(const Input& in, const Pose& pose, const std::string& columns) {
  if (pose.quaternion) {
    const auto& [w, x, y, z] = *pose.quaternion;
    const Eigen::Quaterniond turn(w, x, y, z);
    if (std::abs(turn.norm() - 1) > kRotation) {
      in.key("quaternion_wxyz").problem(fmt::format("of length {:.6g}, must be 1 within {}", turn.norm(), kRotation));
      return std::nullopt;
    }
    return turn.normalized().toRotationMatrix();
  }
  Eigen::Matrix3d matrix;
  matrix << (*pose.rows)[0].transpose(), (*pose.rows)[1].transpose(), (*pose.rows)[2].transpose();
  const Input at = in.key("rotation");
  const double off = (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off > kRotation) {
    at.problem(fmt::format("R^T R differs from 1 by {:.2g}, must by at most {}: the columns are {} in the world", off,
                           kRotation, columns));
    return std::nullopt;
  }
  if (matrix.determinant() < 0) {
    at.problem(fmt::format("a reflection, must be a rotation: the columns are {} in the world", columns));
    return std::nullopt;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

}  // namespace

Codec<RigidMotion> rigid_pose_codec(const std::string& columns) {
  const Range cosine = between(-1 - kRotation, 1 + kRotation);
  Map<Pose> map;
  map.maybe("rotation", &Pose::rows, tuple_of<Vector3, 3>(vector3(kPlain, cosine)), "[[1, 0, 0], [0, 1, 0], [0, 0, 1]]",
            fmt::format("Rows of a rotation matrix. Its columns are {} in the world.", columns))
      .maybe("quaternion_wxyz", &Pose::quaternion, tuple_of<double, 4>(number(kPlain, cosine)), "[1, 0, 0, 0]",
             "The same rotation as a unit quaternion.")
      .exactly_one({"rotation", "quaternion_wxyz"})
      .required("translation_mm", &Pose::translation, vector3(kMillimetres, between(-100'000, 100'000)), "[0, 0, 0]",
                "Position of its origin in the world [mm].");
  return kept_as<RigidMotion, Pose>(
      map.codec(),
      [columns](const Input& in, const Pose& pose) -> std::optional<RigidMotion> {
        if (const auto rotation = rotation_of(in, pose, columns)) {
          return RigidMotion{*rotation, pose.translation};
        }
        return std::nullopt;
      },
      [](const RigidMotion& motion) {
        Pose pose;
        pose.rows.emplace();
        for (int row = 0; row < 3; ++row) {
          (*pose.rows)[static_cast<std::size_t>(row)] = motion.rotation.row(row);
        }
        pose.translation = motion.shift;
        return pose;
      });
}

}  // namespace touchfield::schema
