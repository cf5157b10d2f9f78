# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# tetwarp_version_source(TARGET): adds version.cpp, made from deform/version.cpp.in, to a target.
#
# This same file is run as a script at each build, so that the commit is that of the build and not that of the last time
# CMake was run. The source is only touched when its text changes.
if(NOT CMAKE_SCRIPT_MODE_FILE)
  function(tetwarp_version_source target)
    find_package(Git QUIET)
    set(output "${CMAKE_CURRENT_BINARY_DIR}/version.cpp")
    add_custom_target(${target}_version
      COMMAND "${CMAKE_COMMAND}" "-DGIT=${GIT_EXECUTABLE}" "-DSOURCE=${PROJECT_SOURCE_DIR}" "-DOUTPUT=${output}"
              "-DTETWARP_VERSION=${PROJECT_VERSION}" -P "${CMAKE_CURRENT_FUNCTION_LIST_FILE}"
      BYPRODUCTS "${output}" VERBATIM COMMENT "")
    set_source_files_properties("${output}" PROPERTIES GENERATED ON)
    target_sources(${target} PRIVATE "${output}")
    add_dependencies(${target} ${target}_version)
  endfunction()
  return()
endif()

# A source archive (git archive) has its commit in a file.
set(TETWARP_COMMIT "unknown")
file(STRINGS "${SOURCE}/cmake/archived_commit.txt" archived REGEX "^[0-9a-f]+$")
if(archived)
  string(SUBSTRING "${archived}" 0 12 TETWARP_COMMIT)
endif()
if(GIT)
  # A source archive that was unpacked inside another repository must not show the commit of that repository.
  execute_process(COMMAND "${GIT}" rev-parse --show-cdup WORKING_DIRECTORY "${SOURCE}"
                  OUTPUT_VARIABLE up RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
  if(NOT failed AND "${up}" STREQUAL "")
    execute_process(COMMAND "${GIT}" --no-optional-locks describe --always --dirty --abbrev=12 --exclude "*"
                    WORKING_DIRECTORY "${SOURCE}" OUTPUT_VARIABLE described RESULT_VARIABLE failed
                    OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET)
    if(NOT failed)
      set(TETWARP_COMMIT "${described}")
    endif()
  endif()
endif()
configure_file("${SOURCE}/deform/version.cpp.in" "${OUTPUT}" @ONLY)
