#pragma once

#include <string>
#include <vector>

#include "sim/batch/sweep.h"

namespace touchfield {

/// A sweep file as it was read, whole: its plan and the scenes of all its cases.
struct SweepInput {
  SweepPlan plan;
  std::vector<Scene> scenes;
  SweepIdentity identity;
  std::vector<std::string> warnings{};  // of open_sweep: what an earlier version meant
};

/// overrides   as of read_sweep
/// throws      InputError as read_sweep, read_cases and require_named_files
SweepInput read_sweep_input(const std::string& path, const std::vector<std::string>& overrides, Shard shard = {});

/// Opens the directory of a sweep. Where an earlier version began it, the scenes get what their texts meant then: the
/// other hand, `beyond: nothing`, the former judge. Warnings say so.
///
/// throws   InputError as SweepDirectory::open
SweepDirectory open_sweep(SweepInput& input, const std::string& path, bool resume);

/// A card to each worker where the scenes leave open which computes; one job a card where they all ask for the first.
void share_cards(const std::vector<Scene>& scenes, SweepOptions& options);

}  // namespace touchfield
