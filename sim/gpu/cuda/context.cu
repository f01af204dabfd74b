#include <algorithm>
#include <cstdint>

#include "sim/gpu/cuda/context.cuh"

namespace touchfield::cuda {

namespace {

std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

constexpr double kShareOfFree = 0.92;  // of free memory: libraries and kernels take some beside ours

[[noreturn]] void fail(bool for_memory, const char* what, const std::string& why) {
  const std::string text = std::string("graphics card: ") + what + ": ";
  if (for_memory) {
    throw GpuMemoryFailure(text + "out of memory");
  }
  throw GpuFailure(text + why);
}

}  // namespace

void check(cudaError_t error, const char* what) {
  if (error != cudaSuccess) {
    const bool for_memory = error == cudaErrorMemoryAllocation;
    if (for_memory) {
      cudaGetLastError();
    }
    fail(for_memory, what, cudaGetErrorString(error));
  }
}

void check(cublasStatus_t status, const char* what) {
  if (status != CUBLAS_STATUS_SUCCESS) {
    fail(status == CUBLAS_STATUS_ALLOC_FAILED, what, cublasGetStatusString(status));
  }
}

void check(cusolverStatus_t status, const char* what) {
  if (status != CUSOLVER_STATUS_SUCCESS) {
    fail(status == CUSOLVER_STATUS_ALLOC_FAILED, what, "cuSOLVER's status " + std::to_string(status));
  }
}

Context::Context(int index, const GpuLimits& limits) : calls_left_(limits.fail_after) {
  check(cudaSetDevice(index), "select");
  cudaDeviceProp properties{};
  check(cudaGetDeviceProperties(&properties, index), "properties");
  int driver = 0;
  int runtime = 0;
  check(cudaDriverGetVersion(&driver), "driver's version");
  check(cudaRuntimeGetVersion(&runtime), "runtime's version");
  info_ = {index,
           properties.name,
           properties.major,
           properties.minor,
           properties.totalGlobalMem,
           version_text(driver),
           version_text(runtime)};
  check(cudaStreamCreateWithFlags(&stream_, cudaStreamNonBlocking), "stream");
  check(cublasCreate(&blas_), "cuBLAS");
  check(cublasSetStream(blas_, stream_), "cuBLAS");
  check(cusolverDnCreate(&solver_), "cuSOLVER");
  check(cusolverDnSetStream(solver_, stream_), "cuSOLVER");
  check(cusolverDnCreateParams(&params_), "cuSOLVER");
  cudaMemPoolProps pool{};
  pool.allocType = cudaMemAllocationTypePinned;
  pool.location = {cudaMemLocationTypeDevice, index};
  check(cudaMemPoolCreate(&pool_, &pool), "memory pool");
  std::uint64_t keep = UINT64_MAX;
  check(cudaMemPoolSetAttribute(pool_, cudaMemPoolAttrReleaseThreshold, &keep), "memory pool");
  std::size_t free = 0;
  std::size_t total = 0;
  check(cudaMemGetInfo(&free, &total), "free memory");
  allowed_ = static_cast<std::size_t>(kShareOfFree * static_cast<double>(free));
  if (limits.memory > 0) {
    allowed_ = std::min(allowed_, limits.memory);
  }
}

Context::~Context() {
  cudaSetDevice(info_.index);
  cudaStreamSynchronize(stream_);
  cusolverDnDestroyParams(params_);
  cusolverDnDestroy(solver_);
  cublasDestroy(blas_);
  cudaFreeHost(staging_);
  cudaStreamDestroy(stream_);
  cudaMemPoolDestroy(pool_);
}

void Context::use() const { check(cudaSetDevice(info_.index), "select"); }

void Context::count_call() {
  if (calls_left_ >= 0 && calls_left_-- == 0) {
    throw GpuFailure("graphics card: a failure that was asked for");
  }
}

void Context::launched(const char* what) {
  count_call();
  check(cudaGetLastError(), what);
}

void Context::synchronize() {
  count_call();
  check(cudaStreamSynchronize(stream_), "wait");
}

void* Context::allocate(std::size_t bytes) {
  if (taken_ + bytes > allowed_) {
    throw GpuMemoryFailure("graphics card: " + std::to_string(bytes >> 20U) + " MB more than the " +
                           std::to_string(taken_ >> 20U) + " MB that are taken do not fit its " +
                           std::to_string(allowed_ >> 20U) + " MB");
  }
  void* memory = nullptr;
  check(cudaMallocFromPoolAsync(&memory, bytes, pool_, stream_), "take memory");
  taken_ += bytes;
  most_taken_ = std::max(most_taken_, taken_);
  return memory;
}

void Context::free(void* memory, std::size_t bytes) noexcept {
  cudaFreeAsync(memory, stream_);
  taken_ -= bytes;
}

void* Context::staging(std::size_t bytes) {
  if (bytes > staging_bytes_) {
    check(cudaFreeHost(staging_), "host memory");
    staging_ = nullptr;
    staging_bytes_ = 0;
    check(cudaMallocHost(&staging_, bytes), "host memory");
    staging_bytes_ = bytes;
  }
  return staging_;
}

}  // namespace touchfield::cuda

// What the program finds in the library by name.
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
