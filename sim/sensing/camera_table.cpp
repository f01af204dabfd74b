#include "sim/sensing/camera_table.h"

#include <cmath>
#include <optional>

#include <Eigen/Geometry>
#include <Eigen/SVD>
#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/scene/camera_models.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/schema.h"

namespace touchfield {

namespace schema {

namespace {

constexpr double kPixelMiddle = 0.5;  // of the upper left pixel, where the file's columns and rows are 0
constexpr double kNear = 0.01;        // [m]
constexpr double kRotation = 1e-4;
constexpr double kLeastUnit = 0.01e-3;  // [m]
constexpr double kMostUnit = 10e-3;     // [m]
const std::string kStraight = "none";
const std::string kBrownConrady = "brown_conrady";
const std::string kInverse = "inverse_brown_conrady";

struct Lens {
  std::string model = kStraight;
  std::array<double, 5> coefficients{};  // k1, k2, p1, p2, k3
};

struct Pose {
  std::optional<std::array<Vector3, 3>> rows;
  std::optional<std::array<double, 4>> quaternion;  // w, x, y, z
  Vector3 translation = Vector3::Zero();            // [m]
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();
};

/// A camera in the shape that it has in the file.
struct CameraForm {
  std::string name;
  int width = 0;
  int height = 0;
  std::array<double, 2> focal{};
  std::array<double, 2> centre{};
  Lens lens;
  Pose pose;
  double unit = 0;  // [m]
};

struct CameraFile {
  std::string format;
  std::string version;
  std::vector<DepthCamera> cameras;
};

/// A number that is one of an array; 0 if it may be left out and is.
template <class S, std::size_t n>
void number_key(Map<S>& map, const std::string& name, std::array<double, n> S::*array, std::size_t item,
                const Range& range, bool required) {
  const Codec<double> codec = number(kPlain, range);
  map.add(
      {.name = name, .type = codec.type, .help = "", .required = required},
      [=](const Input& in, S& s) { return codec.read(in, (s.*array)[item]); },
      [=](const S& s) {
        const double value = (s.*array)[item];
        return required || value != 0 ? std::optional<Node>(codec.write(value)) : std::nullopt;
      });
}

Codec<Lens> lens_codec() {
  Map<Lens> map;
  map.required("model", &Lens::model, word({kStraight, kBrownConrady, kInverse}), "", "");
  const std::array<const char*, 5> names{"k1", "k2", "p1", "p2", "k3"};
  for (std::size_t i = 0; i < names.size(); ++i) {
    number_key(map, names[i], &Lens::coefficients, i, between(-1000, 1000), false);
  }
  map.check([](const Input& in, Lens& lens, bool good) {
    if (good && lens.model != kBrownConrady && lens.coefficients != std::array<double, 5>{}) {
      in.problem(lens.model == kStraight
                     ? "coefficients that are not 0, the model must be brown_conrady"
                     : "coefficients that are not 0, must be 0: undistort the images, or give brown_conrady's");
      return false;
    }
    return good;
  });
  return map.codec();
}

/// Makes the axes of what the file has; reports what is no rotation.
bool take_rotation(const Input& in, Pose& pose) {
  if (pose.quaternion) {
    const auto& [w, x, y, z] = *pose.quaternion;
    const Eigen::Quaterniond turn(w, x, y, z);
    if (std::abs(turn.norm() - 1) > kRotation) {
      in.at(*in.node().find("quaternion_wxyz"))
          .problem(fmt::format("of length {:.6g}, must be 1 within {}", turn.norm(), kRotation));
      return false;
    }
    pose.axes = turn.normalized().toRotationMatrix();
    return true;
  }
  Eigen::Matrix3d matrix;
  matrix << (*pose.rows)[0].transpose(), (*pose.rows)[1].transpose(), (*pose.rows)[2].transpose();
  const Input at = in.at(*in.node().find("rotation"));
  const double off = (matrix.transpose() * matrix - Eigen::Matrix3d::Identity()).cwiseAbs().maxCoeff();
  if (off > kRotation) {
    at.problem(
        fmt::format("R^T R differs from 1 by {:.2g}, must by at most {}: the columns are the camera's right, "
                    "down and forward in the world",
                    off, kRotation));
    return false;
  }
  if (matrix.determinant() < 0) {
    at.problem("a reflection, must be a rotation: the columns are the camera's right, down and forward in the world");
    return false;
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  pose.axes = svd.matrixU() * svd.matrixV().transpose();
  return true;
}

Codec<Pose> pose_codec() {
  const Range cosine = between(-1 - kRotation, 1 + kRotation);
  return Map<Pose>()
      .maybe("rotation", &Pose::rows, tuple_of<Vector3, 3>(vector3(kPlain, cosine)), "", "")
      .maybe("quaternion_wxyz", &Pose::quaternion, tuple_of<double, 4>(number(kPlain, cosine)), "", "")
      .exactly_one({"rotation", "quaternion_wxyz"})
      .required("translation_mm", &Pose::translation, vector3(kMillimetres, between(-100'000, 100'000)), "", "")
      .check([](const Input& in, Pose& pose, bool good) { return good && take_rotation(in, pose); })
      .codec();
}

DepthCamera camera_of(const CameraForm& form) {
  DepthCamera camera;
  camera.name = form.name;
  camera.depth_unit = form.unit;
  camera.distortion = form.lens.coefficients;
  camera.view = {.width = form.width,
                 .height = form.height,
                 .eye = form.pose.translation,
                 .axes = form.pose.axes,
                 .focal = {form.focal[0], form.focal[1]},
                 .centre = {form.centre[0] + kPixelMiddle, form.centre[1] + kPixelMiddle},
                 .near = kNear};
  return camera;
}

CameraForm form_of(const DepthCamera& camera) {
  const Camera& view = camera.view;
  CameraForm form;
  form.name = camera.name;
  form.width = view.width;
  form.height = view.height;
  form.unit = camera.depth_unit;
  form.focal = {view.focal.x(), view.focal.y()};
  form.centre = {view.centre.x() - kPixelMiddle, view.centre.y() - kPixelMiddle};
  form.lens.coefficients = camera.distortion;
  if (camera.distortion != std::array<double, 5>{}) {
    form.lens.model = kBrownConrady;
  }
  form.pose.rows.emplace();
  for (int row = 0; row < 3; ++row) {
    (*form.pose.rows)[static_cast<std::size_t>(row)] = view.axes.row(row);
  }
  form.pose.translation = view.eye;
  return form;
}

/// The same view by few pixels, whose outermost middles are those of the camera.
DepthCamera coarse(DepthCamera camera) {
  constexpr int kMost = 65;
  Camera& view = camera.view;
  const Eigen::Vector2i size(view.width, view.height);
  const Eigen::Vector2i fewer = size.cwiseMin(kMost);
  const Eigen::Vector2d scale = (fewer.array() - 1).cast<double>() / (size.array() - 1).cast<double>();
  view.width = fewer.x();
  view.height = fewer.y();
  view.focal = view.focal.cwiseProduct(scale);
  view.centre = ((view.centre.array() - kPixelMiddle) * scale.array() + kPixelMiddle).matrix();
  return camera;
}

/// Rules that a camera's keys keep together; reports the first that is broken.
bool check_camera(const Input& in, const CameraForm& form) {
  const auto broken = [&](const char* key, const std::string& rule) {
    in.at(*in.node().find(key)).must_be(rule);
    return false;
  };
  if (form.name == "time_s") {
    return broken("name", "another name than that of the column of times");
  }
  const std::array<std::pair<const char*, const char*>, 2> keys{{{"fx", "cx"}, {"fy", "cy"}}};
  for (std::size_t axis = 0; axis < 2; ++axis) {
    const int size = axis == 0 ? form.width : form.height;
    const double least = 0.04 * size;  // it sees 170 degrees
    const double most = 20.0 * size;   // 3 degrees
    if (form.focal[axis] < least || form.focal[axis] > most) {
      return broken(keys[axis].first, fmt::format("{:.4g} to {:.4g}, in pixels of an image of {}", least, most, size));
    }
    if (form.centre[axis] < -size || form.centre[axis] > 2 * size) {
      return broken(keys[axis].second, fmt::format("{} to {}, in pixels of an image of {}", -size, 2 * size, size));
    }
  }
  if (form.unit < kLeastUnit || form.unit > kMostUnit) {
    return broken("depth_unit_mm", "0.01 to 10: how many mm a 1 in an image is, 1 for a unit of 0.001 m");
  }
  try {
    pixel_rays(coarse(camera_of(form)));
  } catch (const InputError&) {
    in.at(*in.node().find("distortion")).problem("cannot be undone within the image");
    return false;
  }
  return true;
}

Codec<DepthCamera> camera_codec() {
  const auto pixels = integer(between(16, 4096));
  Map<CameraForm> map;
  map.required("name", &CameraForm::name, name(), "", "")
      .required("width", &CameraForm::width, pixels, "", "")
      .required("height", &CameraForm::height, pixels, "", "");
  number_key(map, "fx", &CameraForm::focal, 0, above(0), true);
  number_key(map, "fy", &CameraForm::focal, 1, above(0), true);
  number_key(map, "cx", &CameraForm::centre, 0, {}, true);
  number_key(map, "cy", &CameraForm::centre, 1, {}, true);
  map.required("depth_unit_mm", &CameraForm::unit, number(kMillimetres, above(0)), "", "")
      .required("distortion", &CameraForm::lens, lens_codec(), "", "")
      .required("pose", &CameraForm::pose, pose_codec(), "", "")
      .check([](const Input& in, CameraForm& form, bool good) { return good && check_camera(in, form); });
  return kept_as<DepthCamera, CameraForm>(
      map.codec(), [](const Input&, const CameraForm& form) { return std::optional(camera_of(form)); }, &form_of);
}

const Codec<CameraFile>& file_codec() {
  static const Codec<CameraFile> codec =
      Map<CameraFile>()
          .required("format", &CameraFile::format, word({"touchfield-cameras"}), "", "")
          .required("version", &CameraFile::version, word({"1"}), "", "")
          .required("cameras", &CameraFile::cameras,
                    list_of<DepthCamera>(camera_codec(), 1, kMostCameras,
                                         {[](const DepthCamera& camera) { return camera.name; }, ""}),
                    "", "")
          .codec();
  return codec;
}

}  // namespace

}  // namespace schema

std::string cameras_text(const std::vector<DepthCamera>& cameras) {
  return schema::block_text(schema::file_codec().write({"touchfield-cameras", "1", cameras}));
}

std::vector<DepthCamera> read_cameras_text(const std::string& text, const std::string& path) {
  schema::Reading reading(path, {});
  const schema::Node root = schema::read_map(text, "a file of cameras", reading);
  schema::CameraFile file;
  schema::file_codec().read({root, "", reading}, file);
  if (reading.failed()) {
    throw InputError(reading.message());
  }
  std::int64_t pixels = 0;
  for (const DepthCamera& camera : file.cameras) {
    pixels += std::int64_t{camera.view.width} * camera.view.height;
  }
  if (pixels > kMostCameraPixels) {
    throw InputError(fmt::format("{}: the images of all cameras have {} pixels together, must be at most {}", path,
                                 pixels, kMostCameraPixels));
  }
  return file.cameras;
}

}  // namespace touchfield
