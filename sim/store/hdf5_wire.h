#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "sim/core/isolated_work.h"

/// How the content of an HDF5 file goes from the process that reads it to the one that asked, both of one program.
/// Numbers are the machine's own; a text or a list of bytes is its length and its bytes.
///
///   object     kind, then
///     group    attributes, number of links, for each its name and an object
///     dataset  values
///     other    nothing (a type, say)
///   attributes number, for each a name and values
///   values     kind, rank, sizes, bytes: 8-byte doubles or integers, pairs of doubles, or texts one after another
namespace touchfield::hdf5 {

enum class ObjectKind : unsigned char { kGroup, kDataset, kOther };
enum class ValueKind : unsigned char { kFloats, kIntegers, kComplex, kTexts, kOther };

inline constexpr int kDeepestObject = 16;   // groups within groups
inline constexpr int kMostParts = 100'000;  // objects and attributes; a run has a few dozen for each method and field

/// Reads all that a file holds and sends it. Leaves the library without plugins.
/// throws   IoError naming path, place and reason; std::bad_alloc
void send_content(const std::string& path, const Emit& emit);

}  // namespace touchfield::hdf5
