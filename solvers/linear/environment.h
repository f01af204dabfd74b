#pragma once

#include <string>

namespace touchfield {

/// Which kernels OpenBLAS takes (blas_core.h).
inline constexpr const char* kBlasCoreVariable = "OPENBLAS_CORETYPE";
inline constexpr const char* kChosenByUs = "TOUCHFIELD_BLAS_CORE";  // what this program has set it to

/// The value of an environment variable, "" if it has none.
std::string environment_value(const char* name);

}  // namespace touchfield
