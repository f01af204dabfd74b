#pragma once

#include <string>
#include <vector>

#include "sim/pictures/picture_format.h"
#include "sim/pictures/skin_sight.h"
#include "sim/run/motion_data.h"
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

/// Discs of 16 corners at the transducers, turned as they are. Their radius is 5 mm, or 0.45 times the least distance
/// between two transducers if that is less.
TriangleMesh transducer_discs(const TransducerArray& array);

/// Draws the pictures of a run:
///
/// setup.png               the skin and an array of transducers
/// target.png              the wanted |p|
/// pressure_NAME.png       |p| of a method, one picture per method
/// radiation_NAME.png      the radiation pressure of a method, suction below 0
/// overview.png            the pictures of |p| on the skin side by side
/// field_NAME_METHOD.png   one picture per plane among the fields and per method
///
/// Target, pressures and overview show the skin seen from the array's side. They share one colour scale, with a colour
/// bar and a caption. Radiation pressures share another. The ending is the format's. The texts in each file say which
/// run it shows: Software, Source, Description, Scene hash (see Canvas::describe). A file appears whole or not at all.
///
/// directory   where they land
/// returns     the files written
/// throws      IoError if a picture cannot be written
std::vector<std::string> draw_figures(const std::string& directory, const Run& run, PictureFormat format);

/// One of them by its name without the ending, e.g. "pressure_surface": the bytes of its file.
/// throws      InputError that lists the names there are
std::string draw_figure(const std::string& name, const Run& run, PictureFormat format);

/// A picture of 1200 x 900 pixels with three plots over the time of the motion, one below the other. They show
/// relative_error [%], displacement since the sample [mm] and mean |p| inside the target [Pa]. Each has one line per
/// method through its scores. Lines break where a value was not computed.
///
/// path     where it lands, whole or not at all
/// returns  false if no score has any of the three; nothing is written then
/// throws   InputError if parts of the motion do not fit each other; IoError if it cannot be written
bool draw_motion(const std::string& path, const Motion& motion, PictureFormat format);

/// A strip of 1200 x 900 pixels of |p| on the evaluated skin, with one column per instant and one row per method. All
/// are seen from one place in the array's direction, with one scale of colours. The target is outlined in green. Below
/// each is the relative error of the score at that time, if there is one. The view holds the targets of all instants.
/// If no instant has a target, it holds all of the skin.
///
/// path       where it lands, whole or not at all
/// instants   at least one, with the same methods in the same order
/// throws     InputError if parts of an instant do not fit each other or it has other methods than the first; IoError
///            if it cannot be written
void draw_motion_strip(const std::string& path, const Motion& motion, const std::vector<MotionInstant>& instants,
                       PictureFormat format);

}  // namespace touchfield
