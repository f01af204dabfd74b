#pragma once

#include <cstdint>
#include <string>

#include "sim/core/isolated_work.h"

/// How the content of an HDF5 file gets from the process that reads it to the one that asked, both of one program. It
/// is sent part by part, a group before its content. Each part is sent as its kind, place, rank, sizes and bytes.
/// Numbers are the machine's own. A place, a text and the bytes of a part have their length before them.
namespace touchfield::hdf5 {

enum class PartKind : unsigned char {
  kFloats,    // doubles
  kIntegers,  // of 8 bytes
  kComplex,   // pairs of doubles
  kTexts,     // one after another
  kGroup,     // the names in it, as texts
  kOther,     // no bytes: a type, or values that no run has
};

inline constexpr int kDeepestGroup = 16;    // groups within groups
inline constexpr int kMostParts = 100'000;  // objects and attributes; a run has a few dozen for each method and field

/// Reads all that a file holds and sends it. Leaves the library without plugins.
/// throws   IoError naming path, place and reason; std::bad_alloc
void send_content(const std::string& path, const Emit& emit);

}  // namespace touchfield::hdf5
