# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Packages of Debian, one for each component of the installation: tetwarp, libtetwarp-dev, python3-tetwarp, tetwarp-doc.
# cmake/debian/build.sh makes them, and cmake/debian/try.sh tries them in bare systems.
set(debian "${PROJECT_SOURCE_DIR}/cmake/debian")

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME tetwarp)
set(CPACK_PACKAGE_VERSION "${PROJECT_VERSION}")
set(CPACK_PACKAGE_CONTACT "The Tetwarp authors <noreply@example.org>")
set(CPACK_DEBIAN_PACKAGE_MAINTAINER "${CPACK_PACKAGE_CONTACT}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
    OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_ENABLE_COMPONENT_DEPENDS OFF)
set(CPACK_DEBIAN_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_COMPONENTS_ALL program development python)
if(EXISTS "${PROJECT_SOURCE_DIR}/build/docs/html/index.html")  # docs/build.sh made it
  list(APPEND CPACK_COMPONENTS_ALL documentation)
endif()

# tetwarp_debian_package(COMPONENT NAME SECTION CONTENT): what one package says of itself. CONTENT: what is in it.
function(tetwarp_debian_package component name section content)
  string(TOUPPER ${component} upper)
  set(CPACK_DEBIAN_${upper}_PACKAGE_NAME ${name} PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_FILE_NAME DEB-DEFAULT PARENT_SCOPE)
  set(CPACK_DEBIAN_${upper}_PACKAGE_SECTION ${section} PARENT_SCOPE)
  set(CPACK_COMPONENT_${upper}_DESCRIPTION
"This package has ${content}.
.
Tetwarp deforms medical volumes (CT series in DICOM, NIfTI, NRRD, MHA)
by fields of moved vertices, exactly: each output voxel is sampled
where the one tetrahedron that owns it came from. It has no holes and
no double writes, and gives the same bits on every machine." PARENT_SCOPE)
  # Its licences, and what changed.
  set(folder "${CMAKE_INSTALL_DATADIR}/doc/${name}")
  install(FILES "${PROJECT_BINARY_DIR}/debian/copyright" "${PROJECT_BINARY_DIR}/debian/changelog.gz"
          DESTINATION "${folder}" COMPONENT ${component})
  if(EXISTS "${debian}/${name}.overrides")
    install(FILES "${debian}/${name}.overrides" DESTINATION "${CMAKE_INSTALL_DATADIR}/lintian/overrides" RENAME ${name}
            COMPONENT ${component})
  endif()
endfunction()

tetwarp_debian_package(program tetwarp science "the program tetwarp, and modules for 3D Slicer")
tetwarp_debian_package(development libtetwarp-dev libdevel "static libraries, headers, and what CMake needs")
tetwarp_debian_package(python python3-tetwarp python "the module tetwarp of Python 3")
tetwarp_debian_package(documentation tetwarp-doc doc "guides, references and the C++ interface as pages")

set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS "tetwarp-doc, ffmpeg")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PYTHON_PACKAGE_CONTROL_EXTRA "${debian}/postinst;${debian}/prerm")
# A module of the stable ABI serves later versions of Python, too.
find_package(Python REQUIRED COMPONENTS Interpreter)
math(EXPR next "${Python_VERSION_MINOR} + 1")
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "python3 (>= ${Python_VERSION_MAJOR}.${Python_VERSION_MINOR}~), python3-numpy, tetwarp (= ${PROJECT_VERSION})")
if(Python_VERSION VERSION_LESS 3.12)
  string(APPEND CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS ", python3 (<< ${Python_VERSION_MAJOR}.${next})")
endif()
set(CPACK_DEBIAN_DOCUMENTATION_PACKAGE_ARCHITECTURE all)
set(needed libglm-dev libhwy-dev libtbb-dev libdeflate-dev libminizip-dev libpng-dev libssl-dev zlib1g-dev)
if(TETWARP_WITH_DCMTK)
  list(APPEND needed libdcmtk-dev libicu-dev)
endif()
if(TETWARP_WITH_OPENJPEG)
  list(APPEND needed libopenjp2-7-dev)
endif()
if(TETWARP_WITH_ITK)
  list(APPEND needed libinsighttoolkit5-dev)
endif()
list(JOIN needed ", " CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_RECOMMENDS "tetwarp (= ${PROJECT_VERSION})")  # the modules lie there

# The date of the build is that of the sources: SOURCE_DATE_EPOCH, seconds.
string(TIMESTAMP date "%a, %d %b %Y %H:%M:%S +0000" UTC)
set(gpl "")
if(TETWARP_WITH_ITK)
  file(READ "${debian}/gpl.txt" gpl)
endif()
configure_file("${debian}/copyright.in" "${PROJECT_BINARY_DIR}/debian/copyright" @ONLY)
configure_file("${debian}/changelog.in" "${PROJECT_BINARY_DIR}/debian/changelog" @ONLY)
find_program(TETWARP_GZIP gzip REQUIRED)
execute_process(COMMAND "${TETWARP_GZIP}" -9nc "${PROJECT_BINARY_DIR}/debian/changelog"
                OUTPUT_FILE "${PROJECT_BINARY_DIR}/debian/changelog.gz" COMMAND_ERROR_IS_FATAL ANY)
install(DIRECTORY "${PROJECT_SOURCE_DIR}/build/docs/html" DESTINATION "${CMAKE_INSTALL_DATADIR}/doc/tetwarp-doc"
        COMPONENT documentation OPTIONAL PATTERN .buildinfo EXCLUDE PATTERN objects.inv EXCLUDE)
install(CODE "
  file(GLOB pages \"\$ENV{DESTDIR}\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1/tetwarp*.1\")
  foreach(page IN LISTS pages)  # as Debian wants them
    execute_process(COMMAND \"${TETWARP_GZIP}\" -9nf \"\${page}\" COMMAND_ERROR_IS_FATAL ANY)
  endforeach()" COMPONENT program)
include(CPack)
