#pragma once

namespace touchfield {

/// True if an X display answers and has an OpenGL configuration that VTK can use.
bool display_answers();

}  // namespace touchfield
