#include "sim/scene/sensor_table.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/units.h"
#include "sim/scene/scene_table.h"

namespace touchfield {

namespace {

constexpr double kDisparities = 126;  // [pixels]

std::vector<std::string> camera_names() {
  std::vector<std::string> names;
  for (const CameraModel& model : camera_models()) {
    names.push_back(model.name);
  }
  return names;
}

}  // namespace

const std::vector<CameraModel>& camera_models() {
  static const std::vector<CameraModel> models{{"d415", 65 * kDegree, 55e-3, kDisparities},
                                               {"d435", 87 * kDegree, 50e-3, kDisparities},
                                               {"d405", 87 * kDegree, 18e-3, kDisparities}};
  return models;
}

const CameraModel& camera_model(const std::string& name) {
  const auto model = std::ranges::find(camera_models(), name, &CameraModel::name);
  if (model == camera_models().end()) {
    throw InputError(fmt::format("camera {} is not known: {}", name, fmt::join(camera_names(), ", ")));
  }
  return *model;
}

}  // namespace touchfield

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

Codec<CameraSpec> camera_codec() {
  const auto pixels = integer(between(16, 4096));
  return Map<CameraSpec>()
      .key("model", &CameraSpec::model, word(camera_names()),
           "Type of the camera: its field of view, baseline and nearest depth.")
      .required("at_mm", &CameraSpec::at, vector3(kMillimetres, {}), "[150, 0, 0]",
                "Position of the camera in the world [mm].")
      .required("look_at_mm", &CameraSpec::look_at, vector3(kMillimetres, {}), "[0, 0, 300]",
                "A point in the centre of its image [mm].")
      .key("roll_deg", &CameraSpec::roll, number(kDegrees, {}),
           "Rotation about its viewing direction, clockwise seen from behind the camera [deg]. At 0 the rows of the "
           "image are level; for a camera that looks straight up or down they are along x.")
      .key("resolution", &CameraSpec::resolution, tuple_of<int, 2>(pixels),
           "Number of columns and rows of its depth images.")
      .key("disparity_noise_px", &CameraSpec::disparity_noise, number(kPlain, between(0, 2)),
           "Noise of the disparity from which the depth is computed, root mean square [pixels].")
      .key("depth_unit_mm", &CameraSpec::depth_unit, number(kMillimetres, between(0.01, 10)),
           "Depths are rounded to multiples of this [mm].")
      .key("place_error_mm", &CameraSpec::shift_error, number(kMillimetres, between(0, 100)),
           "Error of the position that the fit assumes, in a random direction [mm].")
      .key("turn_error_deg", &CameraSpec::turn_error, number(kDegrees, between(0, 30)),
           "Error of the rotation that the fit assumes, about a random axis [deg].")
      .check([](const Input& in, CameraSpec& camera, bool good) {
        if (good && (camera.look_at - camera.at).norm() < 1e-3) {
          return in.key("look_at_mm").must_be("1 mm or more from at_mm");
        }
        return good;
      })
      .codec();
}

bool check_pixels(const Input& in, const MotionSpec::Sensor& sensor) {
  const auto* cameras = std::get_if<std::vector<CameraSpec>>(&sensor.sight);
  std::int64_t pixels = 0;
  for (const CameraSpec& camera : cameras == nullptr ? std::vector<CameraSpec>() : *cameras) {
    pixels += std::int64_t{camera.resolution[0]} * camera.resolution[1];
  }
  if (pixels > kMostCameraPixels) {
    return in.key("cameras").problem(
        fmt::format("their images have {} pixels together, must be at most {}", pixels, kMostCameraPixels));
  }
  return true;
}

Codec<RecordedSpec> recorded_codec() {
  return Map<RecordedSpec>()
      .required("folder", &RecordedSpec::folder, absolute_file(), "recorded",
                "Folder of 16-bit depth images, cameras.yaml and times.csv, as `touchfield see` writes it. A relative "
                "name starts from the scene's folder.")
      .codec();
}

/// A port of 127.0.0.1, or an address and a port.
Codec<ListenAddress> listen_codec() {
  const auto port = kept_as<ListenAddress, int>(
      integer(between(1, 65535)), [](const Input&, int number) { return std::optional(ListenAddress{.port = number}); },
      [](const ListenAddress& address) { return address.port; });
  const auto whole = kept_as<ListenAddress, std::string>(
      text(1),
      [](const Input& in, const std::string& typed) {
        const auto address = listen_address(typed);
        if (!address) {
          in.must_be(
              "a port from 1 to 65535, or \"ADDRESS:PORT\" with an IP address of this machine: "
              "\"0.0.0.0:9000\", \"[::1]:9000\"");
        }
        return address;
      },
      [](const ListenAddress& address) { return address.text(); });
  return either<ListenAddress>(
      port, whole, [](const ListenAddress& address) { return address.host == ListenAddress().host; },
      [](const Node& node) { return node.kind == Node::Kind::kScalar && !node.quoted && parse_decimal(node.text); });
}

Codec<JointsSpec> tracked_joints_codec() {
  return Map<JointsSpec>()
      .maybe("file", &JointsSpec::from, absolute_file(), "hand.csv",
             "Table of the joints of a hand, one row per frame, with the names of OpenXR. A relative name starts from "
             "the scene's folder.")
      .maybe(
          "listen", &JointsSpec::from, listen_codec(), "9000",
          "UDP port to which the program of a tracker sends joints while `touchfield live` plays. A port alone hears "
          "programs of this machine by 127.0.0.1. \"ADDRESS:PORT\" listens on an address of this machine, for IPv6 "
          "as \"[::1]:9000\". \"0.0.0.0:9000\" hears the whole network: then anyone who reaches the port moves the "
          "sound.")
      .exactly_one({"file", "listen"})
      .key("pose", &JointsSpec::pose, rigid_pose_codec("the tracker's x, y and z"),
           "Pose of the tracker's own frame in the world.")
      .codec();
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

Codec<MotionSpec::Sensor> sensor_codec() {
  using Sensor = MotionSpec::Sensor;
  const std::vector<std::string> images{"cameras", "recorded"};
  const std::vector<std::string> fitted{"cameras", "recorded", "joints"};
  return Map<Sensor>()
      .key("hz", &Sensor::hz, number(kPlain, kRate), "Samples of the hand per second.")
      .key("latency_ms", &Sensor::latency, number(kMilliseconds, kDelay),
           "Delay from a sample until the solver knows it [ms].")
      .maybe("noise", &Sensor::sight, sensing_codec(), "",
             "The solver sees the skin displaced by noise, as with `sensing` for a still. Each sample has noise of its "
             "own.")
      .maybe("cameras", &Sensor::sight, list_of<CameraSpec>(camera_codec(), 1, 8), "",
             "The solver sees a hand fitted to images of simulated depth cameras.")
      .maybe("recorded", &Sensor::sight, recorded_codec(), "",
             "The solver sees a hand fitted to recorded depth images.")
      .maybe("joints", &Sensor::sight, tracked_joints_codec(), "",
             "The solver sees a hand fitted to the joints that a hand tracker has recorded.")
      .at_most_one({"noise", "cameras", "recorded", "joints"})
      .key("seed", &Sensor::seed, seed(), "Seed of the errors of the cameras.")
      .allowed_with({"cameras"})
      .maybe("hand", &Sensor::hand, hand_codec(), "",
             "The built-in hand that is fitted, before its shape is learnt. Default: the hand of the scene; for depth "
             "images with the mean length and breadth.")
      .allowed_with(fitted)
      .key("workspace_mm", &Sensor::workspace, tuple_of<Vector3, 2>(vector3(kMillimetres, {})),
           "Two corners of the box in which the hand is searched: the least x, y, z and the largest [mm].")
      .allowed_with(images)
      .check([](const Input& in, Sensor& sensor, bool good) {
        if (good && !((sensor.workspace[1] - sensor.workspace[0]).minCoeff() > 0)) {
          return in.key("workspace_mm").at(1).must_be("beyond the first corner in x, y and z");
        }
        return good && check_pixels(in, sensor);
      })
      .codec();
}

}  // namespace touchfield::schema
