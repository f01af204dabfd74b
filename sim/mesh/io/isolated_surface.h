#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "sim/core/isolated_work.h"
#include "sim/mesh/io/mesh_files.h"

namespace touchfield {

/// Numbers as the process that reads a surface hands them over.
template <class T>
void send_numbers(const Emit& emit, const T* values, std::size_t count) {
  emit({reinterpret_cast<const char*>(values), count * sizeof(T)});
}
inline void send_number(const Emit& emit, std::int64_t value) { send_numbers(emit, &value, 1); }

/// A surface that a library reads in a process of its own (isolated_work.h): such libraries crash on damaged files.
///
/// content   of the file; the more bytes, the more memory and time the process may take
/// send      sends, in this order: the number of points and their coordinates as doubles; the number of polygons and
///           for each of them the number of its corners and these; the same of triangle strips (see add_strip)
/// throws    InputError that send throws, or if the process ends otherwise, or what comes is no surface within the
///           limits of mesh_files.h
FileSurface isolated_surface(const std::string& content, const std::string& name,
                             const std::function<void(const Emit&)>& send);

}  // namespace touchfield
