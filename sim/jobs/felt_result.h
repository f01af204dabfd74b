#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/run/archive_file.h"
#include "sim/run/felt.h"
#include "sim/run/job.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// What the skin does under a result: a run.h5 or pattern.h5.
///
/// file        of the result
/// overrides   "felt.key=value"
/// warn        of a file without its checksum line
/// throws      InputError if another key than those of felt is overridden, or as felt_of and the readers
Felt felt_of_file(const std::string& file, const std::vector<std::string>& overrides, const Warn& warn);

std::vector<std::string> felt_files(const WriteSpec& write);

/// felt.csv, felt_spectrum.csv and, as far as the scene writes such files, felt.h5, felt.vtp, felt.png and felt.html.
///
/// against   whose first method, or reference, the others are compared with; none: felt itself
void write_felt(const Felt& felt, const std::optional<Felt>& against, const WriteSpec& write,
                const RunDirectory& directory);

/// What a scene with `felt` asks for besides: write_felt of a result that is finished, whose warnings grow by its own.
/// If it cannot be computed, the warning felt_failed says why; the result stands.
///
/// result   Run or Motion
template <class Result>
void add_felt(Result& result, const Scene& scene, const RunDirectory& directory, Progress& progress);

/// Every method on every skin, with dB relative to the reference.
Json felt_value(const Felt& felt, const std::optional<Felt>& against, const std::string& directory);
/// The same as tables for people.
std::string felt_text(const Felt& felt, const std::optional<Felt>& against);

/// The job of `touchfield felt`.
/// throws   InputError if both have not the same skins, or an unknown reference
Job<Felt> felt_job(Felt felt, std::optional<Felt> against, const WriteSpec& write);

}  // namespace touchfield
