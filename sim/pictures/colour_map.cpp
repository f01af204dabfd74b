#include "sim/pictures/colour_map.h"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace touchfield {

namespace {

// At 0, 1/32, ... 1.
constexpr std::array<std::array<double, 3>, 33> kViridis = {{
    {0.267, 0.005, 0.329}, {0.277, 0.050, 0.376}, {0.282, 0.095, 0.417}, {0.283, 0.135, 0.453}, {0.279, 0.175, 0.483},
    {0.271, 0.213, 0.507}, {0.259, 0.251, 0.524}, {0.245, 0.287, 0.537}, {0.230, 0.321, 0.545}, {0.215, 0.354, 0.551},
    {0.200, 0.386, 0.555}, {0.186, 0.417, 0.557}, {0.173, 0.447, 0.558}, {0.161, 0.477, 0.558}, {0.150, 0.506, 0.557},
    {0.138, 0.536, 0.555}, {0.128, 0.565, 0.551}, {0.121, 0.594, 0.544}, {0.120, 0.624, 0.534}, {0.131, 0.653, 0.521},
    {0.155, 0.682, 0.503}, {0.193, 0.710, 0.481}, {0.241, 0.737, 0.455}, {0.299, 0.762, 0.423}, {0.363, 0.787, 0.387},
    {0.433, 0.809, 0.345}, {0.508, 0.829, 0.299}, {0.587, 0.847, 0.249}, {0.669, 0.862, 0.195}, {0.753, 0.875, 0.143},
    {0.836, 0.886, 0.102}, {0.917, 0.896, 0.101}, {0.993, 0.906, 0.144},
}};

// At 0, 1/8, ... 1: magma from bright to dark, with the grey of a bare hand in place of its brightest end.
constexpr std::array<std::array<double, 3>, 9> kSkinColours = {{{0.890, 0.890, 0.890},
                                                                {0.985, 0.790, 0.560},
                                                                {0.996, 0.624, 0.427},
                                                                {0.955, 0.441, 0.365},
                                                                {0.860, 0.284, 0.410},
                                                                {0.700, 0.213, 0.476},
                                                                {0.530, 0.157, 0.505},
                                                                {0.370, 0.098, 0.500},
                                                                {0.190, 0.060, 0.400}}};

template <std::size_t N>
Colour interpolated(const std::array<std::array<double, 3>, N>& map, double fraction) {
  if (std::isnan(fraction)) {
    return kNoValue;
  }
  const double at = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(N - 1);
  const auto below = std::min(static_cast<std::size_t>(at), N - 2);
  const double t = at - static_cast<double>(below);
  Colour colour{};
  for (std::size_t c = 0; c < colour.size(); ++c) {
    colour[c] = static_cast<std::uint8_t>(std::lround(255.0 * ((1.0 - t) * map[below][c] + t * map[below + 1][c])));
  }
  return colour;
}

}  // namespace

Colour viridis(double fraction) { return interpolated(kViridis, fraction); }

Colour skin_colour(double fraction) {
  return std::isnan(fraction) ? kNoSkinValue : interpolated(kSkinColours, fraction);
}

}  // namespace touchfield
