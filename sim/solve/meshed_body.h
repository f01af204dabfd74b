#pragma once

#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/solve/kept_bodies.h"

namespace touchfield {

/// Takes mesh files whose unit is not given, and not surely mm, as in the unit that their size makes likely: for
/// looking at a scene that a run refuses. Landmarks keep their numbers in the file.
///
/// returns  a warning on each
/// throws   InputError if no unit makes the file a body
std::vector<std::string> guess_units(Scene& scene);

/// Refuses a file whose unit is not given and not certain; adds a warning on one that is doubtful.
///
/// throws   InputError
void check_unit(const MeshShape& shape, std::vector<std::string>& warnings);

/// body     of a mesh file
/// throws   InputError if a mesh file is not the closed surface of a body and cannot be resurfaced to one, or its unit is
///          not given and not surely mm
void require_body(const BodySpec& body);

/// The body of a mesh file in its own frame: its faces, mended where they have no area, or resurfaced if the scene asks
/// for it.
///
/// kept    where bodies of files are kept; may be null
/// notes   set to what was done to the file's faces; may be null
/// throws  InputError if it is not the closed surface of a body, cannot be resurfaced to one, or loses a landmark
Body body_from_file(const BodySpec& spec, KeptBodies* kept, std::vector<std::string>* notes = nullptr);

/// A body in its own frame with faces of one size [m], or those of its file.
Body plain_body(const BodySpec& spec, double edge, KeptBodies* kept);

/// A body in its own frame as a scene asks for it.
///
/// edge     null: the faces of its file
/// sizing   of `edge`; not null where that is graded
Body meshed(const BodySpec& spec, const EdgeSpec* edge, const EdgeSizing* sizing, KeptBodies* kept);

/// The landmarks of a body on another mesh of it, without those that lie off it.
std::vector<Landmark> carried_over(const Body& from, const TriangleMesh& to);

HandOptions hand_options(const HandShape& shape, double edge);

/// Length and time of a file: what a mesh made of it follows from.
std::string file_state(const std::string& file);

}  // namespace touchfield
