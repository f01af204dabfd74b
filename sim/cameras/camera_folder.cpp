#include "sim/cameras/camera_folder.h"

#include <algorithm>
#include <chrono>
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

#include "sim/cameras/camera_table.h"
#include "sim/cameras/depth_png.h"
#include "sim/cameras/recording_check.h"
#include "sim/core/errors.h"
#include "sim/core/files.h"
#include "sim/core/require.h"
#include "sim/scene/number_table.h"
#include "sim/scene/quantity.h"
#include "sim/scene/schema.h"
#include "sim/scene/text_file.h"

namespace touchfield {

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
  order.reserve(columns.size());
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
  require(std::abs(*seconds) <= kLatest,
          "time_s = {} must be at most {:g} in magnitude: it is in seconds, from any start; divide ms, us or ns of a "
          "clock",
          shown, kLatest);
  return *seconds;
}

}  // namespace

CameraFolder::CameraFolder(std::string folder, Progress* progress) : folder_(std::move(folder)) {
  std::error_code error;
  if (!fs::is_directory(folder_, error)) {
    throw InputError(
        fmt::format("{}: {}", folder_, fs::exists(folder_, error) ? "a file, must be a folder" : "no such folder"));
  }
  const std::string cameras = path_in(folder_, kCamerasFile);
  const std::string table = path_in(folder_, kTimesFile);
  for (const std::string& file : {cameras, table}) {
    if (fs::exists(file, error) && !fs::is_regular_file(file, error)) {  // a pipe might never end
      throw InputError(file + ": must be a file");
    }
  }
  cameras_ = read_cameras_text(read_whole_file(cameras, schema::kMostTextBytes), cameras);
  read_rows(table);
  std::vector<double> seconds;
  std::ranges::transform(rows_, std::back_inserter(seconds), &Row::seconds);
  warnings_ = recording_warnings(cameras_, seconds);
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
  const auto begun = std::chrono::steady_clock::now();
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
  progress.end(std::chrono::duration<double>(std::chrono::steady_clock::now() - begun).count());
  if (faulty > kMostNamed) {
    faults.push_back(
        fmt::format("{}: {} of {} images are faulty, these are the first {}", table, faulty, images, kMostNamed));
  }
  require(faulty <= 0, "{}", fmt::join(faults, "\n"));
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
    if (fs::exists(path_in(folder_, file), error)) {
      throw InputError(
          fmt::format("{}: there already, images are recorded to a folder of their own", path_in(folder_, file)));
    }
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
  const auto refuse = [&](const std::string& what) {
    throw InputError(fmt::format("{}: frame {}: {}", folder_, frames_, what));
  };
  if (frames_ == schema::kMostListed) {
    refuse(fmt::format("a recording must have at most {} frames", schema::kMostListed));
  }
  if (!std::isfinite(frame.seconds) || (frames_ > 0 && frame.seconds <= seconds_)) {
    refuse(fmt::format("at {} s must be after the frame before it, at {} s", frame.seconds, seconds_));
  }
  if (frame.images.size() != cameras_.size()) {
    refuse(fmt::format("{} images, must be {}", frame.images.size(), cameras_.size()));
  }
  std::string row = schema::decimal_text(frame.seconds);
  for (std::size_t c = 0; c < cameras_.size(); ++c) {
    const DepthImage& image = frame.images[c];
    const Camera& view = cameras_[c].view;
    row += ",";
    if (image.width == 0 && image.height == 0) {
      continue;
    }
    if (image.width != view.width || image.height != view.height) {
      refuse(fmt::format("{}: {} x {} pixels, must be {} x {}", cameras_[c].name, image.width, image.height, view.width,
                         view.height));
    }
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
