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
Codec<SolveSpec> solve_codec();
Codec<std::vector<FieldSpec>> fields_codec();

/// Names of the methods as scenes and results spell them.
const std::vector<std::pair<std::string, MethodKind>>& method_names();

}  // namespace touchfield::schema
