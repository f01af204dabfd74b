// What the program finds in the library by name.
#include "sim/gpu/cuda/context.cuh"

extern "C" {

/// How many cards there are; a reason in `why` (room for 256) where none can be used.
int touchfield_gpu_count(char* why) {
  int count = 0;
  const cudaError_t error = cudaGetDeviceCount(&count);
  if (error != cudaSuccess) {
    count = 0;
    int driver = 0;
    cudaDriverGetVersion(&driver);
    const std::string text = driver == 0 ? "no NVIDIA driver" : cudaGetErrorString(error);
    why[text.copy(why, 255)] = '\0';
  }
  return count;
}

/// throws   GpuFailure
touchfield::Gpu* touchfield_gpu_open(int index, const touchfield::GpuLimits& limits) {
  return new touchfield::cuda::Context(index, limits);
}
}
