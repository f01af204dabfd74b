#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <string>

#include "sim/core/types.h"

namespace touchfield {

static_assert(std::endian::native == std::endian::little,
              "binary files are read and written as the numbers lie in memory");

/// Appends a number, or a vector's components as such numbers, as little-endian bytes.
template <class Number>
void append_bytes(std::string& bytes, Number value) {
  const auto* first = reinterpret_cast<const char*>(&value);
  bytes.append(first, sizeof value);
}

template <class Number>
void append_bytes(std::string& bytes, const Vector3& vector) {
  for (const double component : vector) {
    append_bytes(bytes, static_cast<Number>(component));
  }
}

/// The number whose bytes begin at a place.
template <class Number>
Number number_at(const char* at, bool big_endian) {
  std::array<char, sizeof(Number)> bytes;
  std::copy_n(at, bytes.size(), bytes.begin());
  if (big_endian) {
    std::reverse(bytes.begin(), bytes.end());
  }
  return std::bit_cast<Number>(bytes);
}

}  // namespace touchfield
