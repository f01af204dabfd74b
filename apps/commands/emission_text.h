#pragma once

#include "hardware/emission/emission.h"
#include "sim/core/json.h"

namespace touchfield {

Json emission_value(const EmissionReport& report);

/// Says on standard error by what signal an emission was stopped, if by one.
/// returns  the exit code
int said_exit_code(const EmissionReport& report);

}  // namespace touchfield
