// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to Tetwarp: MED files of Salome and Code_Aster, which are HDF5. This header names nothing of ITK, whose HDF5
// reads them.
#include <array>
#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

namespace tetwarp {

/// The mesh of a MED file and the list of its vectors, as they are in the file. Nothing of it is checked but the
/// lengths that are named here.
struct MedFile {
  struct Cells {
    std::string type;         ///< "TE4"
    std::uint64_t count = 0;  ///< of cells
    std::vector<double>
        nodes;  ///< counted from 1: the first of all cells, then the second of all, ...; of polygons none
  };
  struct Field {
    std::string name;
    std::int64_t step = 0, iteration = 0;  ///< -1: none
    std::uint64_t components = 0;          ///< in the file; those called DX, DY and DZ are read, else the only three
  };

  std::string mesh;                       ///< its name
  std::array<std::int64_t, 3> version{};  ///< of MED
  std::vector<double> coordinates;        ///< all x, then as many y and z
  std::vector<double> numbers;            ///< of the nodes; empty where the file has none
  std::string unit;                       ///< of the coordinates: mm, m, or empty where the file states neither
  std::vector<Cells> cells;
  std::vector<Field> fields;  ///< of vectors at the nodes, an entry for each step
};

/// Vectors at some of the nodes.
struct MedVectors {
  std::vector<double> nodes;    ///< counted from 1; empty: all
  std::vector<double> vectors;  ///< in the unit of the coordinates: all x, then as many y and z
};

/// Entry points of the module (itkbridge/transform_file.h), which io/meshes/mesh_med.cpp loads. The program
/// tetwarp-read reads the file.
/// @throws InputError for a file that is damaged or has another layout; Error where that program is missing
extern "C" void tetwarp_read_med(const std::filesystem::path& path, MedFile& file);
/// @param field  number in MedFile::fields
extern "C" void tetwarp_read_med_vectors(const std::filesystem::path& path, std::uint64_t field,
                                         std::vector<MedVectors>& vectors);

}  // namespace tetwarp
