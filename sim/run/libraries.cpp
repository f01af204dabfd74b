#include "sim/run/libraries.h"

#include <zlib.h>

#include <Eigen/Core>
#include <fmt/format.h>
#include <hdf5.h>
#include <vtkVersion.h>

namespace touchfield {

std::vector<std::pair<std::string, std::string>> library_versions() {
  unsigned major = 0;
  unsigned minor = 0;
  unsigned release = 0;
  H5get_libversion(&major, &minor, &release);
  return {{"HDF5", fmt::format("{}.{}.{}", major, minor, release)},
          {"VTK", vtkVersion::GetVTKVersion()},
          {"zlib", zlibVersion()},
          {"Eigen", fmt::format("{}.{}.{}", EIGEN_WORLD_VERSION, EIGEN_MAJOR_VERSION, EIGEN_MINOR_VERSION)}};
}

}  // namespace touchfield
