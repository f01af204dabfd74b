#pragma once

#include "sim/core/errors.h"
#include "sim/gpu/gpu.h"

namespace touchfield {

/// Carries out work of a card's.
///
/// throws   DeviceError where the card fails; GpuMemoryFailure where it has no room, which callers answer by asking for
///          less
template <typename Work>
auto on_card(const Work& work) {
  try {
    return work();
  } catch (const GpuMemoryFailure&) {
    throw;
  } catch (const GpuFailure& failure) {
    throw DeviceError(failure.what());
  }
}

}  // namespace touchfield
