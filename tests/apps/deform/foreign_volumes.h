// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>

#include "deform/volume.h"

namespace tetwarp::test {

/// Reads a DICOM series of classic CT by ITK's own reader: GDCMSeriesFileNames, GDCMImageIO, ImageSeriesReader.
/// @throws itk::ExceptionObject
Volume<std::int16_t> read_with_itk(const std::filesystem::path& folder);

/// Reads the volume of a series by DCMTK's data sets and PS3.3 C.7.6.2 alone: slices sorted along row x column, HU by
/// each slice's slope and intercept. It knows uncompressed pixels of 16 bits only. @throws std::runtime_error
Volume<std::int16_t> read_with_dcmtk(const std::filesystem::path& folder);

}  // namespace tetwarp::test
