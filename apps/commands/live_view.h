#pragma once

#include <optional>
#include <string>

#include "hardware/player.h"
#include "sim/jobs/play_scene.h"
#include "sim/motion/live.h"
#include "sim/view/view_server.h"

namespace touchfield {

/// The page of a live loop: the skin as the solver saw it with the pressure of the newest frame, and how loop and link
/// do. The loop leaves its newest frame; all that is said of it is made by the server's thread.
class LiveView {
 public:
  /// port     as ViewServer takes it
  /// throws   InputError as ViewServer
  explicit LiveView(int port) : server_(port) {}

  std::string address() const { return "http://127.0.0.1:" + std::to_string(server_.port()); }
  bool watched() const { return server_.watched(); }

  /// From now on the page is served.
  ///
  /// loop, sensed   outlive this, or its end
  /// first          the frame before the clock starts
  /// emits          whether there is a device
  void begin(const LiveLoop& loop, const SensedMotion& sensed, const MethodSpec& method, const LiveSolution& first,
             bool emits);
  /// What FrameStream::told is told.
  void played(const PlayReport& so_far, bool sounds, double age) {
    played_.put(std::make_shared<const Played>(Played{so_far, sounds, age}));
  }
  void end(const std::string& why) { server_.end(why); }

 private:
  struct Played {
    PlayReport so_far;
    bool sounds;
    double age;
  };
  std::optional<std::string> next(const LiveLoop& loop, const SensedMotion& sensed, const MethodSpec& method);

  LatestSlot<Played> played_;
  std::optional<std::size_t> told_;  // number of a frame
  ViewServer server_;                // the last: its thread uses what is above
};

}  // namespace touchfield
