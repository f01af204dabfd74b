#pragma once

#include <cstdint>
#include <string>
#include <vector>
#include <zlib.h>

#include <Eigen/Geometry>

#include "sim/cameras/camera_folder.h"
#include "sim/cameras/depth_camera.h"

/// What the tests of recorded images share: small cameras, made-up images, PNG files with other headers.
namespace touchfield {
inline namespace support {

inline DepthCamera small_camera(const std::string& name, int width = 24, int height = 16) {
  DepthCamera camera;
  camera.name = name;
  camera.depth_unit = 0.1e-3;
  camera.view = {.width = width,
                 .height = height,
                 .eye = {0.21, -0.13, 0.0401},
                 .axes = Eigen::AngleAxisd(0.7, Vector3(1, 2, -1).normalized()).toRotationMatrix(),
                 .focal = {21.3 * width / 24, 20.9 * width / 24},
                 .centre = {0.5 * width + 0.37, 0.5 * height - 0.21},
                 .near = 0.01};
  return camera;
}

/// Depths from 0.2 m on that no unit holds exactly, with a pixel in seven that sees nothing.
inline DepthImage made_up_image(const DepthCamera& camera, int seed) {
  DepthImage image{camera.view.width, camera.view.height, {}};
  for (int pixel = 0; pixel < image.width * image.height; ++pixel) {
    const auto mixed = static_cast<unsigned>(pixel * 7919 + seed * 104729);
    image.depth.push_back(pixel % 7 == 3 ? 0.0F : 0.2F + 1.03e-5F * static_cast<float>(mixed % 9973));
  }
  return image;
}

inline DepthFrame made_up_frame(const std::vector<DepthCamera>& cameras, int number) {
  DepthFrame frame{number / 30.0, {}};
  for (std::size_t c = 0; c < cameras.size(); ++c) {
    frame.images.push_back(made_up_image(cameras[c], 10 * number + static_cast<int>(c)));
  }
  return frame;
}

inline std::vector<DepthCamera> two_cameras() {
  std::vector<DepthCamera> cameras{small_camera("left"), small_camera("right", 32, 20)};
  cameras[1].distortion = {0.08, -0.02, 1e-3, -2e-3, 0.005};
  cameras[1].depth_unit = 1e-3;
  cameras[1].view.eye = {-0.21, -0.13, 0.0401};
  return cameras;
}

inline void write_recording(const std::string& folder, const std::vector<DepthCamera>& cameras, int frames) {
  CameraFolderWriter writer(folder, cameras);
  for (int i = 0; i < frames; ++i) {
    writer.add(made_up_frame(cameras, i));
  }
}

inline std::string big_endian_bytes(std::uint32_t value) {
  std::string bytes;
  for (const unsigned shift : {24U, 16U, 8U, 0U}) {
    bytes += static_cast<char>(value >> shift & 0xFFU);
  }
  return bytes;
}

inline std::string png_chunk(const std::string& type, const std::string& data) {
  const std::string body = type + data;
  const auto crc = crc32_z(0, reinterpret_cast<const Bytef*>(body.data()), body.size());
  return big_endian_bytes(static_cast<std::uint32_t>(data.size())) + body +
         big_endian_bytes(static_cast<std::uint32_t>(crc));
}

/// The header that a PNG file begins with, its checksum right.
inline std::string png_begin(std::uint32_t width, std::uint32_t height, char bits, char colour, char interlaced = 0) {
  return std::string("\x89PNG\r\n\x1a\n") + png_chunk("IHDR", big_endian_bytes(width) + big_endian_bytes(height) +
                                                                  bits + colour + std::string(2, '\0') + interlaced);
}

inline std::string zlib_packed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string packed(size, '\0');
  compress2(reinterpret_cast<Bytef*>(packed.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(),
            Z_BEST_COMPRESSION);
  packed.resize(size);
  return packed;
}

}  // namespace support
}  // namespace touchfield
