#pragma once

#include <memory>

#include "sim/gpu/cuda/context.cuh"
#include "solvers/phase/phase_device.h"

namespace touchfield::cuda {

/// H_T (faces x channels) and R (rank x channels), column by column without gaps, of the host or of the card, which are
/// copied.
///
/// memory   (faces + rank) x channels numbers of 16 bytes, 8 more where annealed starts are asked for, 12 for each entry of
///          J and 12 for each of its normal matrix; twice that of the latter where steps in double are needed
std::unique_ptr<SkinDevice> make_skin_device(Context& context, const cuDoubleComplex* target, int faces,
                                             const cuDoubleComplex* quiet, int rank, int channels);

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
