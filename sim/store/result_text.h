#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/store/run_data.h"
#include "sim/store/value_tree.h"

/// What descriptions of runs and motions share.
namespace touchfield {

/// A share as "12.34 %"; "-" where nothing was computed.
std::string percent_text(double fraction);

/// Text within XML or HTML.
std::string markup_text(const std::string& text);

/// extent_label as a line; empty if there is none.
std::string label_line(SkinExtent extent);

std::string array_text(const TransducerArray& array);

Value mesh_size(const TriangleMesh& mesh);
Value provenance_value(const Provenance& provenance);
Value stage_values(const std::vector<std::pair<std::string, double>>& stages);

}  // namespace touchfield
