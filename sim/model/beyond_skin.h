#pragma once

#include <optional>

#include "sim/acoustics/transducer_array.h"
#include "sim/mesh/query/skin_patches.h"
#include "sim/model/bodies.h"

namespace touchfield {

/// The skin that keep_within leaves to its incident pressure.
struct BeyondSkin {
  SkinPatches patches;
  double shadowed = 0;  // share of their area that other bodies hide from more than half of the array
};

/// The skin of bodies beyond keep_within: what no face of the solving mesh with skin = 1 covers. Patches are at most
/// 0.9 wavelengths apart. There are also at least `per_drive` patches for each drive that is needed to span what all
/// channels do to that skin (expected_drives). With fewer than one, the phases send sound between the patches.
///
/// bodies      of Extent::kSolved
/// per_drive   kPatchesOfStills or kPatchesOfFrames
/// count       of patches; none: as said
BeyondSkin beyond_skin(const Scene& scene, const PlacedBodies& bodies, const TransducerArray& array, double wavelength,
                       double per_drive, std::optional<Eigen::Index> count = std::nullopt);

}  // namespace touchfield
