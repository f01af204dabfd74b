#pragma once

#include <string>

namespace touchfield {

/// The most threads that may be asked for: OpenMP keeps a record of each on the stack and ends by a signal where that
/// is full.
inline constexpr int kMostThreads = 4096;

/// What the limits of this process leave too little of for the libraries it links, with what mends it; empty if they
/// fit. OpenBLAS takes a buffer for each thread when it is loaded. Where that is refused it tries again for ever.
///
/// environment  as main gets it, "NAME=value" each and a null pointer at the end
///
/// Calls nothing of those libraries, so it may be asked before they are initialised.
std::string missing_room(const char* const* environment);

/// Where this process's memory is limited, has OpenBLAS take all buffers now that calls on so many threads may need.
/// OpenBLAS thus never asks for one when other data have taken the room.
///
/// throws   std::runtime_error if they do not fit; it names the limit and what mends it
void take_blas_buffers(int threads);

/// The limit on this process's memory as a shell sets it, "ulimit -v 400000"; empty if there is none.
std::string memory_limit();

/// Memory that this process may still take by its limits [bytes]; infinite without one.
double memory_below_limit();

/// One line for a computation that found no memory, which names the limit if there is one.
std::string out_of_memory();

/// Checks the variables that libraries take without a check, and then crash by.
///
/// throws   std::invalid_argument if OMP_NUM_THREADS asks for more than kMostThreads, OMP_STACKSIZE for less than 1
///          MiB, or OPENBLAS_CORETYPE for kernels that this processor cannot carry out
void require_sound_variables();

}  // namespace touchfield
