#pragma once

#include <string>

#include "sim/core/types.h"
#include "sim/pictures/picture_format.h"

namespace touchfield {

/// What pictures of a scan say beside it.
struct ScanPicture {
  std::string title;  // in bold above
  std::string first;  // lines below
  std::string second;
};

/// A picture of 1200 x 900 pixels: what was measured at a point against what was computed there, a dot each, and the
/// line on which they are the same.
///
/// path                where it lands, whole or not at all
/// computed, measured  magnitudes, of equally many points
/// throws              IoError if it cannot be written
void draw_scan(const std::string& path, const ScanPicture& picture, const Eigen::VectorXd& computed,
               const Eigen::VectorXd& measured, PictureFormat format);

}  // namespace touchfield
