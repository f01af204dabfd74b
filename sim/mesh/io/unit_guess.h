#pragma once

#include <array>
#include <optional>
#include <string>

#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

/// A unit that a mesh file's coordinates may be in.
struct LengthUnit {
  const char* name;
  double metres;
  int power;  // metres = 10^power
};
inline constexpr std::array<LengthUnit, 3> kFileUnits = {{{"mm", 1e-3, -3}, {"cm", 1e-2, -2}, {"m", 1.0, 0}}};

/// "metres": the unit's name in a sentence.
std::string unit_in_words(const LengthUnit& unit);

/// A length [m] with three digits: "193 mm", "12.5 m".
std::string length_text(double metres);

/// The file unit of this name.
/// throws   InputError that lists the names
const LengthUnit& file_unit(const std::string& name);

/// About the diameter of the points that triangles name [file units]: the largest distance from the point that is
/// farthest from their mean. At least half the diameter, whatever the pose; 0 without a triangle.
double surface_size(const FileSurface& surface);

/// A body's least and largest size [m]: a tenth of a hair, a room.
inline constexpr double kLeastBody = 1e-5;
inline constexpr double kMostBody = 10.0;

/// Refuses what is not the size of any body, before work that grows with it.
///
/// size     surface_size() in metres
/// throws   InputError "name: ..." on a size out of kLeastBody to kMostBody
void require_body_size(double size, const std::string& name);

/// How far a guess of a file's unit can be trusted.
enum class UnitCertainty {
  kSure,     // the one unit in which the body is as large as a hand, and in the others it is none a hand could touch
  kUnclear,  // a body that a hand could touch, but no hand, or in another unit such a body too
  kNone,     // in no unit as large as a fingertip to an arm
};

struct UnitGuess {
  LengthUnit unit;
  UnitCertainty certainty;
  std::string reason;  // the size in each unit and what a hand's is
};

/// Millimetres where they make a body of 0.01 m (a fingertip) to 1 m (an arm), since most files are in mm. Otherwise
/// the unit in which the body is nearest to a hand. A hand measures 0.12 to 0.56 m from the end of the wrist or the
/// forearm to the longest fingertip, in any pose.
///
/// size     surface_size() [file units], > 0
/// throws   InputError if it is not > 0 and finite
UnitGuess guess_unit(double size);

/// Why a file's unit is in doubt in a scene.
struct UnitDoubt {
  bool refuse;       // a run must not continue: no unit is stated, and it is not surely mm; or the one stated is a slip
  std::string text;  // one line
};

/// The doubt that `check` and `run` report about a mesh file's unit. A stated unit is accepted unless the body is then
/// smaller than a fingertip or larger than an arm. It is a slip if the body is then below 1 mm or above kMostBody, and
/// another unit makes it a body. It is also a slip if another unit surely makes it a hand. Without a stated unit the
/// file counts as in mm only if that is sure.
///
/// size      surface_size() [file units]
/// stated    name of the unit that the scene gives, if it gives one
/// returns   nothing if there is no doubt
std::optional<UnitDoubt> unit_doubt(double size, const std::optional<std::string>& stated);

}  // namespace touchfield
