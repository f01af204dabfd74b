#pragma once

#include <span>
#include <string_view>

namespace touchfield {

/// A scene that comes with the program: a file of the folder scenes.
struct ShippedScene {
  std::string_view name;  // of the file, without .yaml
  std::string_view text;
};

/// All of them, by name.
std::span<const ShippedScene> shipped_scenes();

/// The one of a name; null if there is none.
const ShippedScene* shipped_scene(std::string_view name);

}  // namespace touchfield
