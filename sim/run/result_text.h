#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/core/json.h"
#include "sim/run/run_data.h"

/// What descriptions of runs and motions share.
namespace touchfield {

/// A share as "12.34 %"; "-" where nothing was computed.
std::string percent_text(double fraction);

/// Text within XML or HTML.
std::string markup_text(const std::string& text);

std::string array_text(const TransducerArray& array);

Json mesh_size(const TriangleMesh& mesh);
Json provenance_value(const Provenance& provenance);
Json stage_values(const std::vector<std::pair<std::string, double>>& stages);

}  // namespace touchfield
