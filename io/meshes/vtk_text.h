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

/// Values of one type in a legacy file: big-endian numbers in a binary file, else words.
struct VtkValues {
  TextSpan span;
  std::string type;  ///< in capitals: "FLOAT"
  std::uint64_t count = 0;
};

/// One array of data: of a FIELD, or of VECTORS, SCALARS and other attributes.
struct VtkTextArray {
  std::string_view name;  ///< as it is in the file, %-encoded
  std::size_t components = 1, tuples = 0;
  VtkValues values;
};

/// Reads a legacy file from front to back, word by word, and checks every count against what is left of the file. Every
/// function throws InputError for a file that is damaged.
class VtkText {
 public:
  /// Reads up to the word behind DATASET. @param bytes  must outlive this object
  VtkText(std::string_view bytes, std::string name);

  std::string_view title;  ///< the second line of the file
  std::string dataset;     ///< in capitals: "POLYDATA"
  bool binary = false;

  std::string here() const { return at_byte(at_, name_); }
  std::size_t at() const { return at_; }
  /// Takes what is left of the line and returns it without its end.
  std::string_view line();
  /// Goes to the next word. @return false at the end of the file
  bool skip_blanks();
  /// Takes the words that are left of a line. @throws InputError for bytes that are no text
  std::vector<std::string_view> words();
  /// Takes the words of the next line that has any. @param what  is expected there, for the message
  std::vector<std::string_view> next_words(const char* what);
  bool next_is(const char* keyword);

  /// Skips values that begin on the next line and returns where they are.
  VtkValues skip_values(std::uint64_t count, std::string_view type, const std::string& where);
  /// Skips the lists behind CELLS, POLYGONS and similar keywords: one list of numbers in version 4, two in version 5.
  std::vector<VtkValues> skip_cells(std::uint64_t first, std::uint64_t second, const std::string& where);
  /// Skips metadata up to the blank line that ends them.
  void skip_metadata();
  /// Skips the arrays of a FIELD and returns where they are.
  std::vector<VtkTextArray> skip_field(std::size_t arrays);
  /// Skips one part of POINT_DATA or CELL_DATA and returns its arrays; a look-up table has none.
  /// @param words  the line with which the part begins, which has been taken
  std::vector<VtkTextArray> skip_data(const std::vector<std::string_view>& words, std::size_t tuples,
                                      const std::string& where);

 private:
  std::string_view bytes_;
  std::string name_;
  std::size_t at_ = 0;
};

/// Word number `n` of a line. @throws InputError where there is none
std::string_view word_of(const std::vector<std::string_view>& words, std::size_t n, const std::string& where);

/// Turns the bytes of a value in a binary file into a number.
using VtkDecoder = double (*)(const char* bytes);
/// The decoder for a type of value. @param type  in capitals  @throws InputError for one that is no number of whole
/// bytes
VtkDecoder big_endian_decoder(const std::string& type, const std::string& where);
/// Number of bytes of a value. @param type  in capitals  @throws InputError for one that is no number of whole bytes
std::size_t value_bytes(const std::string& type, const std::string& where);

}  // namespace tetwarp
