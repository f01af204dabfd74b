#include "hardware/guard/quieting.h"

#include <fmt/format.h>

#include "hardware/guard/vigil.h"

namespace touchfield {

Quieting quiet_and_let_go(ArrayLink& link) {
  const double start = steady_now();
  Quieting done;
  try {
    link.quiet();
    const std::optional<DriveFrame> state = link.read_back();
    done.quiet = !state || level_of(*state, link.abilities().steps) == 0;
    done.text = fmt::format("{} after {:.0f} ms",
                            !done.quiet ? "the array says that it is still on"
                            : state     ? "the array is quiet, as it says itself,"
                                        : "the array is quiet",
                            (steady_now() - start) * 1e3);
  } catch (const std::exception& error) {
    done.text = fmt::format("the array could not be quieted: {}", error.what());
  }
  link.close();
  return done;
}

}  // namespace touchfield
