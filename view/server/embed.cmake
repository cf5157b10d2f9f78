# SPDX-FileCopyrightText: The Tetwarp authors
# SPDX-License-Identifier: Apache-2.0

# Writes the files of the page as an array in C++: cmake -DFOLDER=... -DFILES=a,b -DOUTPUT=... -P embed.cmake
set(types .html text/html .css text/css .js text/javascript .svg image/svg+xml)
set(arrays "")
set(entries "")
set(number 0)
string(REPLACE "," ";" files "${FILES}")
foreach(file IN LISTS files)
  file(READ "${FOLDER}/${file}" hex HEX)
  string(REGEX REPLACE "(................................)" "\\1\n" lines "${hex}")
  string(REGEX REPLACE "([0-9a-f][0-9a-f])" "\\\\x\\1" bytes "${lines}")
  string(REPLACE "\n" "\"\n\"" bytes "\"${bytes}\"")
  string(LENGTH "${hex}" digits)
  math(EXPR size "${digits} / 2")
  get_filename_component(suffix "${file}" LAST_EXT)
  list(FIND types "${suffix}" at)
  math(EXPR at "${at} + 1")
  list(GET types ${at} type)
  set(path "/${file}")
  if(file STREQUAL "index.html")
    set(path "/")
  endif()
  string(APPEND arrays "constexpr char kFile${number}[] =\n${bytes};\n")
  string(APPEND entries "    {\"${path}\", \"${type}; charset=utf-8\", {kFile${number}, ${size}}},\n")
  math(EXPR number "${number} + 1")
endforeach()
file(WRITE "${OUTPUT}" "// Made by view/server/embed.cmake from view/page.
#include \"view/server/page_files.h\"

namespace tetwarp::viewer {

namespace {

${arrays}
constexpr PageFile kFiles[] = {
${entries}};

}  // namespace

std::span<const PageFile> page_files() { return kFiles; }

}  // namespace tetwarp::viewer
")
