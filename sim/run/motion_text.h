#pragma once

#include <string>

#include "sim/core/json.h"
#include "sim/run/motion_data.h"

namespace touchfield {

/// motion.csv: a header line and one line per score and method: method, time_s, frame, age_s, dx_mm, dy_mm, dz_mm,
/// displacement_mm, every metric. NaN is written as "nan"; displacements are NaN while the array shows no
/// frame. Whole or not at all.
void write_motion_csv(const std::string& path, const Motion& motion);

/// frames.csv: a header line and one line per frame and method. Whole or not at all. Its columns:
///
///   method, frame, sampled_s, started_s, late_s, shown_s, pose_time_s
///   silent, lost                   0 or 1
///   skin_off_mm, patch_off_mm     SkinOff
///   target_off_mm
///   cost                          after the last step
///   steps, status
///   seconds_STAGE                 for every stage
void write_frames_csv(const std::string& path, const Motion& motion);

/// The methods side by side, one per line: error over the motion, level, displacement and age of what is felt, frames.
/// If the scores are of a part of the body, its label comes first.
std::string motion_table(const Motion& motion);

/// motion_value has the meshes, array and provenance of a motion, method_values its methods with the columns of their
/// summary. describe_motion is text for a person. It has the former, the methods with their frames, latencies and
/// stages, and motion_table.
Json motion_value(const Motion& motion);
Json method_values(const Motion& motion);
std::string describe_motion(const Motion& motion);

}  // namespace touchfield
