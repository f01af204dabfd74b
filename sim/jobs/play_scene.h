#pragma once

#include <optional>
#include <string>
#include <vector>

#include "sim/core/progress.h"
#include "sim/jobs/sensed_motion.h"
#include "sim/motion/play.h"
#include "sim/pictures/picture_format.h"
#include "sim/run/run_directory.h"

namespace touchfield {

/// The names of all files that a motion may write into its directory, pictures in the format asked for beside the
/// scene.
std::vector<std::string> motion_files(const SensedMotion& sensed, std::optional<PictureFormat> asked = std::nullopt);

/// Plays a motion (play_motion) and writes its results. motion.h5, motion.csv and frames.csv are written again after
/// every second of the motion, so that a kill leaves the last whole ones. The evaluated skin is a ParaView series of
/// about 20 frames per second at most. The pictures are a plot over time and a strip.
///
/// options     their functions are this one's own
/// directory   where the files land
/// pictures    their format, and that there are some whatever the scene says; without it PNG if the scene asks for them
/// returns     the finished motion
/// throws      as play_motion; IoError on a failed write
Motion play_scene(const SensedMotion& sensed, MotionOptions options, RunDirectory& directory, Progress& progress,
                  std::optional<PictureFormat> pictures = std::nullopt);

}  // namespace touchfield
