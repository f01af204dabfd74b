#pragma once

#include <memory>

#include "sim/gpu/cuda/context.cuh"
#include "solvers/phase/phase_device.h"

namespace touchfield::cuda {

/// Q (size x size, Hermitian).
std::unique_ptr<GramDevice> make_gram_device(Context& context, Array<cuDoubleComplex> q, int size);

/// The paper's problem on the card: C = diag(sqrt w) [B_T diag(p'), -G], rows x (targets + channels).
struct PaperMatrices {
  int rows = 0, targets = 0, channels = 0;
  const cuComplex* columns = nullptr;  // B_T, rows x targets, on the card
  const cuComplex* g = nullptr;        // G, rows x channels, on the card
  const double* amplitudes = nullptr;  // p', targets, of the host
  const double* weights = nullptr;     // w, rows, of the host
};

/// Q = C^H C, formed in single precision without TF32. Takes C beside it while it works.
Array<cuDoubleComplex> paper_gram(Context& context, const PaperMatrices& matrices);

}  // namespace touchfield::cuda
