#pragma once

#include <Eigen/Core>

#include "sim/scene/scene.h"

namespace touchfield {

/// Phases of the finished run that a method starts from (`start: {previous: RUN.h5}`), of its method of the same name
/// or, if the start names none and there is none, of its first.
///
/// channels   of the array they are for
/// throws     InputError if the file cannot be read as a run, has no such method or not as many channels
Eigen::VectorXd previous_phases(const MethodSpec& method, Eigen::Index channels);

}  // namespace touchfield
