#pragma once

#include "sim/gpu/cuda/context.cuh"
#include "sim/gpu/cuda/source_pressure.cuh"

namespace touchfield::cuda {

/// The channels of a TransducerArray on the card.
class Sources {
 public:
  /// positions, axes   3 x N, unit vectors; of a plane wave positions are not read and may be null
  /// response          N factors, null: 1
  Sources(Context& context, const ChannelWave& wave, int count, const double* positions, const double* axes,
          const double* amplitudes, const std::complex<double>* response);

  int size() const { return count_; }  // N

  /// The incident matrix G, as incident_matrix has it, or with directions (3 x J unit vectors; else null) dG along them;
  /// computed in double.
  ///
  /// points   3 x J [m], on the card, none on a transducer
  /// out      J x N on the card
  void incident(const double* points, const double* directions, int count, cuComplex* out) const;
  void incident(const double* points, const double* directions, int count, cuDoubleComplex* out) const;

 private:
  Context& context_;
  ChannelWave wave_;
  int count_;
  Array<Channel> channel_;
};

}  // namespace touchfield::cuda
