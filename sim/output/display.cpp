#include "sim/output/display.h"

#include <GL/glx.h>
#include <X11/Xlib.h>
#include <memory>

namespace touchfield {

// VTK ends the program where it finds no display or no usable OpenGL on it, so both are asked for first, in the way VTK
// is going to.
bool display_answers() {
  const std::unique_ptr<Display, int (*)(Display*)> display(XOpenDisplay(nullptr), XCloseDisplay);
  if (!display || glXQueryExtension(display.get(), nullptr, nullptr) == False) {
    return false;
  }
  const int wanted[] = {GLX_DRAWABLE_TYPE,
                        GLX_WINDOW_BIT,
                        GLX_RENDER_TYPE,
                        GLX_RGBA_BIT,
                        GLX_RED_SIZE,
                        1,
                        GLX_GREEN_SIZE,
                        1,
                        GLX_BLUE_SIZE,
                        1,
                        GLX_DEPTH_SIZE,
                        1,
                        None};
  int count = 0;
  const std::unique_ptr<GLXFBConfig, int (*)(void*)> configurations(
      glXChooseFBConfig(display.get(), DefaultScreen(display.get()), wanted, &count), XFree);
  return configurations && count > 0;
}

}  // namespace touchfield
