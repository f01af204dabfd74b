#pragma once

#include <array>
#include <cmath>
#include <string>

#include <gtest/gtest.h>
#include <vtkImageData.h>
#include <vtkNew.h>
#include <vtkPNGReader.h>

#include "sim/pictures/canvas.h"

/// What the tests of pictures share.
namespace touchfield {
inline namespace support {

// A pixel in the middle of a face that is seen head-on has the face's own colour up to rounding.
constexpr int kColourTolerance = 2;

/// A PNG file. Pixels count from the lower left corner.
class Picture {
 public:
  explicit Picture(const std::string& path) {
    reader_->SetFileName(path.c_str());
    reader_->Update();
  }
  int width() const { return reader_->GetOutput()->GetDimensions()[0]; }
  int height() const { return reader_->GetOutput()->GetDimensions()[1]; }
  Colour at(int x, int y) const {
    const auto* p = static_cast<const unsigned char*>(reader_->GetOutput()->GetScalarPointer(x, y, 0));
    return {p[0], p[1], p[2]};
  }
  /// The text that the file carries under a name; "(none)" or "(several)" where that is not one.
  std::string text(const char* name) const {
    std::array<int, 2> range{};
    reader_->GetTextChunks(name, range.data());
    const int count = range[1] - range[0];
    return count == 1 ? reader_->GetTextValue(range[0]) : count == 0 ? "(none)" : "(several)";
  }
  Colour at(const Eigen::Vector2d& pixel) const {
    return at(static_cast<int>(std::floor(pixel.x())), static_cast<int>(std::floor(pixel.y())));
  }

 private:
  vtkNew<vtkPNGReader> reader_;
};

inline bool has_colour(const Colour& found, const Colour& expected) {
  bool same = true;
  for (std::size_t c = 0; c < found.size(); ++c) {
    same = same && std::abs(found[c] - expected[c]) <= kColourTolerance;
  }
  return same;
}

inline void expect_colour(const Colour& found, const Colour& expected) {
  for (std::size_t c = 0; c < found.size(); ++c) {
    EXPECT_NEAR(found[c], expected[c], kColourTolerance) << "channel " << c;
  }
}

}  // namespace support
}  // namespace touchfield
