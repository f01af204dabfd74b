#pragma once

#include <string>

namespace touchfield {

/// What a picture's file is: pixels, or lines and text of any size with the skin and fields embedded as images.
enum class PictureFormat { kPng, kPdf, kSvg };

/// The ending of its file's name: png, pdf or svg.
inline std::string to_string(PictureFormat format) {
  return format == PictureFormat::kPdf ? "pdf" : format == PictureFormat::kSvg ? "svg" : "png";
}

}  // namespace touchfield
