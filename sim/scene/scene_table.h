#pragma once

#include <string>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/scene/schema.h"

/// The table of a scene: every key with its type, unit, range, default and explanation, once.
namespace touchfield::schema {

inline const Unit kMillimetres = Unit::power_of_ten(-3);
inline const Unit kDegrees = Unit::degree();
inline const Unit kMilliseconds = Unit::power_of_ten(-3);
inline const Unit kPlain = Unit::power_of_ten(0);

/// A whole scene.
const Codec<Scene>& scene_codec();

Codec<ArraySpec> array_codec();
Codec<BodySpec> body_codec();
/// Several bodies, each with a name.
Codec<std::vector<BodySpec>> bodies_codec();
Codec<EdgeSpec> edge_codec();
Codec<SolveSpec> solve_codec();
Codec<EvaluationSpec> evaluation_codec();
Codec<MotionSpec> motion_codec();
Codec<PatternSpec> pattern_codec();
Codec<FeltSpec> felt_codec();
Codec<MotionSpec::Sensor> sensor_codec();
Codec<HandShape> hand_codec();
/// Noise on a skin as a sensor sees it.
Codec<SensingNoise> sensing_codec();

Codec<std::optional<double>> number_or(const std::string& none, const Codec<double>& number);

/// Rates of a motion [Hz]: 10 ticks of its clock and slower.
inline const Range kRate = above_to(0, 1e5);
/// Of a motion [ms].
inline const Range kDelay = between(0, 60'000);
/// The hand generator's own bounds of an edge [mm]; other shapes take any.
inline const Range kHandEdge = between(kLeastHandEdge / 1e-3, kMostHandEdge / 1e-3);

/// Reports and returns false if one of the edge lengths read from here does not do for a hand.
bool check_hand_edges(const Input& edges);
/// Names of a body's landmarks, known before it is meshed; of several bodies those that any of them has.
std::vector<std::string> landmark_names(const BodySpec& body);
std::vector<std::string> landmark_names(const std::vector<BodySpec>& bodies);
/// Reports and returns false if a place of the scene's target is at a landmark that the bodies do not have.
bool check_box_landmarks(const Input& scene, const std::vector<BodySpec>& bodies);
/// Reports and returns false if `name`, read from `at`, is none of the landmarks there are.
bool check_landmark(const Input& at, const std::vector<std::string>& names, const std::string& name);
/// The same for those that the `near` of edge lengths names.
bool check_near(const Input& edges, const std::vector<std::string>& names);
/// Reports and returns false if the evaluation cannot have the body of this scene, read from `in`.
bool check_evaluation(const Input& in, const Scene& scene);
/// Reports and returns false if what the motion changes is not in the scene, read from `in`, or leaves its range.
bool check_motion(const Input& in, const Scene& scene);
/// Reports and returns false if the pattern needs what the scene, read from `in`, does not have.
bool check_pattern(const Input& in, const Scene& scene);

}  // namespace touchfield::schema
