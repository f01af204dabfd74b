#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/json.h"
#include "sim/mesh/io/unit_guess.h"
#include "sim/mesh/remesh/closed_mesh.h"
#include "sim/mesh/remesh/resurface.h"

namespace touchfield {

/// What `mesh` found and did.
struct MeshText {
  std::string file;
  LengthUnit unit;
  bool unit_stated;
  UnitGuess guess;
  double size;  // [file units]
  std::vector<std::string> warnings;
  SurfaceReport report;            // of the file's surface
  std::vector<std::string> steps;  // that made the result
  std::optional<SkinReport> result;
  std::string written;                           // file and unit; empty: none
  std::optional<SurfaceDistance> to_resurfaced;  // from the file's outer faces to the new skin, if it was resurfaced
  std::optional<SurfaceDistance> from_resurfaced;
};

/// "surely", "likely", ... as a report says it.
const char* certainty_text(UnitCertainty certainty);

Json mesh_value(const MeshText& text);

}  // namespace touchfield
