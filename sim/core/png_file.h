#pragma once

#include <cstddef>
#include <map>
#include <span>
#include <string>

namespace touchfield {

enum class PngPixels {
  kGrey16,  // 16 bits each, in this machine's order
  kRgb8,    // red, green and blue of 8 bits each
};

/// The bytes of a PNG file, not interlaced.
///
/// width, height   [pixels], > 0
/// pixels          row by row from the upper left corner
/// texts           its tEXt chunks, or iTXt where a text is not ASCII: keyword (1 to 79 characters of ASCII) and text;
///                 empty texts are left out
/// source          ISO/IEC 15948
/// throws          IoError with libspng's reason
std::string png_file(int width, int height, PngPixels form, std::span<const std::byte> pixels,
                     const std::map<std::string, std::string>& texts = {});

}  // namespace touchfield
