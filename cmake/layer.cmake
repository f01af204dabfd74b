# Flags every target of ours shares.
add_library(touchfield_flags INTERFACE)
target_compile_options(touchfield_flags INTERFACE -Wall -Wextra -Wpedantic -Wconversion)
# GCC 12 sees uninitialised values and short arrays in its own AVX-512 headers, overlapping and overlong copies in its
# own string (bug 105651) and a freed pointer in Eigen's realloc; precompiled, these headers count as ours.
target_compile_options(touchfield_flags INTERFACE
                       $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized> $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
                       $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds> $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overflow>
                       $<$<CXX_COMPILER_ID:GNU>:-Wno-stringop-overread> $<$<CXX_COMPILER_ID:GNU>:-Wno-use-after-free>)
# The compiler collects its garbage once it holds 1 GiB: a seventh of the time that the sources of a folder take as one.
target_compile_options(touchfield_flags INTERFACE
                       "$<$<CXX_COMPILER_ID:GNU>:SHELL:--param ggc-min-heapsize=1048576>")
# Complex products without the Annex G test for infinities: the scalar kernels are several times faster, and no kernel
# here multiplies by an infinity. errno is never read after a math call.
target_compile_options(touchfield_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-fcx-limited-range> -fno-math-errno)
# Stray writes end the program instead of going on; what the loader has filled in is read-only from then on. The inner
# loops (touchfield_levels) get neither a check of the stack nor a checked call: they cost nothing.
target_compile_options(touchfield_flags INTERFACE -fstack-protector-strong)
target_link_options(touchfield_flags INTERFACE LINKER:-z,relro LINKER:-z,now)
if(NOT TOUCHFIELD_SANITIZE)
  target_compile_options(touchfield_flags INTERFACE -U_FORTIFY_SOURCE $<$<NOT:$<CONFIG:Debug>>:-D_FORTIFY_SOURCE=2>)
else()
  target_compile_options(touchfield_flags INTERFACE -fsanitize=${TOUCHFIELD_SANITIZE} -fno-omit-frame-pointer
                                                    -fno-sanitize-recover=all)
  target_link_options(touchfield_flags INTERFACE -fsanitize=${TOUCHFIELD_SANITIZE})
  if(TOUCHFIELD_SANITIZE MATCHES address)
    target_compile_definitions(touchfield_flags INTERFACE TOUCHFIELD_ADDRESS_SANITIZER)
  endif()
endif()
target_include_directories(touchfield_flags INTERFACE ${PROJECT_SOURCE_DIR})
# Eigen runs serially inside our own parallel regions; OpenBLAS does the large products.
target_compile_definitions(touchfield_flags INTERFACE EIGEN_DONT_PARALLELIZE)
# How Eigen allocates, what it takes to be aligned and how small matrices lie in objects follow -march. Held to what suits
# all, so that users of the library may compile for their processor (cmake/library.cmake hands it on): memory is aligned
# as AVX-512 wants it, members as the plain architecture does.
set(TOUCHFIELD_EIGEN_ALIGNMENT EIGEN_MAX_ALIGN_BYTES=64 EIGEN_MAX_STATIC_ALIGN_BYTES=16)
target_compile_definitions(touchfield_flags INTERFACE ${TOUCHFIELD_EIGEN_ALIGNMENT})
# Layers go into a shared library too: no function of ours is meant to be replaced from outside, so all may be inlined.
target_compile_options(touchfield_flags INTERFACE -fno-semantic-interposition)

# Of what takes no time when it runs, command lines, the reading of scenes, tests: half of the time to compile it.
set(TOUCHFIELD_SMALL_OPTIONS $<$<CONFIG:Release>:-O1>)

# The headers that most files read, parsed once: a build takes about half as long. Sources still include what they use:
# TOUCHFIELD_PRECOMPILED=OFF shows what is missing.
function(touchfield_precompiled target kind)
  if(TOUCHFIELD_PRECOMPILED)
    target_precompile_headers(${target} REUSE_FROM touchfield_precompiled_${kind})
  endif()
endfunction()
if(TOUCHFIELD_PRECOMPILED)
  file(CONFIGURE OUTPUT ${PROJECT_BINARY_DIR}/generated/precompiled.cpp CONTENT "")
  set(headers <algorithm> <array> <cmath> <complex> <cstddef> <cstdint> <functional> <limits> <map> <memory> <optional>
              <stdexcept> <string> <string_view> <utility> <variant> <vector> <Eigen/Dense>)
  foreach(kind library small test)
    add_library(touchfield_precompiled_${kind} OBJECT ${PROJECT_BINARY_DIR}/generated/precompiled.cpp)
    target_link_libraries(touchfield_precompiled_${kind} PRIVATE touchfield_flags Eigen3::Eigen OpenMP::OpenMP_CXX)
    target_precompile_headers(touchfield_precompiled_${kind} PRIVATE ${headers})
  endforeach()
  target_compile_options(touchfield_precompiled_small PRIVATE ${TOUCHFIELD_SMALL_OPTIONS})  # as those who use it
  set_target_properties(touchfield_precompiled_library touchfield_precompiled_small PROPERTIES POSITION_INDEPENDENT_CODE ON)
endif()

# touchfield_unity(TARGET FILE...): the sources of a target are compiled as one, but for the files that are named, which use
# names of their own that another file uses too. TOUCHFIELD_UNITY=OFF compiles each by itself: for work on a few of them.
function(touchfield_unity target)
  set_target_properties(${target} PROPERTIES UNITY_BUILD ${TOUCHFIELD_UNITY} UNITY_BUILD_BATCH_SIZE 0)
  set_source_files_properties(${ARGN} PROPERTIES SKIP_UNITY_BUILD_INCLUSION ON)
endfunction()

# touchfield_layer(NAME [SMALL] SOURCES ... [APART ...] USES ... PRIVATE_USES ...): one folder, one library. A layer sees only
# the layers it names, so an include against the architecture does not link. SMALL: nothing in it takes time
# when it runs. APART: sources that touchfield_unity compiles by themselves.
function(touchfield_layer name)
  cmake_parse_arguments(ARG "SMALL" "" "SOURCES;APART;USES;PRIVATE_USES" ${ARGN})
  add_library(tf_${name} STATIC ${ARG_SOURCES} ${ARG_APART})
  set_property(GLOBAL APPEND PROPERTY TOUCHFIELD_LAYERS tf_${name})
  set_property(GLOBAL APPEND PROPERTY TOUCHFIELD_OBJECTS $<TARGET_OBJECTS:tf_${name}>)
  target_link_libraries(tf_${name} PUBLIC touchfield_flags Eigen3::Eigen ${ARG_USES}
                                   PRIVATE OpenMP::OpenMP_CXX ${ARG_PRIVATE_USES})
  set_target_properties(tf_${name} PROPERTIES POSITION_INDEPENDENT_CODE ON)
  if(ARG_SMALL)
    target_compile_options(tf_${name} PRIVATE ${TOUCHFIELD_SMALL_OPTIONS})
    touchfield_precompiled(tf_${name} small)
  else()
    touchfield_precompiled(tf_${name} library)
  endif()
  touchfield_unity(tf_${name} ${ARG_APART})
endfunction()

# touchfield_levels(LAYER SOURCE OPTION...): compiles inner loops once for each instruction level, with TOUCHFIELD_LEVEL the
# level's name, and adds them to a layer, which chooses among them when the program runs
# (solvers/linear/instruction_level.h). With the widest registers of the level, and optimised in every build type, so that
# no inline function is left outside the loops.
if(CMAKE_SYSTEM_PROCESSOR MATCHES "^(x86_64|AMD64|amd64)$")
  set(TOUCHFIELD_LEVELS generic v2 v3 v4)
else()
  set(TOUCHFIELD_LEVELS generic)
endif()
function(touchfield_levels layer source)
  get_filename_component(name ${source} NAME_WE)
  foreach(level ${TOUCHFIELD_LEVELS})
    set(target tf_${name}_${level})
    add_library(${target} OBJECT ${source})
    set_target_properties(${target} PROPERTIES POSITION_INDEPENDENT_CODE ON)
    target_link_libraries(${target} PRIVATE touchfield_flags Eigen3::Eigen OpenMP::OpenMP_CXX)
    target_compile_definitions(${target} PRIVATE TOUCHFIELD_LEVEL=${level})
    target_compile_options(${target} PRIVATE -O3 ${ARGN})
    if(NOT level STREQUAL generic)
      target_compile_options(${target} PRIVATE -march=x86-64-${level})
    endif()
    if(level STREQUAL v3)
      target_compile_options(${target} PRIVATE -mtune=haswell)
    elseif(level STREQUAL v4)
      target_compile_options(${target} PRIVATE -mtune=icelake-server -mprefer-vector-width=512)
    endif()
    target_sources(tf_${layer} PRIVATE $<TARGET_OBJECTS:${target}>)
    set_property(GLOBAL APPEND PROPERTY TOUCHFIELD_OBJECTS $<TARGET_OBJECTS:${target}>)
  endforeach()
endfunction()
