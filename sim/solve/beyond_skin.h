#pragma once

#include <optional>

#include "sim/acoustics/transducer_array.h"
#include "sim/mesh/query/skin_patches.h"
#include "sim/solve/bodies.h"

namespace touchfield {

/// The skin that keep_within leaves to its incident pressure.
struct BeyondSkin {
  SkinPatches patches;
  double shadowed = 0;  // share of their area that other bodies hide from more than half of the array
};

/// The skin of bodies beyond keep_within, where it is `incident` there: what no face of the solving mesh with skin = 1
/// covers. Patches are at most 0.9 wavelengths apart, and at least `per_drive` times as many as there are drives that
/// span what all channels do to that skin (expected_drives): with fewer than one the phases send sound between them.
///
/// bodies      of Extent::kSolved
/// per_drive   kPatchesOfStills or kPatchesOfFrames
/// count       of patches; none: as said
BeyondSkin beyond_skin(const Scene& scene, const PlacedBodies& bodies, const TransducerArray& array, double wavelength,
                       double per_drive, std::optional<Eigen::Index> count = std::nullopt);

}  // namespace touchfield
