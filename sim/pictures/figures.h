#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/pictures/picture_parts.h"
#include "sim/run/felt.h"
#include "sim/run/motion_data.h"
#include "sim/run/run_data.h"

namespace touchfield {

/// True if exactly one axis of the grid has one point.
bool is_plane(const FieldGrid& grid);

/// A plane in panels: one half of the picture for |p| and one for its level, with one panel per method in each. A pixel
/// has the colour of the grid point that is nearest to it.
struct PlaneView {
  int horizontal;  // axis: 0, 1 or 2
  int vertical;
  int normal;
  std::array<PanelGrid, 2> grids;  // |p|, level
};

/// The plane as large as it fits; x to the right if the plane has an x, z up if it has a z.
PlaneView plane_view(const FieldGrid& grid, int methods);

/// A picture of |p| in a plane of a run by all methods: from 0 to the 99.5th percentile of each, and from -40 to 0 dB
/// of the largest of these. Points inside a body are grey. It has axes in mm, the target's border in the plane and the
/// transducers in it.
std::string field_picture(const Run& run, const FieldResult& field);

/// The run with the evaluation's skin and pressures for its own, where there are some: what its metrics are of.
Run as_evaluated(Run run);

/// Whether a run has a skin to draw: a target, or the pressure of a method.
bool has_overview(const Run& run);

/// Draws the pictures of a run:
///
/// overview.png     the skin, as wanted and by all methods (overview_picture)
/// field_NAME.png   one picture per plane among the fields, with all methods (field_picture)
///
/// The texts in each file say which run it shows: Software, Source, Description, Scene hash (see Canvas::describe). A
/// file appears whole or not at all.
///
/// directory   where they land
/// returns     the files written
/// throws      IoError if a picture cannot be written
std::vector<std::string> draw_figures(const std::string& directory, const Run& run);

/// One of them by its name without the ending, e.g. "overview": the bytes of its file.
/// throws      InputError that lists the names there are
std::string draw_figure(const std::string& name, const Run& run);

/// A plot over the time of the motion with three panels, one below the other. They show relative_error [%],
/// displacement since the sample [mm] and mean |p| inside the target [Pa]. Each has one line per method through its
/// scores. Lines break where a value was not computed.
///
/// path     where it lands, whole or not at all
/// returns  false if no score has any of the three; nothing is written then
/// throws   InputError if parts of the motion do not fit each other; IoError if it cannot be written
bool draw_motion(const std::string& path, const Motion& motion);

/// A strip of |p| on the evaluated skin, with one column per instant and one row per method. All are seen from one
/// place in the array's direction, with one scale of colours. The target is outlined in green. Above each is the
/// relative error of the score at that time, if there is one. The view holds the targets of all instants. If no instant
/// has a target, it holds all of the skin.
///
/// returns   PNG of six of the motion's instants (some_instants); empty if it has none, or no method
/// throws    InputError if parts of an instant do not fit each other or it has other methods than the first
std::string motion_strip(const Motion& motion);

/// Flat maps of the skin, seen from outside, with one row for each of the first six methods. Columns show the radiation
/// pressure, and the displacement on the soft, middle and stiff skin. The last shows the strain energy at the Pacinian
/// depth on the middle skin. A column has one scale of colours, whose end is at most twice the median of the
/// methods (of the energy four times). A line goes round the part above half of a map's largest value. Below one method
/// alone are panels with the displacement at the points over the frequency, one per skin.
///
/// returns   a file's bytes
std::string felt_picture(const Felt& felt);

}  // namespace touchfield
