#pragma once

#include <string>

#include "sim/pictures/picture_format.h"
#include "sim/pictures/skin_view.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// True if exactly one axis of the grid has one point.
bool is_plane(const FieldGrid& grid);

/// A plane in two panels of a picture, |p| and its level: beside or above each other, whichever is larger. A pixel has
/// the colour of the grid point that is nearest to it.
struct PlaneView {
  int horizontal;  // axis: 0, 1 or 2
  int vertical;
  int normal;
  PixelBox linear;
  PixelBox level;  // of the same size
};

/// The plane as large as it fits; x to the right if the plane has an x, z up if it has a z.
PlaneView plane_view(const FieldGrid& grid);

/// The ends of a plane's colours [Pa].
struct FieldTops {
  double own;      // of the method
  double loudest;  // of all methods: 0 dB
};

/// A picture of |p| in a plane of a run, from 0 to the method's own top and from -40 to 0 dB of the loudest's. Points
/// inside a body are grey. It has axes in mm, the target's boxes where the plane cuts them, and the transducers or the
/// way to them.
std::string field_picture(const Run& run, const FieldResult& field, const Eigen::VectorXcd& pressure,
                          const FieldTops& tops, const std::string& subtitle, PictureFormat format);

}  // namespace touchfield
