# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Asks CMake what each preset sets, without configuring anything.
function(expect_werror preset expected)
  execute_process(COMMAND "${CMAKE_COMMAND}" --preset ${preset} -N WORKING_DIRECTORY "${SOURCE}" OUTPUT_VARIABLE set
                  COMMAND_ERROR_IS_FATAL ANY)
  string(REGEX MATCH "CMAKE_CXX_FLAGS=[^\n]*-Werror|CMAKE_COMPILE_WARNING_AS_ERROR=\"(ON|TRUE|1)\"" found "${set}")
  if(expected AND NOT found)
    message(SEND_ERROR "the preset ${preset} takes no warning for an error:\n${set}")
  elseif(found AND NOT expected)
    message(SEND_ERROR "the preset ${preset}, which users build with any compiler, takes warnings for errors:\n${set}")
  endif()
endfunction()

foreach(preset cpu cuda)
  expect_werror(${preset} NO)
endforeach()
foreach(preset ci-cpu ci-cuda asan fuzz)
  expect_werror(${preset} YES)
endforeach()
