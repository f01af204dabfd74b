#pragma once

namespace touchfield {

/// Starts to count the process's largest resident memory again. Returns false where the system cannot: then
/// peak_memory() continues counting from the start of the process.
bool reset_peak_memory();

/// The process's largest resident memory [MiB]; NaN where the system does not say.
double peak_memory_mib();

}  // namespace touchfield
