#pragma once

#include <string>

#include "sim/run/archive_file.h"
#include "sim/run/felt.h"

namespace touchfield {

inline constexpr ArchiveFormat kFeltArchive = {"felt", 1};

/// Names of touch channels and receptors as files spell them: p, ra; sa1, ra, pc.
std::string channel_name(TouchChannel channel);
inline constexpr std::array<const char*, kReceptorDepths.size()> kReceptorNames = {"sa1", "ra", "pc"};

/// felt.h5: maps and spectra of every method on every skin; docs/felt.md describes it. Whole or not at all.
///
/// throws   IoError naming the path and the system's reason
void write_felt_file(const std::string& path, const Felt& felt);

}  // namespace touchfield
