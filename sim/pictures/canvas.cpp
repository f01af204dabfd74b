#include "sim/pictures/canvas.h"

#include <algorithm>
#include <cairo-ft.h>
#include <cairo-pdf.h>
#include <cairo-svg.h>
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

// At 0, -1/4, ... -1, of suction: viridis from its green on, of the lightness of those above.
constexpr std::array<std::array<double, 3>, 5> kSuctionColours = {{{0.890, 0.890, 0.890},
                                                                   {0.478, 0.821, 0.700},
                                                                   {0.135, 0.630, 0.560},
                                                                   {0.164, 0.422, 0.558},
                                                                   {0.160, 0.160, 0.420}}};

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
  if (std::isnan(fraction)) {
    return kNoSkinValue;
  }
  return fraction < 0.0 ? interpolated(kSuctionColours, -fraction) : interpolated(kSkinColours, fraction);
}

namespace {

using Surface = std::unique_ptr<cairo_surface_t, decltype(&cairo_surface_destroy)>;
using Context = std::unique_ptr<cairo_t, decltype(&cairo_destroy)>;
using Texts = std::map<std::string, std::string>;

constexpr double kPoints = 0.5;  // of a PDF, a pixel

Surface surface_of(cairo_surface_t* surface) { return {surface, cairo_surface_destroy}; }

cairo_status_t append(void* bytes, const unsigned char* data, unsigned int size) {
  static_cast<std::string*>(bytes)->append(reinterpret_cast<const char*>(data), size);
  return CAIRO_STATUS_SUCCESS;
}

Surface new_surface(int width, int height, PictureFormat format, std::string& bytes) {
  if (format == PictureFormat::kPdf) {
    return surface_of(cairo_pdf_surface_create_for_stream(append, &bytes, kPoints * width, kPoints * height));
  }
  if (format == PictureFormat::kSvg) {
    Surface surface = surface_of(cairo_svg_surface_create_for_stream(append, &bytes, width, height));
    cairo_svg_surface_set_document_unit(surface.get(), CAIRO_SVG_UNIT_PX);
    return surface;
  }
  return surface_of(cairo_image_surface_create(CAIRO_FORMAT_RGB24, width, height));
}

void require_success(cairo_status_t status) {
  if (status != CAIRO_STATUS_SUCCESS) {
    throw std::runtime_error(fmt::format("a picture cannot be drawn: {}", cairo_status_to_string(status)));
  }
}

/// A copy of the image in Cairo's own form.
Surface image_surface(const ColourImage& image) {
  Surface surface = surface_of(cairo_image_surface_create(CAIRO_FORMAT_RGB24, image.width, image.height));
  require_success(cairo_surface_status(surface.get()));
  unsigned char* data = cairo_image_surface_get_data(surface.get());
  const int stride = cairo_image_surface_get_stride(surface.get());
  for (int row = 0; row < image.height; ++row) {
    auto* pixel = reinterpret_cast<std::uint32_t*>(data + static_cast<std::ptrdiff_t>(row) * stride);
    for (int column = 0; column < image.width; ++column) {
      const Colour& colour = image.at(column, row);
      *pixel++ = static_cast<std::uint32_t>(colour[0] << 16 | colour[1] << 8 | colour[2]);
    }
  }
  cairo_surface_mark_dirty(surface.get());
  return surface;
}

ColourImage copy_of(cairo_surface_t* surface) {
  ColourImage image(cairo_image_surface_get_width(surface), cairo_image_surface_get_height(surface));
  const unsigned char* data = cairo_image_surface_get_data(surface);
  const int stride = cairo_image_surface_get_stride(surface);
  for (int row = 0; row < image.height; ++row) {
    const auto* pixel = reinterpret_cast<const std::uint32_t*>(data + static_cast<std::ptrdiff_t>(row) * stride);
    for (int column = 0; column < image.width; ++column) {
      const std::uint32_t value = *pixel++;
      image.at(column, row) = {static_cast<std::uint8_t>(value >> 16), static_cast<std::uint8_t>(value >> 8),
                               static_cast<std::uint8_t>(value)};
    }
  }
  return image;
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

struct Canvas::Sheet {
  Sheet(int columns, int rows, PictureFormat kind)
      : width(columns),
        height(rows),
        format(kind),
        surface(new_surface(columns, rows, kind, bytes)),
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
  void paint(const PixelBox& box, const ColourImage& image, cairo_filter_t filter) const {
    const Surface source = image_surface(image);
    cairo_save(draw());
    cairo_rectangle(draw(), box.x, down(box.y + box.height), box.width, box.height);
    cairo_clip(draw());
    cairo_translate(draw(), box.x, down(box.y + box.height));
    cairo_scale(draw(), static_cast<double>(box.width) / image.width, static_cast<double>(box.height) / image.height);
    cairo_set_source_surface(draw(), source.get(), 0.0, 0.0);
    cairo_pattern_set_filter(cairo_get_source(draw()), filter);
    cairo_pattern_set_extend(cairo_get_source(draw()), CAIRO_EXTEND_PAD);  // no pale rim
    cairo_paint(draw());
    cairo_restore(draw());
  }

  int width;
  int height;
  PictureFormat format;
  std::string bytes;  // of a PDF or SVG
  Surface surface;
  Context context;
  Texts texts;
};

std::string picture_font() {
  const Surface surface = surface_of(cairo_image_surface_create(CAIRO_FORMAT_A8, 1, 1));
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

Canvas::Canvas(int width, int height, PictureFormat format) : sheet_(std::make_unique<Sheet>(width, height, format)) {
  cairo_t* draw = sheet_->draw();
  if (format == PictureFormat::kPdf) {
    cairo_scale(draw, kPoints, kPoints);
  }
  sheet_->set_colour({255, 255, 255});
  cairo_paint(draw);
  // The same shapes and widths in every format.
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

PictureFormat Canvas::format() const { return sheet_->format; }

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
  ColourImage image(box.width, box.height);
  for (int row = 0; row < box.height; ++row) {
    for (int column = 0; column < box.width; ++column) {
      image.at(column, row) = colour(column, box.height - 1 - row);
    }
  }
  sheet_->paint(box, image, CAIRO_FILTER_NEAREST);
}

void Canvas::image(const PixelBox& box, const ColourImage& image) { sheet_->paint(box, image, CAIRO_FILTER_GOOD); }

void Canvas::describe(const std::string& name, const std::string& text) { sheet_->texts[name] = text; }

std::string Canvas::file() {
  require_success(cairo_status(sheet_->draw()));
  if (sheet_->format == PictureFormat::kPng) {
    cairo_surface_flush(sheet_->surface.get());
    const ColourImage image = copy_of(sheet_->surface.get());
    return png_file(image.width, image.height, PngPixels::kRgb8, std::as_bytes(std::span(image.pixels)), sheet_->texts);
  }
  sheet_->context.reset();
  cairo_surface_finish(sheet_->surface.get());
  require_success(cairo_surface_status(sheet_->surface.get()));
  return sheet_->bytes;
}

}  // namespace touchfield
