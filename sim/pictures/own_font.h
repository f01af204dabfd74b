#pragma once

#include <cairo.h>

namespace touchfield {

/// DejaVu Sans from the program's own installation, share/touchfield/fonts/DejaVuSans.ttf or DejaVuSans-Bold.ttf: there
/// fontconfig, which may lack its files on such a machine, is not asked. Kept until the program ends; null where the
/// installation has none.
cairo_font_face_t* own_font(bool bold);

}  // namespace touchfield
