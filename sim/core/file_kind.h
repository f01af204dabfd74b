#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace touchfield {

/// The kind of bytes that stand where a text or a mesh should, by how they begin, with the remedy. It knows a Git LFS
/// pointer, an HTML page, a packed file, a PDF, an image, HDF5, UTF-16 or UTF-32 text. Nothing for any other bytes.
///
/// returns   e.g. "a Git LFS pointer, not the file itself: run git lfs pull"
std::optional<std::string> foreign_kind(std::string_view bytes);

/// ": it is KIND" to follow "no HDF5 file" and the like; empty if it is nothing that is known.
std::string and_what_it_is(std::string_view bytes);

/// throws   InputError "path: this is KIND" on what foreign_kind() knows
void refuse_foreign(std::string_view bytes, const std::string& path);

}  // namespace touchfield
