#include "sim/cameras/camera_folder.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <optional>
#include <system_error>
#include <tuple>
#include <utility>

#include <fmt/format.h>
#include <fmt/ranges.h>

#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/core/version.h"
#include "sim/scene/number_table.h"
#include "sim/scene/quantity.h"
#include "sim/scene/scene_table.h"
#include "sim/scene/schema.h"
#include "sim/scene/sensor_table.h"
#include "sim/scene/yaml_tree.h"

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

namespace {

namespace fs = std::filesystem;

constexpr const char* kCamerasFile = "cameras.yaml";
constexpr const char* kTimesFile = "times.csv";
constexpr const char* kTimeColumn = "time_s";
constexpr double kLatest = 1e10;  // [s]: more than since 1970, to be told from that in milliseconds

std::string path_in(const std::string& folder, const std::string& file) {
  return (fs::path(folder) / file).lexically_normal().string();
}

std::string image_file(const DepthCamera& camera, std::size_t frame) {
  return fmt::format("{}/{:06}.png", camera.name, frame);
}

/// Where the time and then each camera stand in a row.
std::vector<std::size_t> header_order(const schema::Cells& names, const std::vector<std::string>& columns) {
  std::vector<std::size_t> order;
  for (const std::string& column : columns) {
    order.push_back(static_cast<std::size_t>(std::ranges::find(names, column) - names.begin()));
  }
  require(names.size() == columns.size() && std::ranges::find(order, names.size()) == order.end(),
          "a header {} must come first: the cameras of {}", fmt::join(columns, ","), kCamerasFile);
  return order;
}

double row_seconds(std::string_view text) {
  const auto seconds = schema::parse_decimal(text);
  const std::string shown = schema::quoted_for_message(std::string(text));
  require(seconds, "time_s = {} must be a number, such as 1.5", shown);
  require(
      std::abs(*seconds) <= kLatest,
      "time_s = {} must be at most {:g} in magnitude: it is in seconds, from any start; divide ms, us or ns of a clock",
      shown, kLatest);
  return *seconds;
}

}  // namespace

CameraFolder::CameraFolder(std::string folder, Progress* progress) : folder_(std::move(folder)) {
  std::error_code error;
  require(fs::is_directory(folder_, error), "{}: {}", folder_,
          fs::exists(folder_, error) ? "a file, must be a folder" : "no such folder");
  const std::string cameras = path_in(folder_, kCamerasFile);
  const std::string table = path_in(folder_, kTimesFile);
  for (const std::string& file : {cameras, table}) {
    if (fs::exists(file, error) && !fs::is_regular_file(file, error)) {  // a pipe might never end
      throw InputError(file + ": must be a file");
    }
  }
  cameras_ = read_cameras_text(read_whole_file(cameras, schema::kMostTextBytes), cameras);
  read_rows(table);
  warnings_ = recording_warnings(cameras_, times());
  Progress silent;
  check_images(table, progress != nullptr ? *progress : silent);
  if (const std::string landmarks = path_in(folder_, kLandmarksFile); fs::is_regular_file(landmarks, error)) {
    landmarks_ = read_landmarks(landmarks);
  }
}

void CameraFolder::read_rows(const std::string& table) {
  std::vector<std::string> columns{kTimeColumn};
  std::ranges::transform(cameras_, std::back_inserter(columns), &DepthCamera::name);
  std::vector<std::size_t> order;
  schema::read_table(
      table, schema::kMostTextBytes, [&](const schema::Cells& names) { order = header_order(names, columns); },
      [&](int line, const schema::Cells& cells) {
        Row row{line, row_seconds(cells[order.front()]), {}};
        require(rows_.empty() || row.seconds > rows_.back().seconds,
                "time_s = {:.15g} must be after {:.15g}, that of the row before it", row.seconds,
                rows_.empty() ? 0.0 : rows_.back().seconds);
        for (std::size_t camera = 1; camera < order.size(); ++camera) {
          row.files.emplace_back(cells[order[camera]]);
        }
        rows_.push_back(std::move(row));
      });
  require(!rows_.empty(), "{}: no frame in it, must hold at least one", table);
  require(rows_.size() <= schema::kMostListed, "{}: {} frames, must be at most {}", table, rows_.size(),
          schema::kMostListed);
}

void CameraFolder::check_images(const std::string& table, Progress& progress) const {
  constexpr std::size_t kMostNamed = 10;
  std::map<std::tuple<std::string, int, int>, std::string> checked;  // what is wrong with a file as one of such a size
  std::vector<std::string> faults;
  std::size_t images = 0;
  std::size_t faulty = 0;
  const auto fault_of = [&](const std::string& file, const Camera& view) -> const std::string& {
    const auto [entry, is_new] = checked.try_emplace({file, view.width, view.height});
    if (is_new) {
      try {
        check_depth_png(file, view.width, view.height);
      } catch (const InputError& error) {
        entry->second = error.what();
      }
    }
    return entry->second;
  };
  progress.begin(fmt::format("check the images of {} frame{}", rows_.size(), rows_.size() == 1 ? "" : "s"));
  const double begun = steady_now();
  for (std::size_t row = 0; row < rows_.size(); ++row) {
    for (std::size_t c = 0; c < cameras_.size(); ++c) {
      if (rows_[row].files[c].empty()) {
        continue;
      }
      ++images;
      const std::string& fault = fault_of(path_in(folder_, rows_[row].files[c]), cameras_[c].view);
      if (!fault.empty() && ++faulty <= kMostNamed) {
        faults.push_back(fmt::format("{}:{}: {}: {}", table, rows_[row].line, cameras_[c].name, fault));
      }
    }
    progress.advance((static_cast<double>(row) + 1) / static_cast<double>(rows_.size()));
  }
  progress.end(steady_now() - begun);
  if (faulty > kMostNamed) {
    faults.push_back(
        fmt::format("{}: {} of {} images are faulty, these are the first {}", table, faulty, images, kMostNamed));
  }
  require(faulty <= 0, "{}", fmt::join(faults, "\n"));
}

std::vector<double> CameraFolder::times() const {
  std::vector<double> seconds;
  std::ranges::transform(rows_, std::back_inserter(seconds), &Row::seconds);
  return seconds;
}

DepthFrame CameraFolder::frame(std::size_t frame) const {
  const Row& row = rows_.at(frame);
  DepthFrame seen{row.seconds, {}};
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const int width = cameras_[c].view.width;
    const int height = cameras_[c].view.height;
    if (row.files[c].empty()) {
      const auto pixels = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
      seen.images.push_back({width, height, std::vector<float>(pixels, 0.0F)});
    } else {
      seen.images.push_back(read_depth_png(path_in(folder_, row.files[c]), cameras_[c].depth_unit, width, height));
    }
  }
  return seen;
}

std::vector<std::string> recorded_files(const std::vector<DepthCamera>& cameras, std::size_t frames) {
  std::vector<std::string> files{kCamerasFile, kTimesFile};
  for (const DepthCamera& camera : cameras) {
    for (std::size_t frame = 0; frame < frames; ++frame) {
      files.push_back(image_file(camera, frame));
    }
  }
  return files;
}

CameraFolderWriter::CameraFolderWriter(std::string folder, std::vector<DepthCamera> cameras)
    : folder_(std::move(folder)), cameras_(std::move(cameras)), table_(kTimeColumn) {
  for (const char* file : {kCamerasFile, kTimesFile}) {
    std::error_code error;
    require(!fs::exists(path_in(folder_, file), error),
            "{}: there already, images are recorded to a folder of their own", path_in(folder_, file));
  }
  const std::string text = cameras_text(cameras_);
  read_cameras_text(text, path_in(folder_, kCamerasFile));
  for (const DepthCamera& camera : cameras_) {
    table_ += "," + camera.name;
    std::error_code error;
    fs::create_directories(fs::path(folder_) / camera.name, error);
    if (error) {
      throw IoError(fmt::format("{}: cannot be made: {}", path_in(folder_, camera.name), error.message()));
    }
  }
  table_ += "\n";
  write_atomically(path_in(folder_, kCamerasFile), {text});
  write_atomically(path_in(folder_, kTimesFile), {table_});
}

void CameraFolderWriter::add(const DepthFrame& frame) {
  const std::string own = fmt::format("{}: frame {}", folder_, frames_);
  require(frames_ < schema::kMostListed, "{}: a recording must have at most {} frames", own, schema::kMostListed);
  require(std::isfinite(frame.seconds) && (frames_ == 0 || frame.seconds > seconds_),
          "{}: at {} s must be after the frame before it, at {} s", own, frame.seconds, seconds_);
  require(frame.images.size() == cameras_.size(), "{}: {} images, must be {}", own, frame.images.size(),
          cameras_.size());
  std::string row = schema::decimal_text(frame.seconds);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const DepthImage& image = frame.images[c];
    const Camera& view = cameras_[c].view;
    row += ",";
    if (image.width == 0 && image.height == 0) {
      continue;
    }
    require(image.width == view.width && image.height == view.height, "{}: {}: {} x {} pixels, must be {} x {}", own,
            cameras_[c].name, image.width, image.height, view.width, view.height);
    const std::string file = image_file(cameras_[c], frames_);
    write_depth_png(path_in(folder_, file), image, cameras_[c].depth_unit);
    row += file;
  }
  table_ += row + "\n";
  write_atomically(path_in(folder_, kTimesFile), {table_});
  seconds_ = frame.seconds;
  ++frames_;
}

}  // namespace touchfield
