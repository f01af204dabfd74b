#pragma once

/// Of functions that the graphics card runs too.
#ifdef __CUDACC__
#define TOUCHFIELD_EVERYWHERE __host__ __device__
#else
#define TOUCHFIELD_EVERYWHERE
#endif
