#pragma once

#include <string>
#include <vector>

#include "sim/solve/model.h"

namespace touchfield {

/// The names of all files that a run of a scene may write into its directory.
std::vector<std::string> run_files(const Model& model);

/// The same of a study.
std::vector<std::string> study_files();

}  // namespace touchfield
