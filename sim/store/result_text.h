#pragma once

#include <string>
#include <vector>

#include "sim/store/run_data.h"

/// Lines that descriptions of runs and motions share.
namespace touchfield {

/// A share as "12.34 %"; "-" where nothing was computed.
std::string percent_text(double fraction);

/// Text within XML or HTML.
std::string markup_text(const std::string& text);

/// extent_label as a line; empty if there is none.
std::string label_line(SkinExtent extent);

std::string array_line(const TransducerArray& array);

/// Faces, vertices, area and mean edge length, without a word in front.
std::string mesh_size_text(const TriangleMesh& mesh);

std::string provenance_text(const Provenance& provenance);

/// Warnings and notes, a line each.
std::string remarks_text(const std::vector<std::string>& warnings, const std::vector<std::string>& notes);

}  // namespace touchfield
