#pragma once

#include <string>
#include <vector>

#include "sim/mesh/raster/raster.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/pictures/picture_format.h"

namespace touchfield {

/// What a depth camera said of what it saw.
struct CameraSight {
  std::string label;         // beside it
  Camera camera;             // where it stands
  std::vector<float> depth;  // of its pixels, row by row from the upper left one [m]; 0: none
};

/// A picture of 1200 x 900 pixels with one row per camera. More than three cameras are in two columns. Each camera has
/// two images. The left one is its whole view of the shaded mesh. The right one shows the depths that it measured in
/// the part with the mesh, which a frame marks in the left one.
///
/// One scale of colours serves all. It goes from the nearest to the farthest point of the mesh that a camera sees,
/// rounded outwards to 10 mm. Red marks the pixels where a camera sees the mesh but measured no depth.
///
/// path     where it lands, whole or not at all
/// mesh     what there is [m]
/// sights   1 to 8
/// throws   InputError where a depth image has another size than its camera; IoError if it cannot be written
void draw_sights(const std::string& path, const std::string& title, const std::string& subtitle,
                 const TriangleMesh& mesh, const std::vector<CameraSight>& sights, PictureFormat format);

}  // namespace touchfield
