#pragma once

#include <string>

#include <Eigen/Core>

#include "sim/pictures/picture_format.h"

namespace touchfield {

/// A picture of 1200 x 900 pixels: what was measured at a point against what was computed there, a dot each, and the
/// line on which they are the same.
///
/// path                where it lands, whole or not at all
/// title               in bold above
/// computed, measured  magnitudes, of equally many points
/// first, second       lines below
/// throws              IoError if it cannot be written
void draw_scan(const std::string& path, const std::string& title, const Eigen::VectorXd& computed,
               const Eigen::VectorXd& measured, const std::string& first, const std::string& second,
               PictureFormat format);

}  // namespace touchfield
