# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# cmake/preset.sh in a source folder of its own, on a machine without nvcc and on one with it.
file(REMOVE_RECURSE "${WORK}")
file(MAKE_DIRECTORY "${WORK}/source" "${WORK}/nvcc" "${WORK}/tools")
file(COPY "${SOURCE}/cmake/preset.sh" DESTINATION "${WORK}/source/cmake")
file(WRITE "${WORK}/nvcc/nvcc" "#!/bin/sh\n")
file(CHMOD "${WORK}/nvcc/nvcc" PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
foreach(tool bash dirname)  # a PATH without the nvcc that this machine may have
  find_program(${tool} ${tool} REQUIRED)
  file(CREATE_LINK "${${tool}}" "${WORK}/tools/${tool}" SYMBOLIC)
endforeach()

function(expect expected)
  execute_process(COMMAND "${CMAKE_COMMAND}" -E env --unset=TETWARP_PRESET "PATH=${path}" ${environment}
                          bash "${WORK}/source/cmake/preset.sh" ${ARGN}
                  OUTPUT_VARIABLE found OUTPUT_STRIP_TRAILING_WHITESPACE COMMAND_ERROR_IS_FATAL ANY)
  if(NOT found STREQUAL expected)
    message(SEND_ERROR "preset.sh ${ARGN}, ${case}: found ${found}, expected ${expected}")
  endif()
endfunction()

function(built preset minute)
  file(MAKE_DIRECTORY "${WORK}/source/build/${preset}")
  execute_process(COMMAND touch -t "20260101${minute}" "${WORK}/source/build/${preset}/.ninja_log" COMMAND_ERROR_IS_FATAL ANY)
endfunction()

foreach(machine cpu cuda)
  set(path "${WORK}/tools")
  if(machine STREQUAL "cuda")
    set(path "${WORK}/nvcc:${WORK}/tools")
  endif()
  set(environment "")
  set(case "nothing built")
  expect(${machine})
  expect(${machine} --built)
  set(case "built for continuous integration")
  built(ci-${machine} 1200)
  expect(${machine})
  expect(ci-${machine} --built)
  set(case "then by a user")
  built(${machine} 1201)
  expect(${machine} --built)
  set(case "then for continuous integration again")
  built(ci-${machine} 1202)
  expect(ci-${machine} --built)
  set(case "with TETWARP_PRESET=asan")
  set(environment "TETWARP_PRESET=asan")
  expect(asan)
  expect(asan --built)
endforeach()
