# Flags every target of ours shares.
add_library(touchfield_flags INTERFACE)
target_compile_options(touchfield_flags INTERFACE -Wall -Wextra -Wpedantic -Wconversion)
# GCC 12 sees uninitialised values and short arrays in its own AVX-512 headers and overlapping copies in its own string
# (bug 105651).
target_compile_options(touchfield_flags INTERFACE
                       $<$<CXX_COMPILER_ID:GNU>:-Wno-maybe-uninitialized> $<$<CXX_COMPILER_ID:GNU>:-Wno-restrict>
                       $<$<CXX_COMPILER_ID:GNU>:-Wno-array-bounds>)
# Complex products without the Annex G test for infinities: the scalar kernels are several times faster, and no kernel
# here multiplies by an infinity. errno is never read after a math call.
target_compile_options(touchfield_flags INTERFACE $<$<CXX_COMPILER_ID:GNU>:-fcx-limited-range> -fno-math-errno)
if(TOUCHFIELD_NATIVE)
  target_compile_options(touchfield_flags INTERFACE -march=native)
endif()
if(TOUCHFIELD_SANITIZE)
  target_compile_options(touchfield_flags INTERFACE -fsanitize=${TOUCHFIELD_SANITIZE} -fno-omit-frame-pointer
                                                    -fno-sanitize-recover=all)
  target_link_options(touchfield_flags INTERFACE -fsanitize=${TOUCHFIELD_SANITIZE})
endif()
target_include_directories(touchfield_flags INTERFACE ${PROJECT_SOURCE_DIR})
# Eigen runs serially inside our own parallel regions; OpenBLAS does the large products.
target_compile_definitions(touchfield_flags INTERFACE EIGEN_DONT_PARALLELIZE)

# touchfield_layer(NAME SOURCES ... USES ... PRIVATE_USES ...): one folder, one library. A layer sees only the layers it
# names, so an include against the architecture does not link.
function(touchfield_layer name)
  cmake_parse_arguments(ARG "" "" "SOURCES;USES;PRIVATE_USES" ${ARGN})
  add_library(tf_${name} STATIC ${ARG_SOURCES})
  target_link_libraries(tf_${name} PUBLIC touchfield_flags Eigen3::Eigen ${ARG_USES}
                                   PRIVATE OpenMP::OpenMP_CXX ${ARG_PRIVATE_USES})
endfunction()
