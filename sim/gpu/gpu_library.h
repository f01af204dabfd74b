#pragma once

#include <memory>
#include <string>
#include <vector>

#include "sim/gpu/compute_device.h"
#include "sim/gpu/gpu.h"

namespace touchfield {

/// libtouchfield_gpu.so as TOUCHFIELD_GPU_LIBRARY names it, otherwise beside own_binary(), beside its folder
/// (../lib), or where an installation puts it (../lib/touchfield, or of the architecture). Loaded at the first call,
/// which takes a second.
struct GpuLibrary {
  int cards = 0;
  std::string why_none;  // where there is no card: one line that says what is missing
};
const GpuLibrary& gpu_library();

/// The cards as CUDA_VISIBLE_DEVICES names them, for processes that are to have one each; empty where there is one at
/// most.
std::vector<std::string> separate_cards();

/// throws   NotBuiltError where there is no such card, InputError where what open_gpu reads is no number above 0
void require_card(const ComputeDevice& choice);

/// The card of that number, opened once and kept while the program runs: its start takes a second.
std::shared_ptr<Gpu> shared_gpu(int index);

/// Opens a card. TOUCHFIELD_GPU_MEMORY_MB caps the memory that it takes, for cards that are shared;
/// TOUCHFIELD_GPU_FAIL_AFTER has the call of that number fail, for tests.
///
/// throws   as require_card does; DeviceError where it cannot be opened
std::shared_ptr<Gpu> open_gpu(int index, GpuLimits limits = {});

}  // namespace touchfield
