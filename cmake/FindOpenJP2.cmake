# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Finds OpenJPEG 2.5 and defines the target OpenJP2::OpenJP2. Debian 12 has a package config for it, which wants programs
# that are in other packages.
find_path(OpenJP2_INCLUDE_DIR openjpeg.h PATH_SUFFIXES openjpeg-2.5)
find_library(OpenJP2_LIBRARY openjp2)
mark_as_advanced(OpenJP2_INCLUDE_DIR OpenJP2_LIBRARY)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(OpenJP2
  REQUIRED_VARS OpenJP2_LIBRARY OpenJP2_INCLUDE_DIR
  REASON_FAILURE_MESSAGE "it decodes JPEG 2000, the Debian package is libopenjp2-7-dev")
if(OpenJP2_FOUND AND NOT TARGET OpenJP2::OpenJP2)
  add_library(OpenJP2::OpenJP2 UNKNOWN IMPORTED)
  set_target_properties(OpenJP2::OpenJP2 PROPERTIES IMPORTED_LOCATION "${OpenJP2_LIBRARY}"
                        INTERFACE_INCLUDE_DIRECTORIES "${OpenJP2_INCLUDE_DIR}")
endif()
