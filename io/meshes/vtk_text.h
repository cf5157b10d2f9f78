// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/: what the readers of legacy VTK files share
// (https://docs.vtk.org/en/latest/design_documents/VTKFileFormats.html).
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "io/points/points_document.h"

namespace tetwarp {

std::string upper(std::string_view text);

/// Values of one type in a legacy file: big endian in a binary file, else words.
struct VtkValues {
  Span span;
  std::string type;  ///< in capitals: "FLOAT"
  std::uint64_t count = 0;
};

/// One array of data: of a FIELD, or VECTORS and its like.
struct VtkTextArray {
  std::string_view name;  ///< as it is in the file, %-encoded
  std::size_t components = 1, tuples = 0;
  VtkValues values;
};

/// Goes through a legacy file from front to back, word by word, and checks every count against what is left of it.
class VtkText {
 public:
  /// Reads up to the word behind DATASET. @param bytes  must outlive this  @throws InputError as all below
  VtkText(std::string_view bytes, std::string name);

  std::string_view title;  ///< the second line
  std::string dataset;     ///< in capitals: "POLYDATA"
  bool binary = false;

  std::string here() const { return at_byte(at_, name_); }
  std::size_t at() const { return at_; }
  /// The rest of the line, without its end.
  std::string_view line();
  /// @return false at the end of the file
  bool skip_blanks();
  /// The words of the rest of a line. @throws InputError for bytes that are no text
  std::vector<std::string_view> words();
  /// The words of the next line that has any.
  std::vector<std::string_view> next_words(const char* what);
  bool next_is(const char* keyword);

  /// Values behind the line of their header.
  VtkValues skip_values(std::uint64_t count, std::string_view type, const std::string& where);
  /// What stands behind CELLS, POLYGONS and their like: one list of numbers in version 4, two lists in version 5.
  std::vector<VtkValues> skip_cells(std::uint64_t first, std::uint64_t second, const std::string& where);
  /// To the blank line that ends it.
  void skip_metadata();
  /// The arrays of a FIELD.
  std::vector<VtkTextArray> skip_field(std::size_t arrays);
  /// One part of POINT_DATA or CELL_DATA, from behind the line of `words`: arrays, of which a look-up table has none.
  std::vector<VtkTextArray> skip_data(const std::vector<std::string_view>& words, std::size_t tuples,
                                      const std::string& where);

 private:
  std::string_view bytes_;
  std::string name_;
  std::size_t at_ = 0;
};

/// The word `n` of a line. @throws InputError where there is none
std::string_view word_of(const std::vector<std::string_view>& words, std::size_t n, const std::string& where);

/// Makes a number of the bytes of a value in a binary file.
using VtkDecoder = double (*)(const char* bytes);
/// @param type  in capitals  @throws InputError for one that is no number of whole bytes
VtkDecoder big_endian_decoder(const std::string& type, const std::string& where);
/// Bytes of a value, as of `big_endian_decoder`.
std::size_t value_bytes(const std::string& type, const std::string& where);

}  // namespace tetwarp
