#pragma once

namespace touchfield {

/// Starts to count the process's largest resident memory anew. Returns false where the system cannot: then
/// peak_memory() goes on counting from the start of the process.
bool reset_peak_memory();

/// The process's largest resident memory [MiB]; NaN where the system does not say.
double peak_memory_mib();

}  // namespace touchfield
