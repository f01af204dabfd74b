#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/field/skin_problems.h"
#include "sim/run/skin_scattering.h"

namespace touchfield {

/// What the channels make of the skin, reduced for the phase methods, and how it was obtained.
struct Transfer {
  SkinReduction reduction;
  double outside_weight = 0;     // w_Z
  bool by_reciprocity = false;   // K rows by transposed solves; else r drives that span all channels, forwards
  Eigen::Index solves = 0;       // right-hand sides that were solved for
  double channels_left_out = 0;  // share, by norm, of b of all channels that the drives leave out
  Eigen::MatrixXcd rows{};       // of H, at the faces that were asked for besides the target's
};

/// What drives that span the channels make of a body.
struct SpannedPressure {
  Eigen::MatrixXcd drives;    // V, N x r, orthonormal columns
  Eigen::MatrixXcd pressure;  // P, M x r [Pa]
  double left_out = 0;        // share, by norm, of b of all channels that V leaves out
};

/// Of drives that are given, whose field is summed in the solver's precision. Those of this very body: by
/// make_transfer.
SpannedPressure spanned_pressure(SkinScattering& scattering, const Eigen::MatrixXcd& drives);

/// What make_transfer does, on a graphics card, of drives that are found there, or given: P stays there but for what H
/// needs. With given ones, as frames have, rows of skin beyond are not reduced. Nothing on the processor.
std::optional<Transfer> make_transfer_on_card(SkinScattering& scattering,
                                              const std::shared_ptr<const Eigen::MatrixXcd>& drives,
                                              const Target& target, const OutsideSkin& outside, double outside_weight,
                                              const std::vector<Eigen::Index>& more = {});

/// Solves for H in the cheaper way:
///
///   forwards       b of all channels is compressed to r drives V, P = pressures of V, H = P V^H: all of H, r solves
///   by reciprocity rows of H at the target alone, K solves with B^T; no outside rows
///
/// outside_weight   w_Z; at 0 the skin outside the target is not needed, and the way with fewer solves is taken
/// more           faces whose rows of H are wanted too
/// accuracy       V leaves out 1e-4 of b, the outside rows eigenvalues below 1e-8 of the largest
///            the skin beyond is reduced with the skin outside the target by the same limit
Transfer make_transfer(SkinScattering& scattering, const Target& target, const OutsideSkin& outside,
                       double outside_weight, const std::vector<Eigen::Index>& more = {});

/// H of any target of the body that the pressures are of, forwards.
///
/// reduce   whether rows of skin beyond are reduced with the others, which takes longer than a few steps of a method
///          with all of them, or stand behind them
Transfer make_transfer(const SpannedPressure& spanned, const SkinScattering& scattering, const Target& target,
                       const OutsideSkin& outside, double outside_weight, bool reduce = false,
                       const std::vector<Eigen::Index>& more = {});

/// H of a mesh, p = H q, M x N [Pa]: the pressure of every channel at full drive on every face, in the forward way.
/// Rows of some faces alone take less: SkinScattering::transfer_rows.
///
/// mesh       closed, normals outwards
/// memory     about four times that of H while it is made
/// accuracy   that of the scheme and the solver's tolerance; V leaves out 1e-4 of b
/// throws     NumericalError if a solve misses its tolerance or a pressure is not finite
Eigen::MatrixXcd transfer_matrix(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                                 Scheme scheme = kDefaultScheme, const SolverSpec& spec = {});
Eigen::MatrixXcd transfer_matrix(const TriangleMesh& mesh, const Wave& wave, const TransducerArray& array,
                                 Scheme scheme, const SolverSpec& spec, Progress& progress);

/// One line: the way, solves, ranks and what was left out.
std::string describe_transfer(const Transfer& transfer, Eigen::Index channels);

}  // namespace touchfield
