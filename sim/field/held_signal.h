#pragma once

#include <vector>

#include <Eigen/Core>

namespace touchfield {

/// Frequencies from `low` up to, not including, `high` [Hz].
struct FrequencyBand {
  double low;
  double high;
};

/// Where receptors of their own respond: about Merkel cells, Meissner and, in two parts, Pacinian corpuscles.
///
/// source   Gescheider, Bolanowski, Hardick, Somatosens. Mot. Res. 18 (2001) 191
inline constexpr FrequencyBand kTouchBands[] = {{5, 15}, {15, 60}, {60, 200}, {200, 500}};

/// One line of the spectrum of a periodic signal.
struct SpectralLine {
  double hz;
  double mean_square;  // that it adds to the signal's
};

/// The Fourier series of a signal that holds each of its F values for 1/rate and then repeats:
///
///   c_m = sinc(m/F) exp(-i pi m/F) / F sum_k x_k exp(-2 pi i m k/F),   line m: 2 |c_m|^2 at m rate/F
///
/// Lines above 0 and up to `highest`. Nothing is windowed: the series is exact.
///
/// values    x, F, at least 1
/// rate      [1/s]
/// highest   [Hz]
std::vector<SpectralLine> lines_of_held(const Eigen::VectorXd& values, double rate, double highest);

/// Sum of the lines in a band.
double mean_square_in(const std::vector<SpectralLine>& lines, const FrequencyBand& band);

}  // namespace touchfield
