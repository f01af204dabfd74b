# The graphics card's part, libtouchfield_gpu.so, loaded when the program runs. It takes half of a build, so that it is
# built by itself only where there is a card, whose driver makes this file.
set(TOUCHFIELD_CUDA AUTO CACHE STRING
    "Build the graphics card's library: AUTO (where there is a card, and nvcc 12 or later), ON or OFF")
set(card_device /dev/nvidiactl)
set_property(CACHE TOUCHFIELD_CUDA PROPERTY STRINGS AUTO ON OFF)

set(TOUCHFIELD_HAS_CUDA OFF CACHE INTERNAL "")
if(NOT TOUCHFIELD_SANITIZE AND (TOUCHFIELD_CUDA STREQUAL ON OR (TOUCHFIELD_CUDA STREQUAL AUTO AND EXISTS ${card_device})))
  include(CheckLanguage)
  check_language(CUDA)
  if(CMAKE_CUDA_COMPILER)
    # Machine code for the study's own card, for an A100 and for an H100; later ones compile the last one's PTX.
    set(CMAKE_CUDA_ARCHITECTURES 75-real 80-real 90 CACHE STRING "Compute capabilities to compile for")
    enable_language(CUDA)
    find_package(CUDAToolkit QUIET)
    if(CMAKE_CUDA_COMPILER_VERSION VERSION_GREATER_EQUAL 12 AND TARGET CUDA::cusolver
       AND TARGET CUDA::cufft)
      set(TOUCHFIELD_HAS_CUDA ON CACHE INTERNAL "")
    endif()
  endif()
  if(TOUCHFIELD_CUDA STREQUAL ON AND NOT TOUCHFIELD_HAS_CUDA)
    message(FATAL_ERROR "TOUCHFIELD_CUDA=ON needs nvcc 12 or later with cuBLAS, cuFFT and cuSOLVER")
  endif()
endif()
