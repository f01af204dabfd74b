#pragma once

#include <memory>

namespace touchfield {

/// A connection to the X display, held while pictures are drawn: a virtual display starts anew when its last client
/// leaves, and would be away for a moment just when VTK looks for it.
class DisplayConnection {
 public:
  /// Tries for two seconds if DISPLAY is set, since a display that starts anew refuses connections meanwhile.
  DisplayConnection();
  ~DisplayConnection();
  DisplayConnection(const DisplayConnection&) = delete;
  DisplayConnection& operator=(const DisplayConnection&) = delete;

  /// True if the display answers and has an OpenGL configuration that VTK can use. VTK ends the program where it finds
  /// none, so ask first.
  bool can_draw() const;

  /// throws   NotBuiltError unless can_draw()
  void require() const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace touchfield
