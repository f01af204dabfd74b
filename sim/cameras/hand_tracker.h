#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "sim/cameras/deformation.h"
#include "sim/cameras/hand_search.h"
#include "sim/cameras/hand_template.h"
#include "sim/cameras/pose_fit.h"
#include "sim/cameras/seen_skin.h"
#include "sim/core/units.h"

namespace touchfield {

/// What is expected of a hand's shape before it is seen, and how it is learnt.
struct LearningOptions {
  double size = 0.08;         // deviation of length and breadth, as a ratio
  double part = 0.05;         // of the thickness of the palm and of digits, and of the digits' lengths
  double offset = 1.5e-3;     // of the offset along the normals [m]
  double roughness = 0.1e-3;  // of the offset's difference from its mean round a vertex [m]
  int rounds = 8;             // for proportions and poses together
  int offset_rounds = 3;      // for the offset and then the poses
};

/// Most hands of other people reach it, and few other things do: forearms and empty gloves (docs/cameras.md).
inline constexpr double kUsualBelief = 0.5;

struct FitOptions {
  PointOptions points{.most = 900};
  LearningOptions learning{};
  int rounds = 3;               // of the pose, each frame
  double node_spacing = 12e-3;  // of the deformation graph [m]; 0: the skin follows its skeleton alone
  DeformationPriors deformation{.rigid = 20.0, .rest = 2.0, .before = 2.0};
  double belief = kUsualBelief;  // least probability of a fit that is believed
};

/// A hand as it was fitted to one frame. Where it is lost, what was fitted best is not to be believed: lost_text() says
/// why.
struct HandFit {
  double seconds = 0;
  bool lost = true;
  bool placed = false;               // something was fitted; if not, nothing below the points holds
  std::vector<int> points;           // that each camera saw where the hand is looked for
  std::vector<int> confirmed;        // vertices that each camera saw where the fit has them
  Eigen::Index near = 0;             // points near the skin, of which `explained` is
  int digits_off = 0;                // digits whose ends the images do not show where they are fitted
  double probability = 0;            // that it is right, by scripts/hand_belief
  double required = 0;               // probability of a fit that is believed
  double residual = 0;               // rms distance of the matched points from the skin, robustly weighted [m]
  double explained = 0;              // share of the points near the hand's skin that lie on it
  std::vector<double> explained_by;  // the same of each camera's points; NaN if it has none there
  double noise = 0;                  // what the residual would be of the points' noise alone [m]
  double misfit = 0;                 // rms distance of the matched points besides their noise, relative to 1.5 mm, or
                                     // to twice that of the frames in which the shape was learnt
  double oddity = 0;                 // of the proportions
  double share = 0;                  // of what was seen where the skin is, the share that is the skin
  double evidence = 0;               // of the skin that should be seen, the share that is
  double seen = 0;                   // share of the template's area that a camera saw where the fit has it
  double seen_area = 0;              // [m2]
  HandState state{};
  Points deformation;           // 3 x N shifts of the graph's nodes (DeformationGraph::shifts); empty for none
  Eigen::VectorXd seen_vertex;  // of the template: 1 seen, 0 not

  /// How much of a hand it explains [m2].
  double explained_area() const;
  /// The same times the probability, to choose between fits to one frame.
  double worth() const;
  /// Unknowns in a row: the place's turn as angle times axis [rad], its shift [m], the joints [rad].
  PoseVector pose() const;
};

/// Why a hand is lost and what would help: "probability 0.12 (0.5 required): 88 % of the points near the skin lie on
/// it; ...". Empty of one that is not lost.
std::string lost_text(const HandFit& fit);

/// What a track() took [s].
struct FitTimes {
  double points = 0;
  double search = 0;
  double pose = 0;
  double check = 0;
  double deformation = 0;
};

/// Follows a hand through the frames of depth cameras: points, pose, check, deformation.
///
/// In each frame the pose starts from a prediction by the last two frames and is fitted (PoseFit). The prediction takes
/// the motion of the place times 0.8 and that of the joints times 0.5. The fit is believed if it is probable enough.
/// The probability is that of a logistic regression. It goes by the distances of the points from the skin and by the
/// proportions. It also goes by what the images say of the skin (SightCheck), as a whole and at each digit's end.
/// Points behind the wrist do not count. If the fit is not believed, the hand is lost, and the fit says so.
/// If the hand is not lost, the skin is then deformed towards the points (DeformationFit).
///
/// A lost hand is looked for again (HandSearch). An image 0.1 s or more after the last one is searched at length. So
/// are up to six of the frames that are learnt from. This takes 0.5 to 2 s on one core: all postures, 24 starts, the
/// proportions of the four best, digits moved. Other frames try two postures and some starts.
///
/// accuracy   three simulated D415 0.34 m away with their noise, a hand 6 % shorter and 7 % narrower than the template
///            that moves at 50 mm/s while its index finger flexes: the skin seen within 0.11 mm rms and 0.23 mm at 95 %
///            in front of the wrist, its index pad within 0.16 mm rms; with a forearm in view 0.11, 0.24 and 0.18;
///            digits 3 to 6 % off and a bump of 2 mm besides: 0.15, 0.26 and 0.23 mm
class HandTracker {
 public:
  /// workspace   box in which hands are looked for, the world's frame [m]
  /// throws      InputError as PointReader does
  HandTracker(const HandTemplate& hand, std::vector<DepthCamera> cameras, const Box& workspace,
              const FitOptions& options = {});

  /// Learns the hand's shape from frames that follow each other. It finds and follows the hand by the template's shape,
  /// or by the shape that was learnt before. Then it learns from up to twelve of the frames.
  ///
  /// frame     makes number 0, 1, ... of so many, and up to three of them again; no more than these are in memory at a
  ///           time
  /// returns   whether the hand was found in three frames or more; if not the shape is as it was
  bool learn(std::size_t count, const std::function<DepthFrame(std::size_t)>& frame);
  bool learn(const std::vector<DepthFrame>& frames) {
    return learn(frames.size(), [&](std::size_t k) { return frames[k]; });
  }

  HandFit track(const DepthFrame& frame);

  /// Forgets where the hand was, not its shape; the next frame is searched whole.
  void forget();

  /// Where the fit has the points that a carrier of the template holds [m], the world's frame.
  void skin(const HandFit& fit, const HandTemplate::Carrier& carrier, Points& world) const;
  /// The same of the template's own vertices.
  void skin(const HandFit& fit, Points& world) const;

  /// Of each face of the template: the share of its corners that a camera saw where the fit has them; 0 where nothing
  /// was fitted.
  Eigen::VectorXd confidence(const HandFit& fit) const;

  const HandTemplate& hand() const { return *hand_; }
  const ShapedHand& shape() const { return shape_; }
  const std::vector<DepthCamera>& cameras() const { return reader_.cameras(); }
  const FitTimes& times() const { return times_; }  // of the last track()

 private:
  static constexpr double kStartTurn = 15 * kDegree;  // deviation of joints from the template's

  struct Past {
    double seconds;
    HandState state;
  };

  HandState predicted(double seconds) const;
  /// A frame that the hand was found in, kept while its shape is learnt.
  struct LearningView {
    DepthFrame frame;
    HandPoints points;
    HandFit fit;
  };

  /// A start of a fit that was followed.
  struct Attempt {
    HandFit fit;
    HandPoints points;
    ShapedHand shape;
    PosePrior prior;
  };

  void look_for(const ShapedHand& shape, std::vector<double> sizes);
  void learn_digits(std::vector<LearningView>& views);
  HandPoints read(const DepthFrame& frame, const Box& within);
  Box region(const HandState& state) const;
  HandFit fitted(const DepthFrame& frame, const HandPoints& points, const HandState& start, const PosePrior& prior);
  HandFit found(const DepthFrame& frame, HandPoints& points);
  std::vector<Attempt> attempts(const DepthFrame& frame, const HandPoints& points, bool thorough);
  void with_proportions(const DepthFrame& frame, Attempt& attempt, double model_error);
  void with_digits_moved(const DepthFrame& frame, Attempt& attempt);
  HandState brought_closer(const HandPoints& points, const HandState& start, const PosePrior& prior);
  void evaluate(const DepthFrame& frame, const HandPoints& points, HandFit& fit);
  std::vector<std::size_t> digits_missing() const;
  void deform(const HandPoints& points, HandFit& fit);
  NodeMotions motions(const HandFit& fit) const;
  HandFit track_points(const DepthFrame& frame, HandPoints& points);

  std::shared_ptr<const HandTemplate> hand_;
  PointReader reader_;
  Box workspace_;
  FitOptions options_;
  ShapedHand shape_;
  PoseFit fit_;
  VertexGrid skin_grid_;               // of its vertices
  std::vector<JointAngles> postures_;  // in which it is looked for
  std::optional<HandSearch> search_;
  std::size_t next_posture_ = 0;
  int thorough_left_ = 6;  // how many frames of those that are learnt from may still be searched at length
  std::optional<DeformationFit> deformation_;
  SightCheck check_;
  SkinTargets targets_;
  std::vector<Past> past_;         // none, one or two, the last at the end
  Points shifts_;                  // of the last frame
  std::vector<HandStart> starts_;  // still to be tried while the hand is lost, the best at the end
  double last_ = -std::numeric_limits<double>::infinity();  // when the last frame was taken [s]
  bool apart_ = false;                                      // whether this frame is too far from it to show motion
  std::vector<int> digit_;                                  // on whose last bone a vertex lies, -1 elsewhere
  bool learning_ = false;
  bool learnt_ = false;
  FitTimes times_;
};

}  // namespace touchfield
