# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Installs the build, moves the installation, and looks in what find_package() reads for absolute paths, and for warnings
# (with -Werror) that a user's build would take over.
include("${SETTINGS}")
file(REMOVE_RECURSE "${work}/installed" "${installation}" "${work}/without itkbridge")
execute_process(COMMAND "${CMAKE_COMMAND}" --install "${build}" --prefix "${work}/installed"
                OUTPUT_QUIET COMMAND_ERROR_IS_FATAL ANY)
file(RENAME "${work}/installed" "${installation}")

file(GLOB package "${installation}/${libdir}/cmake/tetwarp/*.cmake")
if(NOT package)
  message(FATAL_ERROR "no package in ${installation}/${libdir}/cmake/tetwarp")
endif()
foreach(file IN LISTS package)
  file(STRINGS "${file}" named REGEX "[\";:>, ]/[A-Za-z]")
  if(named)
    message(SEND_ERROR "${file} names a path:\n${named}")
  endif()
  file(STRINGS "${file}" warnings REGEX "[\";: ]-W[a-z]")
  if(warnings)
    message(SEND_ERROR "${file} passes warnings on to users:\n${warnings}")
  endif()
endforeach()

# The same package from a build without ITK: no file for the component.
file(COPY "${installation}/" DESTINATION "${work}/without itkbridge")
file(REMOVE "${work}/without itkbridge/${libdir}/cmake/tetwarp/tetwarp-itkbridge.cmake")
