#pragma once

#include <string>

#include "sim/run/kept_models.h"

namespace touchfield {

struct SolveOptions {
  std::string command_line;      // kept as provenance
  int threads = 1;               // likewise; the caller has set them
  KeptBodies* bodies = nullptr;  // meshes and models of scenes before this one
  KeptModels* models = nullptr;
};

}  // namespace touchfield
