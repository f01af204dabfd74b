#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "sim/mesh/triangle_mesh.h"
#include "sim/pictures/colour_map.h"
#include "sim/pictures/skin_view.h"

namespace touchfield {

enum class Align { kLeft, kCentre, kRight };

struct TextStyle {
  int size = 18;  // [pixels]
  Align align = Align::kLeft;
  bool bold = false;
  double angle = 0.0;  // counter-clockwise, about its own middle [deg]
};

/// A white picture that is drawn off screen by VTK. Needs can_draw(). Positions are pixels from the lower left corner.
/// Its file names the program that drew it in the PNG texts Software and Source (its revision).
class Canvas {
 public:
  Canvas(int width, int height);
  Canvas(const Canvas&) = delete;
  Canvas& operator=(const Canvas&) = delete;
  ~Canvas();

  /// Text with its middle height at y.
  void text(double x, double y, const std::string& text, const TextStyle& style);
  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Colour& colour, double width);
  /// A filled convex polygon.
  void polygon(const std::vector<Eigen::Vector2d>& corners, const Colour& colour);
  void frame(const PixelBox& box, const Colour& colour, double width);
  /// Fills a box pixel by pixel; colour(i, j) for column i and row j of the box, from its lower left corner.
  void image(const PixelBox& box, const std::function<Colour(int, int)>& colour);
  /// A mesh in a panel, one colour a face. Faces that are seen head-on have exactly their colour; slanted ones are
  /// shaded down to 70 % of it. `edges` are 2 x E vertices, drawn as lines on the skin.
  void surface(const SkinView& view, const TriangleMesh& mesh, const std::vector<Colour>& colours,
               const Eigen::Matrix2Xi& edges, const Colour& edge_colour);

  /// A text that the PNG file carries beside its pixels, in place of an older one of this name.
  void describe(const std::string& name, const std::string& text);

  /// The picture as a PNG file.
  std::string png();

 private:
  struct Scene;
  std::unique_ptr<Scene> scene_;
};

}  // namespace touchfield
