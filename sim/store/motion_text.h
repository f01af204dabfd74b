#pragma once

#include <string>

#include "sim/store/motion_data.h"
#include "sim/store/value_tree.h"

namespace touchfield {

/// motion.csv: a header line and one line per score and method: method, time_s, frame, age_s, dx_mm, dy_mm, dz_mm,
/// displacement_mm, judged_skin, every metric. NaN is written as "nan"; displacements are NaN while the array shows no
/// frame. Whole or not at all.
void write_motion_csv(const std::string& path, const Motion& motion);

/// frames.csv: a header line and one line per frame and method: method, frame, sampled_s, started_s, late_s, shown_s,
/// pose_time_s, quiet (0 or 1), lost (likewise), skin_off_mm, patch_off_mm (SkinOff), target_off_mm, cost (after the
/// last step), steps, status, seconds_STAGE for every stage. Whole or not at all.
void write_frames_csv(const std::string& path, const Motion& motion);

/// Of a part its label, then the methods side by side, one per line: error over the motion, level, displacement and age
/// of what is felt, frames.
std::string motion_table(const Motion& motion);

/// Meshes, array and provenance of a motion; its methods with the columns of their summary; and as text for a person
/// the first, methods with their frames, latencies and stages, and motion_table.
Value motion_value(const Motion& motion);
Value method_values(const Motion& motion);
std::string describe_motion(const Motion& motion);

}  // namespace touchfield
