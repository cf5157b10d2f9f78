# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# tetwarp_library(NAME SOURCES ... HEADERS ...): makes the library target tetwarp_NAME, alias tetwarp::NAME, and the
# component NAME of the package (TetwarpPackage.cmake). HEADERS are those that users include, and those that these include
# in turn; they are installed. It is a shared library where BUILD_SHARED_LIBS says so. Its ABI is that of one minor version.
#
# The flags that bits depend on are the target's own, so that every build type and every user has them: no fused
# multiply-add unless the source spells it.
function(tetwarp_library name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES;HEADERS")
  add_library(tetwarp_${name} ${arg_SOURCES})
  add_library(tetwarp::${name} ALIAS tetwarp_${name})
  target_sources(tetwarp_${name} PUBLIC FILE_SET HEADERS BASE_DIRS "${PROJECT_SOURCE_DIR}" FILES ${arg_HEADERS})
  tetwarp_configure(tetwarp_${name})
  set_target_properties(tetwarp_${name} PROPERTIES
    POSITION_INDEPENDENT_CODE ON
    VERSION ${PROJECT_VERSION} SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR}
    INSTALL_RPATH "$ORIGIN;$ORIGIN/tetwarp;${tetwarp_users_rpath}")
  tetwarp_install_library(${name})
endfunction()

# tetwarp_module(NAME SOURCES ...): makes libtetwarp_NAME.so, which io/files/module.h loads when it is needed. It is built
# with tetwarp_io, and looked for in lib/tetwarp of the build and of the installation.
function(tetwarp_module name)
  cmake_parse_arguments(PARSE_ARGV 1 arg "" "" "SOURCES")
  add_library(tetwarp_${name} MODULE ${arg_SOURCES})
  tetwarp_configure(tetwarp_${name})
  set_target_properties(tetwarp_${name} PROPERTIES
    LIBRARY_OUTPUT_DIRECTORY "${PROJECT_BINARY_DIR}/lib/tetwarp"
    INSTALL_RPATH "$<$<BOOL:${BUILD_SHARED_LIBS}>:$ORIGIN/..>;${tetwarp_users_rpath}")
  install(TARGETS tetwarp_${name} LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR}/tetwarp COMPONENT program)
endfunction()

# Sets the options with which every target of the project is compiled.
function(tetwarp_configure target)
  target_compile_features(${target} PUBLIC cxx_std_20)
  target_include_directories(${target} PUBLIC "$<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>"
                                              "$<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/tetwarp>")
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANGUAGE:CXX>:-ffp-contract=off>")
  if(CMAKE_SYSTEM_PROCESSOR MATCHES "aarch64|arm64")  # where char has no sign unless one says so
    target_compile_options(${target} PRIVATE -fsigned-char)
  endif()
  if(TETWARP_WITH_CUDA)
    # CMake 3.25 does not know the dialects of CUDA 13, so the dialect is given as an option.
    target_compile_options(${target} PRIVATE
      "$<$<COMPILE_LANGUAGE:CUDA>:-std=c++20;--fmad=false;--expt-relaxed-constexpr;--diag-suppress=20012;-Xcompiler=-ffp-contract=off>")
    target_compile_definitions(${target} PUBLIC GLM_FORCE_CUDA)
  endif()
endfunction()

# tetwarp_precompile(TARGET [HEADER ...]): compiles what most of its sources include once, and so takes a third or more
# of their compile time away. HEADER: as in an include directive, further headers.
function(tetwarp_precompile target)
  set(headers "${PROJECT_SOURCE_DIR}/cmake/precompiled.h")
  foreach(header IN LISTS ARGN)
    list(APPEND headers "<${header}>")
  endforeach()
  list(TRANSFORM headers REPLACE "(.+)" "$<$<COMPILE_LANGUAGE:CXX>:\\1>")
  target_precompile_headers(${target} PRIVATE ${headers})
  # GCC 12 then takes the insides of std::string for the project's own, and warns of faults that are none.
  target_compile_options(${target} PRIVATE "$<$<COMPILE_LANG_AND_ID:CXX,GNU>:-Wno-array-bounds;-Wno-stringop-overflow;-Wno-stringop-overread>")
endfunction()
