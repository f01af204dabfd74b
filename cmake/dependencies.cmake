find_package(Eigen3 3.4 REQUIRED NO_MODULE)
find_package(OpenMP REQUIRED COMPONENTS CXX)
find_package(fmt REQUIRED)

# The OpenMP flavour by name: where the pthread flavour is installed too, it would win and oversubscribe the cores.
find_library(TOUCHFIELD_OPENBLAS openblas PATH_SUFFIXES openblas-openmp REQUIRED)
find_path(TOUCHFIELD_OPENBLAS_INCLUDE cblas.h
          PATHS /usr/include/${CMAKE_LIBRARY_ARCHITECTURE}/openblas-openmp /usr/include/openblas NO_DEFAULT_PATH)
if(NOT TOUCHFIELD_OPENBLAS_INCLUDE)
  find_path(TOUCHFIELD_OPENBLAS_INCLUDE cblas.h REQUIRED)
endif()
add_library(touchfield_openblas INTERFACE)
target_link_libraries(touchfield_openblas INTERFACE ${TOUCHFIELD_OPENBLAS})
target_include_directories(touchfield_openblas SYSTEM INTERFACE ${TOUCHFIELD_OPENBLAS_INCLUDE})

find_package(nlohmann_json REQUIRED)
find_library(TOUCHFIELD_SPNG spng REQUIRED)
find_path(TOUCHFIELD_SPNG_INCLUDE spng.h REQUIRED)
add_library(touchfield_spng INTERFACE)
target_link_libraries(touchfield_spng INTERFACE ${TOUCHFIELD_SPNG})
target_include_directories(touchfield_spng SYSTEM INTERFACE ${TOUCHFIELD_SPNG_INCLUDE})

if(TOUCHFIELD_KERNEL)
  return()
endif()

find_package(yaml-cpp 0.7 REQUIRED)
find_package(CLI11 REQUIRED)
find_package(ZLIB REQUIRED)
find_path(TOUCHFIELD_ASIO_INCLUDE asio.hpp REQUIRED)  # headers alone: Debian's libasio-dev

# The serial HDF5: VTK's packages also bring the MPI one.
set(HDF5_PREFER_PARALLEL OFF)
find_package(HDF5 REQUIRED COMPONENTS C)

find_package(Freetype REQUIRED)
find_library(TOUCHFIELD_CAIRO cairo REQUIRED)
find_path(TOUCHFIELD_CAIRO_INCLUDE cairo.h PATH_SUFFIXES cairo REQUIRED)
add_library(touchfield_cairo INTERFACE)
target_link_libraries(touchfield_cairo INTERFACE ${TOUCHFIELD_CAIRO} Freetype::Freetype)
target_include_directories(touchfield_cairo SYSTEM INTERFACE ${TOUCHFIELD_CAIRO_INCLUDE})

find_package(VTK 9.1 REQUIRED COMPONENTS
  CommonCore CommonDataModel CommonExecutionModel FiltersCore FiltersGeneral IOXML IOImage)
