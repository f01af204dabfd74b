#include "sim/pictures/display.h"

#include <GL/glx.h>
#include <X11/Xlib.h>
#include <chrono>
#include <cstdlib>
#include <memory>
#include <thread>

#include "sim/core/errors.h"

namespace touchfield {

struct DisplayConnection::Implementation {
  std::unique_ptr<Display, int (*)(Display*)> display{nullptr, XCloseDisplay};
};

DisplayConnection::DisplayConnection() : implementation_(std::make_unique<Implementation>()) {
  constexpr int kTries = 20;
  constexpr std::chrono::milliseconds kPause(100);
  const char* name = std::getenv("DISPLAY");
  if (name == nullptr || *name == '\0') {
    return;
  }
  for (int i = 0; i < kTries && !implementation_->display; ++i) {
    if (i > 0) {
      std::this_thread::sleep_for(kPause);
    }
    implementation_->display.reset(XOpenDisplay(nullptr));
  }
}

DisplayConnection::~DisplayConnection() = default;

bool DisplayConnection::can_draw() const {
  Display* display = implementation_->display.get();
  if (display == nullptr || glXQueryExtension(display, nullptr, nullptr) == False) {
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
      glXChooseFBConfig(display, DefaultScreen(display), wanted, &count), XFree);
  return configurations && count > 0;
}

void DisplayConnection::require() const {
  if (!can_draw()) {
    throw NotBuiltError("pictures need an X display with OpenGL (scripts/with_display, or xvfb-run -a)");
  }
}

}  // namespace touchfield
