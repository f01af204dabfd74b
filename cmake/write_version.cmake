find_program(GIT git)
set(revision "unknown")
if(GIT AND EXISTS ${SOURCE}/.git)
  execute_process(COMMAND ${GIT} -c safe.directory=* -C ${SOURCE} describe --always --dirty --abbrev=12 --exclude=*
                  OUTPUT_VARIABLE revision OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE rc)
  if(rc)
    set(revision "unknown")
  endif()
endif()
# An archive of the sources has no .git; git has written the commit into this file, whose line reads otherwise in a clone.
if(NOT EXISTS ${SOURCE}/.git)
  file(STRINGS ${SOURCE}/cmake/revision.txt archived REGEX "^[0-9a-f]+$")
  if(archived)
    string(SUBSTRING "${archived}" 0 12 revision)
  endif()
endif()
file(STRINGS ${SOURCE}/CITATION.cff released REGEX "^date-released: ")
string(REGEX MATCH "[0-9][0-9][0-9][0-9]" year "${released}")
string(STRIP "${FLAGS}" FLAGS)
file(WRITE ${OUT}.new "#pragma once
#define TOUCHFIELD_VERSION \"${VERSION}\"
#define TOUCHFIELD_REVISION \"${revision}\"
#define TOUCHFIELD_COMPILER \"${COMPILER}\"
#define TOUCHFIELD_FLAGS \"${FLAGS}\"
#define TOUCHFIELD_BUILD_TYPE \"${BUILD_TYPE}\"
#define TOUCHFIELD_YEAR \"${year}\"
")
execute_process(COMMAND ${CMAKE_COMMAND} -E copy_if_different ${OUT}.new ${OUT})
file(REMOVE ${OUT}.new)
