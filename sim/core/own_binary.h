#pragma once

#include <filesystem>

namespace touchfield {

/// The file that this very code is in: libtouchfield.so in a program of another's, otherwise the program. What is
/// installed with it is found from there.
std::filesystem::path own_binary();

}  // namespace touchfield
