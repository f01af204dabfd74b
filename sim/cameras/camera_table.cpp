#include "sim/cameras/camera_table.h"

#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "sim/core/errors.h"
#include "sim/core/require.h"
#include "sim/scene/camera_models.h"
#include "sim/scene/rigid_pose.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/schema.h"

namespace touchfield {

namespace schema {

namespace {

constexpr double kPixelMiddle = 0.5;    // of the upper left pixel, where the file's columns and rows are 0
constexpr double kNear = 0.01;          // [m]
constexpr double kLeastUnit = 0.01e-3;  // [m]
constexpr double kMostUnit = 10e-3;     // [m]
const std::string kStraight = "none";
const std::string kBrownConrady = "brown_conrady";
const std::string kInverse = "inverse_brown_conrady";

struct Lens {
  std::string model = kStraight;
  std::array<double, 5> coefficients{};  // k1, k2, p1, p2, k3
};

/// A camera in the shape that it has in the file.
struct CameraForm {
  std::string name;
  int width = 0;
  int height = 0;
  std::array<double, 2> focal{};
  std::array<double, 2> centre{};
  Lens lens;
  RigidMotion pose;  // the columns of its rotation: right, down and forward
  double unit = 0;   // [m]
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
      return in.problem(lens.model == kStraight
                            ? "coefficients that are not 0, the model must be brown_conrady"
                            : "coefficients that are not 0, must be 0: undistort the images, or give brown_conrady's");
    }
    return good;
  });
  return map.codec();
}

DepthCamera camera_of(const CameraForm& form) {
  DepthCamera camera;
  camera.name = form.name;
  camera.depth_unit = form.unit;
  camera.distortion = form.lens.coefficients;
  camera.view = {.width = form.width,
                 .height = form.height,
                 .eye = form.pose.shift,
                 .axes = form.pose.rotation,
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
  form.pose = {view.axes, view.eye};
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
  const auto broken = [&](const char* key, const std::string& rule) { return in.key(key).must_be(rule); };
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
    return in.key("distortion").problem("cannot be undone within the image");
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
      .required("pose", &CameraForm::pose, rigid_pose_codec("the camera's right, down and forward"), "", "")
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
  require(pixels <= kMostCameraPixels, "{}: the images of all cameras have {} pixels together, must be at most {}",
          path, pixels, kMostCameraPixels);
  return file.cameras;
}

}  // namespace touchfield
