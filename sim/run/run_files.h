#pragma once

#include <string>
#include <vector>

#include "sim/run/model.h"

namespace touchfield {

/// The names of all files that a run of a scene may write into its directory.
std::vector<std::string> run_files(const Scene& scene, const Model& model);

/// The same of a study.
std::vector<std::string> study_files();

}  // namespace touchfield
