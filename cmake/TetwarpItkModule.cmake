# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# tetwarp_find_itk(MODULES ...): ITK_LIBRARIES and ITK_INCLUDE_DIRS of these modules and what they depend on.
macro(tetwarp_find_itk)
  if(TETWARP_ITK_MODULE AND ITK_SOURCE_DIR)
    itk_module_config(ITK ${ARGN})  # inside ITK's own build there is no package ITK yet
  else()
    find_package(ITK REQUIRED COMPONENTS ${ARGN})
  endif()
endmacro()

# tetwarp_itk_module(): tells ITK of the module Tetwarp; before all libraries, for ITK says where they go. Who finds ITK
# with it is sent to the package that Tetwarp makes in any case (TetwarpPackage.cmake). ITK's macros want variables of
# these names for each module.
macro(tetwarp_itk_module)
  set(Tetwarp_SOURCE_DIR "${PROJECT_SOURCE_DIR}")
  set(Tetwarp_BINARY_DIR "${PROJECT_BINARY_DIR}")
  set(Tetwarp_LIBRARIES tetwarp::itkbridge)
  set(Tetwarp_EXPORT_CODE_BUILD
    "if(NOT ITK_BINARY_DIR)\n  find_package(tetwarp REQUIRED COMPONENTS itkbridge PATHS \"${PROJECT_BINARY_DIR}\" NO_DEFAULT_PATH)\nendif()")
  set(Tetwarp_EXPORT_CODE_INSTALL "find_package(tetwarp REQUIRED COMPONENTS itkbridge HINTS \"\${ITK_INSTALL_PREFIX}\")")
  if(ITK_SOURCE_DIR)
    itk_module_impl()
  else()
    find_package(ITK REQUIRED)
    set(BUILD_TESTING OFF)  # there are no tests of the module's own, and with them ITK downloads its clang-format
    list(APPEND CMAKE_MODULE_PATH "${ITK_CMAKE_DIR}")
    include(ITKModuleExternal)
  endif()
endmacro()
