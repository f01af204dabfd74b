#pragma once

#include <string>

#include <nlohmann/json.hpp>

#include "hardware/emission/emission.h"

namespace touchfield {

/// A report as a person reads it, and as --json prints it.
std::string describe_emission(const EmissionReport& report);
nlohmann::ordered_json emission_json(const EmissionReport& report);

/// Says on standard error by what signal an emission was stopped, if by one.
/// returns  the exit code
int said_exit_code(const EmissionReport& report);

}  // namespace touchfield
