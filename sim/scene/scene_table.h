#pragma once

#include <string>
#include <utility>
#include <vector>

#include "sim/scene/scene.h"
#include "sim/scene/schema.h"

/// The table of a scene: every key with its type, unit, range, default and explanation, once.
namespace touchfield::schema {

inline const Unit kMillimetres = Unit::power_of_ten(-3);
inline const Unit kDegrees = Unit::degree();
inline const Unit kPlain = Unit::power_of_ten(0);

/// A whole scene.
const Codec<Scene>& scene_codec();

Codec<ArraySpec> array_codec();
Codec<BodySpec> body_codec();
/// Several bodies, each with a name.
Codec<std::vector<BodySpec>> bodies_codec();
Codec<EdgeSpec> edge_codec();
Codec<SolveSpec> solve_codec();
Codec<JudgeSpec> judge_codec();
/// The schemes of the boundary elements.
Codec<Scheme> scheme_codec();
Codec<std::vector<FieldSpec>> fields_codec();

/// The hand generator's own bounds of an edge [mm]; other shapes take any.
inline const Range kHandEdge = between(0.4, 8);

/// Reports and returns false if one of the edge lengths read from here does not do for a hand.
bool check_hand_edges(const Input& edges);
/// Reports and returns false if the judge cannot have the body of this scene, read from `in`.
bool check_judge(const Input& in, const Scene& scene);

/// Names of the methods as scenes and results spell them.
const std::vector<std::pair<std::string, MethodKind>>& method_names();

}  // namespace touchfield::schema
