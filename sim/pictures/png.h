#pragma once

#include <map>
#include <string>

#include "sim/pictures/colour_image.h"

namespace touchfield {

/// The bytes of a PNG file of 8 bits a channel.
///
/// texts    its tEXt chunks: keyword (1 to 79 characters) and text, both Latin-1
/// source   ISO/IEC 15948
std::string png_file(const ColourImage& image, const std::map<std::string, std::string>& texts);

}  // namespace touchfield
