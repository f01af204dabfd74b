#include "sim/pictures/canvas.h"

#include <algorithm>
#include <cairo-ft.h>
#include <cairo.h>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <span>
#include <stdexcept>

#include <fmt/format.h>

#include "sim/core/png_file.h"
#include "sim/core/version.h"

namespace touchfield {

namespace {

// Red, green and blue at 0, 1/32, ... 1.
constexpr std::array<std::uint32_t, 33> kViridis = {
    0x440154, 0x470d60, 0x48186a, 0x482274, 0x472d7b, 0x453681, 0x424086, 0x3e4989, 0x3b528b, 0x375a8d, 0x33628e,
    0x2f6a8e, 0x2c728e, 0x297a8e, 0x26818e, 0x23898e, 0x21908d, 0x1f978b, 0x1f9f88, 0x21a785, 0x28ae80, 0x31b57b,
    0x3dbc74, 0x4cc26c, 0x5dc963, 0x6ece58, 0x82d34c, 0x96d83f, 0xabdc32, 0xc0df24, 0xd5e21a, 0xeae41a, 0xfde725};

// At 0, 1/8, ... 1: magma from bright to dark, with the grey of a bare hand in place of its brightest end.
constexpr std::array<std::uint32_t, 9> kSkinColours = {0xe3e3e3, 0xfbc98f, 0xfe9f6d, 0xf4705d, 0xdb4869,
                                                       0xb23679, 0x872881, 0x5e1980, 0x300f66};

// At 0, -1/4, ... -1, of suction: viridis from its green on, of the lightness of those above.
constexpr std::array<std::uint32_t, 5> kSuctionColours = {0xe3e3e3, 0x7ad1b2, 0x22a18f, 0x13757c, 0x0b3b52};

template <std::size_t N>
Colour interpolated(const std::array<std::uint32_t, N>& map, double fraction) {
  if (std::isnan(fraction)) {
    return kNoValue;
  }
  const double at = std::clamp(fraction, 0.0, 1.0) * static_cast<double>(N - 1);
  const auto below = std::min(static_cast<std::size_t>(at), N - 2);
  const double t = at - static_cast<double>(below);
  Colour colour{};
  for (std::size_t c = 0; c < colour.size(); ++c) {
    const auto channel = [&](std::size_t i) { return static_cast<double>(map[i] >> (16 - 8 * c) & 0xffU); };
    colour[c] = static_cast<std::uint8_t>((1.0 - t) * channel(below) + t * channel(below + 1) + 0.5);
  }
  return colour;
}

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;

Surface new_surface(cairo_format_t format, int width, int height) {
  return {cairo_image_surface_create(format, width, height), cairo_surface_destroy};
}

/// Of the program's or library's own installation; null where it has none. Kept until the program ends.
cairo_font_face_t* installed_font(const char* name) {
  std::error_code error;
  const auto file = own_binary().parent_path().parent_path() / "share/touchfield/fonts" / name;
  if (!std::filesystem::exists(file, error)) {
    return nullptr;
  }
  FT_Library library = nullptr;
  FT_Face face = nullptr;
  if (FT_Init_FreeType(&library) != 0 || FT_New_Face(library, file.c_str(), 0, &face) != 0) {
    return nullptr;
  }
  return cairo_ft_font_face_create_for_ft_face(face, 0);
}

/// DejaVu Sans, without asking fontconfig where the installation brings it: machines may have no files of fontconfig.
void select_font(cairo_t* draw, bool bold) {
  static cairo_font_face_t* const plain = installed_font("DejaVuSans.ttf");
  static cairo_font_face_t* const heavy = installed_font("DejaVuSans-Bold.ttf");
  if (cairo_font_face_t* const own = bold ? heavy : plain) {
    cairo_set_font_face(draw, own);
  } else {
    cairo_select_font_face(draw, "DejaVu Sans", CAIRO_FONT_SLANT_NORMAL,
                           bold ? CAIRO_FONT_WEIGHT_BOLD : CAIRO_FONT_WEIGHT_NORMAL);
  }
}

/// Lines of the grid's directions lie on whole pixels, so that they are sharp.
double sharp(double at, double width) { return std::lround(width) % 2 == 1 ? std::floor(at) + 0.5 : std::round(at); }

}  // namespace

Colour viridis(double fraction) { return interpolated(kViridis, fraction); }

Colour skin_colour(double fraction) {
  if (std::isnan(fraction)) {
    return kNoSkinValue;
  }
  return fraction < 0.0 ? interpolated(kSuctionColours, -fraction) : interpolated(kSkinColours, fraction);
}

struct Canvas::Sheet {
  Sheet(int columns, int rows)
      : height(rows),
        surface(new_surface(CAIRO_FORMAT_RGB24, columns, rows)),
        context(cairo_create(surface.get()), cairo_destroy) {}

  cairo_t* draw() const { return context.get(); }
  double down(double y) const { return height - y; }
  void set_colour(const Colour& colour) const {
    cairo_set_source_rgb(draw(), colour[0] / 255.0, colour[1] / 255.0, colour[2] / 255.0);
  }
  void set_font(const TextStyle& style) const {
    select_font(draw(), style.bold);
    cairo_set_font_size(draw(), style.size);
  }
  void trace(const std::vector<Eigen::Vector2d>& points) const {
    for (const Eigen::Vector2d& point : points) {
      cairo_line_to(draw(), point.x(), down(point.y()));
    }
  }
  void stroke(const Colour& colour, double line_width) const {
    set_colour(colour);
    cairo_set_line_width(draw(), line_width);
    cairo_stroke(draw());
  }

  int height;
  Surface surface;
  Context context;
  std::map<std::string, std::string> texts;
};

std::string picture_font() {
  const Surface surface = new_surface(CAIRO_FORMAT_A8, 1, 1);
  const Context context(cairo_create(surface.get()), cairo_destroy);
  select_font(context.get(), false);
  cairo_scaled_font_t* font = cairo_get_scaled_font(context.get());
  if (cairo_scaled_font_get_type(font) != CAIRO_FONT_TYPE_FT) {
    return "";
  }
  std::string family;
  if (auto* const face = cairo_ft_scaled_font_lock_face(font)) {
    family = face->family_name != nullptr ? face->family_name : "a font without a name";
    cairo_ft_scaled_font_unlock_face(font);
  }
  return family;
}

Canvas::Canvas(int width, int height) : sheet_(std::make_unique<Sheet>(width, height)) {
  cairo_t* draw = sheet_->draw();
  sheet_->set_colour({255, 255, 255});
  cairo_paint(draw);
  const std::unique_ptr<cairo_font_options_t, decltype(&cairo_font_options_destroy)> options(
      cairo_font_options_create(), cairo_font_options_destroy);
  cairo_font_options_set_antialias(options.get(), CAIRO_ANTIALIAS_GRAY);
  cairo_font_options_set_hint_style(options.get(), CAIRO_HINT_STYLE_NONE);
  cairo_font_options_set_hint_metrics(options.get(), CAIRO_HINT_METRICS_OFF);
  cairo_set_font_options(draw, options.get());
  const BuildInfo build = build_info();
  describe("Software", "touchfield " + build.version);
  describe("Source", build.revision);
}

Canvas::~Canvas() = default;

int Canvas::height() const { return sheet_->height; }

void Canvas::text(double x, double y, const std::string& text, const TextStyle& style) {
  cairo_t* draw = sheet_->draw();
  sheet_->set_font(style);
  sheet_->set_colour(kInk);
  cairo_font_extents_t font;
  cairo_font_extents(draw, &font);
  const double share = style.align == Align::kLeft ? 0.0 : style.align == Align::kCentre ? 0.5 : 1.0;
  cairo_save(draw);
  cairo_translate(draw, x, sheet_->down(y));
  cairo_rotate(draw, -style.angle * std::numbers::pi / 180.0);
  cairo_move_to(draw, -share * text_width(text, style), 0.5 * (font.ascent - font.descent));
  cairo_show_text(draw, text.c_str());
  cairo_restore(draw);
  cairo_new_path(draw);
}

double Canvas::text_width(const std::string& text, const TextStyle& style) {
  sheet_->set_font(style);
  cairo_text_extents_t extents;
  cairo_text_extents(sheet_->draw(), text.c_str(), &extents);
  return extents.x_advance;
}

void Canvas::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to, const Colour& colour, double width) {
  Eigen::Vector2d start(from.x(), sheet_->down(from.y()));
  Eigen::Vector2d end(to.x(), sheet_->down(to.y()));
  for (int axis = 0; axis < 2; ++axis) {
    if (start[axis] == end[axis]) {
      start[axis] = end[axis] = sharp(start[axis], width);
    }
  }
  cairo_set_line_cap(sheet_->draw(), CAIRO_LINE_CAP_BUTT);
  cairo_move_to(sheet_->draw(), start.x(), start.y());
  cairo_line_to(sheet_->draw(), end.x(), end.y());
  sheet_->stroke(colour, width);
}

void Canvas::path(const std::vector<Eigen::Vector2d>& points, const Colour& colour, double width) {
  cairo_set_line_cap(sheet_->draw(), CAIRO_LINE_CAP_ROUND);
  cairo_set_line_join(sheet_->draw(), CAIRO_LINE_JOIN_ROUND);
  sheet_->trace(points);
  sheet_->stroke(colour, width);
}

void Canvas::polygon(const std::vector<Eigen::Vector2d>& corners, const Colour& colour) {
  sheet_->trace(corners);
  sheet_->set_colour(colour);
  cairo_fill(sheet_->draw());
}

void Canvas::frame(const PixelBox& box, const Colour& colour, double width) {
  const double left = sharp(box.x, width);
  const double top = sharp(sheet_->down(box.y + box.height), width);
  cairo_set_line_join(sheet_->draw(), CAIRO_LINE_JOIN_MITER);
  cairo_rectangle(sheet_->draw(), left, top, box.width, box.height);
  sheet_->stroke(colour, width);
}

void Canvas::image(const PixelBox& box, const std::function<Colour(int, int)>& colour) {
  cairo_surface_t* surface = sheet_->surface.get();
  cairo_surface_flush(surface);
  unsigned char* data = cairo_image_surface_get_data(surface);
#pragma omp parallel for schedule(dynamic, 8)
  for (int j = 0; j < box.height; ++j) {
    const std::ptrdiff_t row = sheet_->height - 1 - box.y - j;
    auto* pixel = reinterpret_cast<std::uint32_t*>(data + row * cairo_image_surface_get_stride(surface)) + box.x;
    for (int i = 0; i < box.width; ++i) {
      const Colour of = colour(i, j);
      *pixel++ = static_cast<std::uint32_t>(of[0] << 16 | of[1] << 8 | of[2]);
    }
  }
  cairo_surface_mark_dirty(surface);
}

void Canvas::describe(const std::string& name, const std::string& text) { sheet_->texts[name] = text; }

std::string Canvas::file() {
  if (const cairo_status_t status = cairo_status(sheet_->draw()); status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(fmt::format("a picture cannot be drawn: {}", cairo_status_to_string(status)));
  }
  cairo_surface_t* surface = sheet_->surface.get();
  cairo_surface_flush(surface);
  const int width = cairo_image_surface_get_width(surface);
  std::vector<Colour> pixels;
  for (int row = 0; row < sheet_->height; ++row) {
    const unsigned char* data = cairo_image_surface_get_data(surface) +
                                static_cast<std::ptrdiff_t>(row) * cairo_image_surface_get_stride(surface);
    for (const std::uint32_t value :
         std::span(reinterpret_cast<const std::uint32_t*>(data), static_cast<std::size_t>(width))) {
      pixels.push_back({static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 8),
                        static_cast<std::uint8_t>(value)});
    }
  }
  return png_file(width, sheet_->height, PngPixels::kRgb8, std::as_bytes(std::span(pixels)), sheet_->texts);
}

}  // namespace touchfield
