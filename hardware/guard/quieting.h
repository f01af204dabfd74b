#pragma once

#include <string>

#include "hardware/array_link.h"

namespace touchfield {

/// How the last that was asked of a device went.
struct Quieting {
  bool quiet = false;
  std::string text;  // "the array is quiet after 3 ms", or why it is not
};

/// Quiets an open device, asks it whether it is, where it can tell, and lets go of it.
Quieting quiet_and_let_go(ArrayLink& link);

/// "; the array may still be on: switch off its supply": said wherever nobody can tell.
inline constexpr const char* kMayBeOn = "; the array may still be on: switch off its supply";

}  // namespace touchfield
