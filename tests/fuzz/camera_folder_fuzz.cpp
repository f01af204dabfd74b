// A folder of recorded depth images. The first byte of the input says which of its files the rest is: c cameras.yaml,
// t times.csv, i the first image of the camera `left`.

#include <algorithm>
#include <array>
#include <cmath>
#include <iterator>
#include <map>

#include "sim/cameras/camera_folder.h"
#include "tests/cameras/recording_support.h"
#include "tests/fuzz/fuzz_support.h"

using namespace touchfield;

namespace {

namespace fs = std::filesystem;

/// A good recording of this process.
const fs::path& recording() {
  static const fs::path folder = [] {
    const fs::path own = fs::path(fuzz::file_with("recorded", "")).parent_path() / "images";
    fs::remove_all(own);
    support::write_recording(own, support::two_cameras(), 1);
    return own;
  }();
  return folder;
}

void read_frames(const CameraFolder& folder) {
  for (std::size_t i = 0; i < std::min<std::size_t>(folder.size(), 2); ++i) {
    const DepthFrame frame = folder.frame(i);
    fuzz::require(frame.images.size() == folder.cameras().size(), "an image a camera");
    for (std::size_t c = 0; c < frame.images.size(); ++c) {
      const Camera& view = folder.cameras()[c].view;
      fuzz::require(std::ssize(frame.images[c].depth) == view.width * view.height, "a depth a pixel");
      fuzz::require(std::ranges::all_of(frame.images[c].depth, [](float z) { return std::isfinite(z) && z >= 0; }),
                    "depths are finite");
    }
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) {
    return 0;
  }
  const std::string kinds = "cti";
  const auto kind = kinds.find(static_cast<char>(data[0]));
  if (kind == std::string::npos) {
    return -1;
  }
  const fs::path file = recording() / std::array{"cameras.yaml", "times.csv", "left/000000.png"}[kind];
  static std::map<std::string, std::string> good;
  if (!good.contains(file)) {
    std::ifstream stream(file, std::ios::binary);
    good[file] = {std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  }
  std::ofstream(file, std::ios::binary) << fuzz::text_of(data + 1, size - 1);
  {
    const fuzz::TimeLimit limit;
    fuzz::accepts([&] {
      const CameraFolder folder(recording());
      for (const DepthCamera& camera : folder.cameras()) {
        require_camera(camera.view);
      }
      read_frames(folder);
    });
  }
  std::ofstream(file, std::ios::binary) << good[file];
  return 0;
}
