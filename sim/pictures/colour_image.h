#pragma once

#include <cstddef>
#include <vector>

#include "sim/pictures/colour_map.h"

namespace touchfield {

/// Pixels row by row from the upper left one.
struct ColourImage {
  int width = 0;
  int height = 0;
  std::vector<Colour> pixels;

  ColourImage(int columns, int rows)
      : width(columns), height(rows), pixels(static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows)) {}

  Colour& at(int column, int row) { return pixels[index(column, row)]; }
  const Colour& at(int column, int row) const { return pixels[index(column, row)]; }

 private:
  std::size_t index(int column, int row) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(width) + static_cast<std::size_t>(column);
  }
};

}  // namespace touchfield
