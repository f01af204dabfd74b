#pragma once

#include <array>
#include <string>

#include "sim/core/units.h"
#include "sim/store/run_data.h"

namespace touchfield {

/// How a scan really was taken, where its file does not say. A point x of the file was measured at
///
///   middle + place + R(turn) size (x - middle)        R: rotations about the fixed x, then y, then z axis
///
/// middle     the mean of the points of the file
/// receiver   radius of the microphone's opening, a disc that lies in the file's plane z = const and turns along. It
///            reads the mean of the pressure over the disc; of a point at radius 0
/// sound_speed_ratio   true speed of sound over that of the run. Pressures on the skin remain those of the run.
enum ScanValue { kPlaceX, kPlaceY, kPlaceZ, kTurnX, kTurnY, kTurnZ, kSize, kReceiver, kSoundSpeed, kScanValues };
using ScanSetting = Eigen::Matrix<double, kScanValues, 1>;  // [m], [rad], 1, [m], 1

/// What there is to know of a value.
struct ScanValueInfo {
  const char* name;   // in files and results, with its unit
  const char* group;  // by which a fit asks for it
  double unit;        // of the name, in SI units
  double low;         // in that unit
  double high;        // in that unit
  double step;        // a change that a scan shows, in SI units
};
inline constexpr std::array<ScanValueInfo, kScanValues> kScanValueInfo = {{
    {"x_mm", "place", kMillimetre, -1e4, 1e4, 1e-3},
    {"y_mm", "place", kMillimetre, -1e4, 1e4, 1e-3},
    {"z_mm", "place", kMillimetre, -1e4, 1e4, 1e-3},
    {"rx_deg", "turn", kDegree, -360, 360, 0.02},
    {"ry_deg", "turn", kDegree, -360, 360, 0.02},
    {"rz_deg", "turn", kDegree, -360, 360, 0.02},
    {"size", "size", 1.0, 0.1, 10, 0.01},
    {"receiver_mm", "receiver", kMillimetre, 0, 50, 1e-3},
    {"sound_speed_ratio", "sound_speed", 1.0, 0.5, 2, 0.005},
}};

/// The file is right: no shift, no turn, size 1, a microphone of radius 0, the run's speed of sound.
ScanSetting unchanged_scan();

/// A table with a header and one row, columns named as above. What is missing is as in unchanged_scan().
///
/// throws   InputError that names every fault as file:line: what, rule; IoError if it cannot be written
ScanSetting read_scan_setting(const std::string& path);
void write_scan_setting(const std::string& path, const ScanSetting& setting);

/// Where the points of a scan with this middle lay [m].
Points placed_points(const Points& points, const Vector3& middle, const ScanSetting& setting);

/// The readings of the microphone at such points of the field of the only method of a run. A reading is run_field's
/// pressure or, with a radius, its mean over the disc by 7 places. For a plane wave at an angle theta this mean is
/// 2 J1(x)/x, x = k radius sin(theta), within 0.01 up to x = 2.5.
Eigen::VectorXcd scan_reading(const Run& run, const Wave& wave, const Points& placed, const ScanSetting& setting);

/// The readings there of each channel at unit drive, without any scattering: incident_matrix, averaged likewise.
/// returns   J x N [Pa]
Eigen::MatrixXcd channel_readings(const TransducerArray& array, const Wave& wave, const Points& placed,
                                  const ScanSetting& setting);

}  // namespace touchfield
