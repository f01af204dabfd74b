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

/// A picture of 1200 x 900 pixels, one row per camera, or two rows beside each other of more than three: at the left
/// the whole image as the camera would see a shaded mesh, at the right the depths that it said of the part with the
/// mesh, which a frame marks in the first. One scale of colours for all, from the nearest point of the mesh that a
/// camera sees to the farthest one; red where a camera sees the mesh and said no depth.
///
/// path     where it lands, whole or not at all
/// mesh     what there is [m]
/// sights   1 to 8
/// throws   InputError where a depth image has another size than its camera; IoError if it cannot be written
void draw_sights(const std::string& path, const std::string& title, const std::string& subtitle,
                 const TriangleMesh& mesh, const std::vector<CameraSight>& sights, PictureFormat format);

}  // namespace touchfield
