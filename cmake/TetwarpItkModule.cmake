# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# tetwarp_find_itk(MODULES ...): sets ITK_LIBRARIES and ITK_INCLUDE_DIRS for these modules and all that they depend on.
macro(tetwarp_find_itk)
  if(TETWARP_ITK_MODULE AND ITK_SOURCE_DIR)
    itk_module_config(ITK ${ARGN})  # inside ITK's own build there is no package ITK yet
  else()
    find_package(ITK REQUIRED COMPONENTS ${ARGN})
  endif()
endmacro()

# tetwarp_itk_module(): declares Tetwarp as a module of ITK. It is called before any library is made, for ITK says where
# libraries go. A project that finds ITK with this module is sent to the package that Tetwarp makes in any case
# (TetwarpPackage.cmake). ITK's macros want variables of these names for each module.
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
    set(BUILD_TESTING OFF)  # the module has no tests of its own, and for tests ITK would download its clang-format
    list(APPEND CMAKE_MODULE_PATH "${ITK_CMAKE_DIR}")
    include(ITKModuleExternal)
  endif()
endmacro()
