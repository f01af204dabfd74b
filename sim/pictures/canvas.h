#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

#include "sim/pictures/colour_image.h"
#include "sim/pictures/picture_format.h"
#include "sim/pictures/skin_view.h"

namespace touchfield {

enum class Align { kLeft, kCentre, kRight };

struct TextStyle {
  double size = 16;  // [pixels]
  Align align = Align::kLeft;
  bool bold = false;
  double angle = 0.0;  // counter-clockwise, about its own middle [deg]
};

/// The family of the font that texts have; empty where there is none, and Cairo's own strokes stand in.
std::string picture_font();

/// A white picture, drawn by Cairo. Positions are pixels from the lower left corner; of PDF and SVG a pixel is half a
/// point and a CSS pixel. A PNG file names the program that drew it: see describe().
class Canvas {
 public:
  Canvas(int width, int height, PictureFormat format);
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  ~Canvas();

  PictureFormat format() const;

  /// Text with its middle height at y.
  void text(double x, double y, const std::string& text, const TextStyle& style);
  /// How wide a text is [pixels].
  double text_width(const std::string& text, const TextStyle& style);
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Colour& colour, double width);
  /// Straight from point to point, with round joints and ends.
  void path(const std::vector<Eigen::Vector2d>& points, const Colour& colour, double width);
  /// Filled.
  void polygon(const std::vector<Eigen::Vector2d>& corners, const Colour& colour);
  void frame(const PixelBox& box, const Colour& colour, double width);
  /// Fills a box pixel by pixel; colour(i, j) for column i and row j of the box, from its lower left corner.
  void image(const PixelBox& box, const std::function<Colour(int, int)>& colour);
  /// An image that fills a box; smooth between its pixels where the picture is enlarged.
  void image(const PixelBox& box, const ColourImage& image);

  /// A text that a PNG file carries beside what it shows, in place of an older one of this name. Without it Software
  /// and Source are of this program.
  void describe(const std::string& name, const std::string& text);

  /// The finished picture as a file's bytes; nothing can be drawn after it.
  /// throws   std::runtime_error with Cairo's reason
  std::string file();

 private:
  struct Sheet;
  std::unique_ptr<Sheet> sheet_;
};

}  // namespace touchfield
