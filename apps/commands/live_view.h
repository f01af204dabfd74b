#pragma once

#include <chrono>
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <nlohmann/json.hpp>

#include "hardware/player.h"
#include "sim/core/json.h"
#include "sim/motion/live.h"
#include "sim/view/view_data.h"
#include "sim/view/view_server.h"

namespace touchfield {

/// The page of a live loop: the skin as the solver saw it with the pressure of the newest frame, and how loop and link
/// do. The loop leaves its newest frame; all that is said of it is made by the server's thread.
class LiveView {
 public:
  /// port     as ViewServer takes it
  /// throws   InputError as ViewServer
  explicit LiveView(int port);

  std::string address() const { return "http://127.0.0.1:" + std::to_string(server_.port()); }
  /// Whether somebody looks on and the skin before was wanted long enough ago. For the solver's thread.
  bool wants_skin();

  /// From now on the page is served.
  ///
  /// loop    outlives this, or its end
  /// name    of the scene
  /// first   the frame before the clock starts
  /// emits   whether there is a device
  void begin(const LiveLoop& loop, const std::string& name, const MethodSpec& method, const LiveSolution& first,
             bool emits);
  /// What FrameStream::told is told; `sounds` also says whether the link's last frame does.
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
  using Clock = std::chrono::steady_clock;

  std::optional<std::string> next(const LiveLoop& loop);
  /// The ends of the colours are of the first skin on which something is wanted.
  void scale_colours(const ViewSkin& skin);

  const std::string id_;  // tells this loop's page from one of an earlier loop
  Clock::time_point wanted_{};
  LatestSlot<Played> played_;
  double per_square_ = 0;  // of ViewData
  Json tops_;
  bool scaled_ = false;
  // What was told last, and when:
  std::optional<std::size_t> frame_;  // numbers
  std::optional<std::size_t> skin_;
  std::shared_ptr<const Played> played_told_;
  Clock::time_point told_{};
  ViewServer server_;  // the last: its thread uses what is above
};

}  // namespace touchfield
