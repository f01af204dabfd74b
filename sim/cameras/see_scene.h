#pragma once

#include <string>
#include <vector>

#include "sim/cameras/simulated_camera.h"
#include "sim/core/progress.h"
#include "sim/motion/whole_skin.h"
#include "sim/pictures/picture_format.h"
#include "sim/run/run_directory.h"

namespace touchfield {

/// A scene that moves before simulated cameras.
struct SeenScene {
  MovingModel moving;
  WholeSkin skin;
  SimulatedCameras cameras;
  std::vector<std::string> models;  // of the cameras
  int frames;                       // at k / motion.sensor.hz seconds, k = 0, 1, ..., before the motion's end
};

/// throws   InputError as MovingModel; unless the scene has motion.sensor.cameras; where there are more frames than a
///          folder of images holds, 10,000
///
/// progress   hears of what takes its time; may be null
SeenScene seen_scene(const Scene& scene, Progress* progress = nullptr);

/// The names of all files that see_scene writes.
std::vector<std::string> sight_files(const SeenScene& seen, PictureFormat format);

/// What a camera saw of a motion.
struct SightSummary {
  std::string camera;
  double pixels = 0;   // with depth, a frame
  double holes = 0;    // share of the pixels that see skin and have no depth
  double nearest = 0;  // depth of the skin that it sees [m]
  double farthest = 0;
  double beyond = 0;  // share of the pixels that see skin and whose depth is beyond kMostUnits
};

/// Writes the images that the cameras of a scene take of its whole motion:
///
///   a folder of images   (CameraFolderWriter)
///   sight.FORMAT         the first frame
///   landmarks.csv        the places of a hand's landmarks (landmark_table.h), by which a fit is evaluated; only if the
///                        bodies have such landmarks
///
/// The images do not tell the true places of skin and cameras. Warns of a camera that has no depth of the body at all.
/// Warns also of a camera with a unit so small that 16 bits do not hold the distance of the skin.
///
/// throws   IoError on a failed write
std::vector<SightSummary> see_scene(const SeenScene& seen, RunDirectory& directory, PictureFormat format,
                                    Progress& progress);

}  // namespace touchfield
