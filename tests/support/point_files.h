// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "io/points_file.h"
#include "tests/support/write_file.h"

/// Small files of points, each with the corners (1, 2, 3), (11, 2.5, 3), (1, 22, 3.25). Their frame is as given, or
/// what `space` states (for surfaces; empty: nothing is stated).

inline const std::vector<glm::dvec3>& sample_points() {
  static const std::vector<glm::dvec3> kPoints = {{1, 2, 3}, {11, 2.5, 3}, {1, 22, 3.25}};
  return kPoints;
}

inline std::string sample_csv() { return "label,x,y,z\nA,1,2,3\nB,11,2.5,3\nC,1,22,3.25\n"; }

inline std::string sample_fcsv(const std::string& system) {
  return "# Markups fiducial file version = 4.11\n# CoordinateSystem = " + system +
         "\n# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n"
         "1,1,2,3,0,0,0,1,1,1,0,F-1,,vtkMRMLScalarVolumeNode1\n"
         "2,11,2.5,3,0,0,0,1,1,1,0,\"F, 2\",seen,\n"
         "3,1,22,3.25,0,0,0,1,1,1,0,F-3,,\n";
}

inline std::string sample_markups(const std::string& system) {
  return R"({"@schema": "markups-schema-v1.0.3.json#", "markups": [{"type": "Fiducial", "coordinateSystem": )" +
         system +
         R"(, "coordinateUnits": "mm", "locked": true, "controlPoints": [
 {"id": "1", "label": "F-1", "description": "", "position": [1.0, 2.0, 3.0], "positionStatus": "defined"},
 {"id": "2", "label": "F-2", "description": "seen", "position": [11, 2.5, 3], "selected": false}]},
 {"type": "Curve", "coordinateSystem": )" +
         system + R"(, "controlPoints": [
 {"id": "7", "position": [0, 0, 0], "positionStatus": "undefined"},
 {"id": "8", "orientation": [-1.0, 0.0, 0.0], "position": [1, 22, 3.25]}], "display": {"opacity": 0.5}}]})";
}

inline std::string sample_text_stl(const std::string& space) {
  return "solid part " + space +
         "\n  facet normal 0 0 1\n    outer loop\n      vertex 1 2 3\n      vertex 11 2.5 3\n      vertex 1 22 3.25\n"
         "    endloop\n  endfacet\nendsolid part\n";
}

inline std::string sample_binary_stl(const std::string& space) {
  std::string bytes = "3D Slicer output. " + space;
  bytes.resize(80, ' ');
  append_value(bytes, std::uint32_t{1});
  for (const float value : {0.0f, 0.0f, 1.0f, 1.0f, 2.0f, 3.0f, 11.0f, 2.5f, 3.0f, 1.0f, 22.0f, 3.25f})
    append_value(bytes, value);
  append_value(bytes, std::uint16_t{0xBEEF});
  return bytes;
}

inline std::string sample_obj(const std::string& space) {
  return "# " + space +
         "\nmtllib a.mtl\no part\nv 1 2 3\nv 11 2.5 3 0.5 0.25 1\nv 1 22 3.25\nvt 0 1\nvn 0 0 1\nvn 0 1 0\n"
         "usemtl bone\nf 1/1/1 2/1/2 3/1/1\nf 1//1 2//2 -1//1\nf 3 2 1\nf 1/1 3/1 2/1\nl 1 2\n";
}

template <class T>
void append_big_endian(std::string& bytes, T value) {
  char raw[sizeof value];
  std::memcpy(raw, &value, sizeof value);
  for (std::size_t n = sizeof value; n-- > 0;) bytes += raw[n];
}

inline std::string sample_text_vtk(const std::string& space, const std::string& type = "double") {
  return "# vtk DataFile Version 4.2\n3D Slicer output. " + space + "\nASCII\nDATASET POLYDATA\nPOINTS 3 " + type +
         "\n1 2 3 11 2.5 3\n1 22 3.25\n\nPOLYGONS 1 4\n3 0 1 2\n\nCELL_DATA 1\nNORMALS cells float\n0 0 1\n"
         "POINT_DATA 3\nSCALARS dose float\nLOOKUP_TABLE default\n0.5 1.5 2.5\nNORMALS Normals float\n0 0 1 0 0 1\n0 0 "
         "1\nMETADATA\nINFORMATION 0\n\nFIELD FieldData 1\nids 1 3 int\n7 8 9\n";
}

/// A file of version 5.1, in which cells are offsets and connectivity of 64 bits. Some bytes of its data are blanks.
inline std::string sample_binary_vtk(const std::string& space, bool doubles) {
  std::string bytes = "# vtk DataFile Version 5.1\n3D Slicer output. " + space +
                      "\nBINARY\nDATASET POLYDATA\nPOINTS 3 " + (doubles ? "double" : "float") + "\n";
  for (const glm::dvec3& point : sample_points()) {
    for (int axis = 0; axis < 3; ++axis) {
      if (doubles) {
        append_big_endian(bytes, point[axis]);
      } else {
        append_big_endian(bytes, static_cast<float>(point[axis]));
      }
    }
  }
  bytes += "\nMETADATA\nINFORMATION 0\n\nPOLYGONS 2 3\nOFFSETS vtktypeint64\n";
  for (const std::int64_t offset : {0, 3}) append_big_endian(bytes, offset);
  bytes += "\nCONNECTIVITY vtktypeint64\n";
  for (const std::int64_t vertex : {0, 1, 2}) append_big_endian(bytes, vertex);
  bytes += "\nPOINT_DATA 3\nSCALARS dose int\nLOOKUP_TABLE default\n";
  for (const std::int32_t value : {0x20202020, 0x0A0A0A0A, 0x4E4F524D}) append_big_endian(bytes, value);
  bytes += "\nNORMALS Normals float\n";
  for (const float value : {0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 1.0f}) append_big_endian(bytes, value);
  bytes += "\nFIELD FieldData 1\nids 1 3 short\n";
  for (const int value : {7, 8, 0x2020}) append_big_endian(bytes, static_cast<std::int16_t>(value));
  return bytes + "\n";
}

/// A format of points: how its file is made, in LPS or RAS.
struct PointForm {
  std::string name, lps, ras;
};

inline std::vector<PointForm> point_forms() {
  return {{"a.fcsv", sample_fcsv("LPS"), sample_fcsv("RAS")},
          {"number.fcsv", sample_fcsv("1"), sample_fcsv("0")},
          {"a.mrk.json", sample_markups("\"LPS\""), sample_markups("\"RAS\"")},
          {"number.mrk.json", sample_markups("1"), sample_markups("\"0\"")},
          {"text.stl", sample_text_stl("SPACE=LPS"), sample_text_stl("SPACE=RAS")},
          {"binary.stl", sample_binary_stl("SPACE=LPS"), sample_binary_stl("SPACE=RAS")},
          {"a.obj", sample_obj("SPACE=LPS"), sample_obj("SPACE=RAS")},
          {"text.vtk", sample_text_vtk("SPACE=LPS"), sample_text_vtk("SPACE=RAS")},
          {"float.vtk", sample_binary_vtk("SPACE=LPS", false), sample_binary_vtk("SPACE=RAS", false)},
          {"double.vtk", sample_binary_vtk("SPACE=LPS", true), sample_binary_vtk("SPACE=RAS", true)}};
}
