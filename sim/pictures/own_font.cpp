#include "sim/pictures/own_font.h"

#include <cairo-ft.h>
#include <filesystem>

namespace touchfield {

namespace {

cairo_font_face_t* load(const char* name) {
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  const auto file = program.parent_path().parent_path() / "share/touchfield/fonts" / name;
  if (!std::filesystem::exists(file, error)) {
    return nullptr;
  }
  static FT_Library library = [] {
    FT_Library made = nullptr;
    FT_Init_FreeType(&made);
    return made;
  }();
  FT_Face face = nullptr;
  if (library == nullptr || FT_New_Face(library, file.c_str(), 0, &face) != 0) {
    return nullptr;
  }
  return cairo_ft_font_face_create_for_ft_face(face, 0);
}

}  // namespace

cairo_font_face_t* own_font(bool bold) {
  static cairo_font_face_t* const plain = load("DejaVuSans.ttf");
  static cairo_font_face_t* const heavy = load("DejaVuSans-Bold.ttf");
  return bold ? heavy : plain;
}

}  // namespace touchfield
