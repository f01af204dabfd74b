#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include <Eigen/Core>

namespace touchfield {

using Colour = std::array<std::uint8_t, 3>;  // red, green, blue

/// Viridis: perceptually uniform, dark blue at 0 to yellow at 1; outside that range its ends, grey for NaN. Within
/// 2/255 of the published map.
///
/// source   N. Smith, S. van der Walt, E. Firing: every eighth of its 256 published colours
Colour viridis(double fraction);

/// For pressure on the skin: light grey at 0 (bare skin), then orange and red to dark violet at 1, each darker than the
/// last. Suction is green to dark blue at -1. Outside that range the ends are used, and blue for NaN.
///
/// source   after magma by N. Smith and S. van der Walt, reversed; suction after viridis
Colour skin_colour(double fraction);

inline constexpr Colour kNoSkinValue = {110, 175, 220};
inline constexpr Colour kInk = {25, 25, 25};
inline constexpr Colour kPaper = {255, 255, 255};
inline constexpr Colour kNoValue = {150, 150, 150};

/// A rectangle of a picture [pixels]; x to the right, y up, from the lower left corner.
struct PixelBox {
  int x;
  int y;
  int width;
  int height;
};

enum class Align { kLeft, kCentre, kRight };

struct TextStyle {
  double size = 16;  // [pixels]
  Align align = Align::kLeft;
  bool bold = false;
  double angle = 0.0;  // counter-clockwise, about its own middle [deg]
};

/// The family of the font that texts have; empty where there is none, and Cairo's own strokes stand in.
std::string picture_font();

/// A white picture, drawn by Cairo. Positions are pixels from the lower left corner. Its file names the program that
/// drew it: see describe().
class Canvas {
 public:
  Canvas(int width, int height);
  ~Canvas();

  int height() const;

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
  /// Fills a box of the picture pixel by pixel, in parallel; colour(i, j) for column i and row j of it, from its lower
  /// left corner.
  void image(const PixelBox& box, const std::function<Colour(int, int)>& colour);
  /// A text that the file carries beside what it shows, in place of an older one of this name. Without it Software and
  /// Source are of this program.
  void describe(const std::string& name, const std::string& text);

  /// The finished picture as the bytes of a PNG file; nothing can be drawn after it.
  /// throws   std::runtime_error with Cairo's reason
  std::string file();

 private:
  struct Sheet;
  std::unique_ptr<Sheet> sheet_;
};

}  // namespace touchfield
