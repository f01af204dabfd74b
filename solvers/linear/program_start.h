#pragma once

#include <string>

namespace touchfield {

/// The variable that tells GNU's OpenMP how often a thread that waits for others looks for them before it sleeps.
///
/// Without it threads look for milliseconds. Where other programs want the cores too, the thread that is waited for may
/// have none until those are over. This happens at every one of the thousands of points where threads meet, so that a
/// run takes many times as long. Threads that sleep at once take twice as long on an idle machine. kSpins times come
/// near the better of the two on either (results/tables/waiting.csv).
inline constexpr const char* kSpinsVariable = "GOMP_SPINCOUNT";
inline constexpr int kSpins = 4000;

/// Starts this program again, once, with what libraries read only when they are loaded: kSpins, and OPENBLAS_CORETYPE
/// where better_blas_core() names one. What the user has set, or says by OMP_WAIT_POLICY, stays. Returns where there is
/// nothing to set or the program cannot be started again. To be called first thing in main, before threads and files.
void restart_with_better_settings(char** argv);

/// Keeps what this process frees, for the next that takes as much, instead of giving it back to the system. Frames take
/// the same large matrices again and again: each time from the system, page by page, they cost a quarter of a frame on
/// 16 cores.
void keep_freed_memory();

/// How threads wait, in words: "look 4000 times, then sleep".
std::string thread_waiting();

/// Whether nothing keeps them from looking for milliseconds.
bool threads_wait_long();

}  // namespace touchfield
