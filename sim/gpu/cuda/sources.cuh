#pragma once

#include "sim/gpu/cuda/context.cuh"
#include "sim/gpu/cuda/source_pressure.cuh"

namespace touchfield::cuda {

/// The channels of a TransducerArray on the card.
class Sources {
 public:
  /// In a medium with wavenumber k + i alpha [1/m]; of a plane wave positions are not read and may be null.
  ///
  /// throws   std::invalid_argument on a directivity with too many intervals
  Sources(Context& context, double k, double alpha, const GpuSources& given);

  int size() const { return static_cast<int>(channel_.size()); }  // N

  /// The incident matrix G, as incident_matrix has it, or with directions (3 x J unit vectors; else null) dG along
  /// them; computed in double.
  ///
  /// points   3 x J [m], on the card, none on a transducer
  /// out      J x N cuComplex or cuDoubleComplex on the card
  template <typename Out>
  void incident(const double* points, const double* directions, int count, Out* out) const;

 private:
  Context& context_;
  ChannelWave wave_;
  Array<Channel> channel_{context_};
};

}  // namespace touchfield::cuda
