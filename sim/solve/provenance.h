#pragma once

#include <string>

#include "sim/store/run_data.h"

namespace touchfield {

/// Where results that begin now come from: this program, this machine and its processor's kernels, the time. The end is
/// left empty.
Provenance provenance_now(int threads, const std::string& seeds, const std::string& command_line,
                          const std::string& scene_hash);

}  // namespace touchfield
