#pragma once

#include <string>

#include "sim/cameras/depth_camera.h"

namespace touchfield {

/// Writes depths as a PNG file of one channel of 16 bits, atomically: round(depth / unit) of each pixel, 0 where the
/// camera saw nothing. A depth for which there is no such number, below half a unit or above 65535.5, is written as 0,
/// as by a depth camera beyond its range.
///
/// unit     of the numbers [m], > 0
/// source   ISO/IEC 15948
/// throws   InputError on a depth that is negative or not finite; NoRoomError and IoError of write_atomically
void write_depth_png(const std::string& path, const DepthImage& image, double unit);

/// Depths of such a file, number times unit: what was written, to half a unit. What follows the image's end is ignored,
/// and so are its colour space and texts, unless these unpack to more than 64 MiB.
///
/// width, height   that it must have [pixels]; no more memory is taken than an image of this size and such texts need,
///                 whatever the file promises
/// throws          InputError "path: ..." unless it is a whole, undamaged 16-bit grey PNG, not interlaced, of this size
DepthImage read_depth_png(const std::string& path, double unit, int width, int height);

/// The same refusals as far as they can be told without unpacking the image: no such file, another format or size, cut
/// off.
void check_depth_png(const std::string& path, int width, int height);

}  // namespace touchfield
