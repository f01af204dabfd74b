# All layers as one shared library for other programs: they link it and Eigen's headers, nothing else. Its objects are those
# of the executable, which stays linked statically, so that it costs a link.
include(CMakePackageConfigHelpers)
include(GNUInstallDirs)

get_property(layers GLOBAL PROPERTY TOUCHFIELD_LAYERS)
get_property(objects GLOBAL PROPERTY TOUCHFIELD_OBJECTS)
add_library(touchfield_library SHARED ${objects})
add_library(touchfield::touchfield ALIAS touchfield_library)
set_target_properties(touchfield_library PROPERTIES
  OUTPUT_NAME touchfield EXPORT_NAME touchfield
  VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
  LINKER_LANGUAGE CXX
  BUILD_WITH_INSTALL_RPATH ON INSTALL_RPATH_USE_LINK_PATH ON)  # Debian's OpenBLAS with OpenMP has a folder of its own
target_link_libraries(touchfield_library PUBLIC Eigen3::Eigen PRIVATE ${layers})  # for what these link
# Our functions call ours, whatever flags a program compiles Eigen's templates with.
target_link_options(touchfield_library PRIVATE -Wl,-Bsymbolic-functions)
target_compile_features(touchfield_library INTERFACE cxx_std_20)
target_compile_definitions(touchfield_library INTERFACE ${TOUCHFIELD_EIGEN_ALIGNMENT})
# The second folder is for our headers' own includes, which start at sim, solvers or hardware.
target_include_directories(touchfield_library INTERFACE
  $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}> $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}>
  $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/touchfield>)

set(package ${CMAKE_INSTALL_LIBDIR}/cmake/touchfield)
install(TARGETS touchfield_library EXPORT touchfield LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
# Without those that are compiled for one instruction level.
install(DIRECTORY sim solvers hardware DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/touchfield
        FILES_MATCHING PATTERN "*.h" PATTERN pair_formulas.h EXCLUDE PATTERN pair_kernel.h EXCLUDE
        PATTERN grid_formulas.h EXCLUDE
        PATTERN reciprocal_root.h EXCLUDE)
install(EXPORT touchfield NAMESPACE touchfield:: FILE touchfieldTargets.cmake DESTINATION ${package})
configure_package_config_file(cmake/touchfieldConfig.cmake.in ${PROJECT_BINARY_DIR}/generated/touchfieldConfig.cmake
  INSTALL_DESTINATION ${package} NO_SET_AND_CHECK_MACRO)
write_basic_package_version_file(${PROJECT_BINARY_DIR}/generated/touchfieldConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${PROJECT_BINARY_DIR}/generated/touchfieldConfig.cmake
              ${PROJECT_BINARY_DIR}/generated/touchfieldConfigVersion.cmake DESTINATION ${package})

file(RELATIVE_PATH TOUCHFIELD_PREFIX ${CMAKE_INSTALL_FULL_LIBDIR}/pkgconfig ${CMAKE_INSTALL_PREFIX})
string(REGEX REPLACE "/$" "" TOUCHFIELD_PREFIX ${TOUCHFIELD_PREFIX})
list(TRANSFORM TOUCHFIELD_EIGEN_ALIGNMENT PREPEND -D OUTPUT_VARIABLE TOUCHFIELD_DEFINITIONS)
list(JOIN TOUCHFIELD_DEFINITIONS " " TOUCHFIELD_DEFINITIONS)
configure_file(cmake/touchfield.pc.in ${PROJECT_BINARY_DIR}/generated/touchfield.pc @ONLY)
install(FILES ${PROJECT_BINARY_DIR}/generated/touchfield.pc DESTINATION ${CMAKE_INSTALL_LIBDIR}/pkgconfig)
