#pragma once

#include <array>
#include <string>
#include <vector>

#include "sim/cameras/camera_folder.h"
#include "sim/cameras/hand_tracker.h"
#include "sim/field/metrics.h"
#include "sim/run/job.h"
#include "sim/scene/scene.h"

namespace touchfield {

/// How a hand is fitted to recorded images.
struct FolderFit {
  HandShape hand{.forearm = 0};      // before its shape is learnt; cameras need not see as much of a forearm
  bool any_pose = false;             // index_up or flat, whichever is closer, instead of the hand's own
  bool any_side = false;             // right or left, whichever is closer, instead of the hand's own
  double edge = 3e-3;                // of the meshes that are written [m]
  std::array<Vector3, 2> workspace;  // corners of the box that it is looked for in [m]
  double learning = 1;  // its shape is learnt from the first part so long in which it is found [s]; 0: it is as it is
};

struct FittedFrame {
  HandFit fit;
  double milliseconds = 0;             // that it took, images at hand
  std::string file;                    // its mesh; empty where the hand was lost
  double landmark_off = kNotComputed;  // of the recording's landmarks, the farthest from where the fit has it [m]
};

struct FittedFolder {
  HandShape hand;  // that was fitted, before its shape was learnt
  std::vector<std::string> warnings;
  bool learnt = false;  // the hand's shape
  HandProportions proportions = HandProportions::Zero();
  std::vector<FittedFrame> frames;
};

/// Fits the built-in hand to every frame of a recording, in order, and writes the files that
/// `body: {meshes: {folder, times}}` takes:
///
///   skin_0001.ply, ...   the same triangles [m] for each frame, except frames in which the hand is lost. Every face
///                        has `cameras`, the number of cameras that saw it, and `distance_m` from the points that they
///                        saw (seen_skin.h)
///   times.csv            the times of the meshes, counted from the first frame of the recording
///   body.yaml            a scene's body of these meshes with the landmarks of the hand
///   landmarks.csv        the landmarks of the fitted hand (hand_tables.h)
///   fit.csv              one line per frame, with the times of the recording and the reason why the hand is lost
///
/// If the work ends early, the tables hold the frames until then. If the hand is found in no frame, only fit.csv of
/// these is written.
///
/// Warns of oddities in the recording (CameraFolder::warnings), of a shape that was not learnt, and of a side that the
/// other side comes close to. Warns also of a large residual, and of a camera that sees too little skin where the fit
/// has it.
///
/// folder   outlives the job
/// throws   (the job) InputError as HandTemplate and CameraFolder::frame, or if the hand is in no frame. The message
///          then says that the images show the other hand, or what the nearest frame lacks and what each camera sees.
///          IoError
Job<FittedFolder> fit_job(const CameraFolder& folder, const FolderFit& how);

}  // namespace touchfield
