#pragma once

#include <string>

#include "sim/pictures/picture_format.h"
#include "sim/pictures/skin_view.h"
#include "sim/store/run_data.h"

namespace touchfield {

/// True if exactly one axis of the grid has one point.
bool is_plane(const FieldGrid& grid);

/// A plane on a picture: a pixel has the colour of the grid point that is nearest to it.
struct PlaneView {
  int horizontal;  // axis: 0, 1 or 2
  int vertical;
  int normal;
  PixelBox box;
};

/// The plane as large as it fits; x to the right if the plane has an x, z up if it has a z.
PlaneView plane_view(const FieldGrid& grid);

/// A picture of |p| in a plane of a run, 0 to `top` [Pa], points inside a body grey, with axes in mm.
std::string field_picture(const Run& run, const FieldResult& field, const Eigen::VectorXcd& pressure, double top,
                          const std::string& subtitle, PictureFormat format);

}  // namespace touchfield
