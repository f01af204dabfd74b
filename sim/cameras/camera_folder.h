#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "sim/cameras/depth_camera.h"
#include "sim/cameras/hand_tables.h"
#include "sim/core/progress.h"

namespace touchfield {

/// At most this many cameras stand in a file.
inline constexpr std::size_t kMostCameras = 8;

/// Cameras as the text of a file cameras.yaml (docs/cameras.md). Its centre counts from the middle of the upper left
/// pixel, as in OpenCV and RealSense's library: cx = centre_u - 0.5.
std::string cameras_text(const std::vector<DepthCamera>& cameras);

/// The cameras of such a text; `near` is 10 mm. A rotation is taken to the nearest one, from which it may differ by
/// 1e-4 in R^T R.
///
/// path     what messages call it
/// throws   InputError naming file, line, field, value and rule: what is missing, unknown or out of range, no rotation,
///          a distortion that cannot be undone within the image, more than kMostCameraPixels together
std::vector<DepthCamera> read_cameras_text(const std::string& text, const std::string& path);

/// Recorded depth images (docs/cameras.md): cameras.yaml, times.csv, which has one row per frame, and the images that
/// it names. A camera without a file in a row saw nothing.
///
/// Everything is checked here but what only unpacking an image can tell, each file once, and nothing of the images is
/// kept.
class CameraFolder {
 public:
  /// progress   hears of the check; may be null
  /// throws     InputError naming file, line and rule: what cameras.yaml or times.csv lacks or has wrong, and the first
  ///            ten images that are missing, cut off, of another format or size, with how many more there are
  explicit CameraFolder(std::string folder, Progress* progress = nullptr);

  const std::vector<DepthCamera>& cameras() const { return cameras_; }
  /// What can be read and is hardly meant (recording_warnings).
  const std::vector<std::string>& warnings() const { return warnings_; }
  /// Frames, at least 1.
  std::size_t size() const { return rows_.size(); }
  /// When a frame was taken [s], by the recording's own clock; rising.
  double seconds(std::size_t frame) const { return rows_.at(frame).seconds; }
  std::vector<double> times() const;
  /// Where somebody knows the hand's landmarks to be, of the table landmarks.csv; empty if there is none. A fit is
  /// compared with it and does not use it.
  const LandmarkRecording& landmarks() const { return landmarks_; }
  /// Reads a frame's images, one per camera, each of its camera's size.
  ///
  /// throws   InputError on an image that is damaged or has changed since
  DepthFrame frame(std::size_t frame) const;

 private:
  struct Row {
    int line;  // of times.csv
    double seconds;
    std::vector<std::string> files;  // one per camera, from the folder; empty: none
  };

  void read_rows(const std::string& table);
  void check_images(const std::string& table, Progress& progress) const;

  std::string folder_;
  std::vector<DepthCamera> cameras_;
  std::vector<Row> rows_;
  std::vector<std::string> warnings_;
  LandmarkRecording landmarks_;
};

/// The files that CameraFolderWriter writes of so many frames, named from the folder.
std::vector<std::string> recorded_files(const std::vector<DepthCamera>& cameras, std::size_t frames);

/// Writes such a folder frame by frame. A frame's row is added to times.csv once its images are written. The folder can
/// thus be read after every frame, even if the process or the machine stops within one.
class CameraFolderWriter {
 public:
  /// folder   made if it is not there
  /// throws   InputError if it holds a recording already or a camera is not one that can be read again (a name other
  ///          than letters, digits, _ and -; two of the same name; numbers out of range), IoError
  CameraFolderWriter(std::string folder, std::vector<DepthCamera> cameras);

  /// Writes one image per camera, CAMERA/NUMBER.png. An image without pixels (size 0 x 0) is not written: its camera
  /// saw nothing.
  ///
  /// throws   InputError unless its time is after that of the frame before and its images are as its cameras, and after
  ///          10,000 frames; IoError
  void add(const DepthFrame& frame);

 private:
  std::string folder_;
  std::vector<DepthCamera> cameras_;
  std::string table_;  // times.csv so far
  std::size_t frames_ = 0;
  double seconds_ = 0;  // of the last frame
};

}  // namespace touchfield
