#pragma once

#include <string>
#include <vector>

#include "sim/cameras/simulated_camera.h"
#include "sim/core/progress.h"
#include "sim/mesh/raster/raster.h"
#include "sim/mesh/triangle_mesh.h"
#include "sim/motion/moving_model.h"
#include "sim/run/job.h"

namespace touchfield {

/// What a depth camera said of what it saw.
struct CameraSight {
  std::string label;         // beside it
  Camera camera;             // where it stands
  std::vector<float> depth;  // of its pixels, row by row from the upper left one [m]; 0: none
};

/// A picture of 1200 x 900 pixels with one row per camera. More than three cameras are in two columns. Each camera has
/// two images. The left one is its whole view of the shaded mesh. The right one shows the depths that it measured in
/// the part with the mesh, which a frame marks in the left one.
///
/// One scale of colours serves all. It goes from the nearest to the farthest point of the mesh that a camera sees,
/// rounded outwards to 10 mm. Red marks the pixels where a camera sees the mesh but measured no depth.
///
/// path     where it lands, whole or not at all
/// mesh     what there is [m]
/// sights   1 to 8
/// throws   InputError where a depth image has another size than its camera; IoError if it cannot be written
void draw_sights(const std::string& path, const std::string& title, const std::string& subtitle,
                 const TriangleMesh& mesh, const std::vector<CameraSight>& sights);

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
///   sight.png            the first frame
///   landmarks.csv        the places of a hand's landmarks (hand_tables.h), by which a fit is evaluated; only if the
///                        bodies have such landmarks
///
/// The images do not tell the true places of skin and cameras. Warns of a camera that has no depth of the body at all.
/// Warns also of a camera with a unit so small that 16 bits do not hold the distance of the skin.
///
/// seen     outlives the job
/// throws   (the job) IoError on a failed write
Job<std::vector<SightSummary>> see_job(const SeenScene& seen);

}  // namespace touchfield
