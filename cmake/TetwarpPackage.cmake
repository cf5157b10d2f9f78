# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# What is installed has a component of installations (cmake --install --component): program, development, python or
# documentation.
#
# The package `tetwarp`: one component a library, each with an export file of its own. find_package() takes it from an
# installation, or from the build (tetwarp_DIR is then the build folder).
include(CMakePackageConfigHelpers)
set(TETWARP_PACKAGE_FOLDER "${CMAKE_INSTALL_LIBDIR}/cmake/tetwarp")

# tetwarp_install_library(NAME): installs tetwarp_NAME and its HEADERS as the component NAME.
function(tetwarp_install_library name)
  install(TARGETS tetwarp_${name} EXPORT tetwarp-${name}
          ARCHIVE DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT development
          LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}" COMPONENT program NAMELINK_COMPONENT development
          FILE_SET HEADERS DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}/tetwarp" COMPONENT development)
  set_target_properties(tetwarp_${name} PROPERTIES EXPORT_NAME ${name})
  install(EXPORT tetwarp-${name} NAMESPACE tetwarp:: FILE tetwarp-${name}.cmake DESTINATION "${TETWARP_PACKAGE_FOLDER}"
          COMPONENT development)
  export(EXPORT tetwarp-${name} NAMESPACE tetwarp:: FILE "${PROJECT_BINARY_DIR}/tetwarp-${name}.cmake")
endfunction()

# tetwarp_install_package(): makes and installs the file that find_package() reads first. It is called after all libraries
# are made.
function(tetwarp_install_package)
  set(tetwarp_itk_package "")
  if(TETWARP_WITH_ITK AND NOT TETWARP_ITK_MODULE)  # a module is found by ITK, and does not find ITK itself
    include("${PROJECT_SOURCE_DIR}/itkbridge/itk_modules.cmake")
    list(JOIN tetwarp_itk_modules " " modules)
    set(tetwarp_itk_package "ITK ${tetwarp_itk_version} COMPONENTS ${modules}")
  endif()
  configure_file("${PROJECT_SOURCE_DIR}/cmake/tetwarpConfig.cmake.in" "${PROJECT_BINARY_DIR}/tetwarpConfig.cmake" @ONLY)
  foreach(module FindLibdeflate.cmake FindMinizip.cmake FindOpenJP2.cmake)
    configure_file("${PROJECT_SOURCE_DIR}/cmake/${module}" "${PROJECT_BINARY_DIR}/${module}" COPYONLY)
  endforeach()
  write_basic_package_version_file("${PROJECT_BINARY_DIR}/tetwarpConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
  install(FILES "${PROJECT_BINARY_DIR}/tetwarpConfig.cmake" "${PROJECT_BINARY_DIR}/tetwarpConfigVersion.cmake"
                "${PROJECT_BINARY_DIR}/FindLibdeflate.cmake" "${PROJECT_BINARY_DIR}/FindMinizip.cmake" "${PROJECT_BINARY_DIR}/FindOpenJP2.cmake"
          DESTINATION "${TETWARP_PACKAGE_FOLDER}" COMPONENT development)
endfunction()
