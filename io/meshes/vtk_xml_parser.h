// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

// Private to io/, in builds with VTK: its XML parser, with bounds.
#include <vtkInputStream.h>
#include <vtkObjectFactory.h>
#include <vtkXMLDataElement.h>
#include <vtkXMLDataParser.h>

#include <cstdint>
#include <cstring>
#include <vector>

namespace tetwarp {

/// VTK's parser, with a limit on the number of elements that it keeps. It can also tell how long a compressed array is.
class VtkXmlParser final : public vtkXMLDataParser {
 public:
  static VtkXmlParser* New() { VTK_STANDARD_NEW_BODY(VtkXmlParser); }
  vtkTypeMacro(VtkXmlParser, vtkXMLDataParser);
  VtkXmlParser(const VtkXmlParser&) = delete;
  VtkXmlParser& operator=(const VtkXmlParser&) = delete;

  bool left_out() const { return left_out_; }

  /// The first words before the values of an array, at most `count`. @param offset  of an appended array; else -1
  std::vector<std::uint64_t> head(vtkXMLDataElement* element, vtkTypeInt64 offset, std::size_t count) {
    if (offset >= 0) {
      this->DataStream = this->AppendedDataStream;
      this->SeekG(this->AppendedDataPosition + offset);
    } else {
      this->DataStream = this->InlineDataStream;
      this->SeekInlineDataPosition(element);
    }
    this->DataStream->SetStream(this->Stream);
    this->DataStream->StartReading();
    const std::size_t width = word_bytes();
    std::vector<unsigned char> bytes(count * width);
    const std::size_t got = this->DataStream->Read(bytes.data(), bytes.size()) / width;
    this->DataStream->EndReading();
    this->PerformByteSwap(bytes.data(), got, width);
    std::vector<std::uint64_t> words(got, 0);
    for (std::size_t n = 0; n < got; ++n) {
      std::uint32_t narrow = 0;
      if (width == 8) {
        std::memcpy(&words[n], bytes.data() + n * width, width);
      } else {
        std::memcpy(&narrow, bytes.data() + n * width, width);
        words[n] = narrow;
      }
    }
    return words;
  }

  std::size_t word_bytes() const { return this->HeaderType == 64 ? 8 : 4; }
  bool has_appended() const { return this->AppendedDataPosition > 0 && this->AppendedDataStream != nullptr; }

 protected:
  VtkXmlParser() = default;
  ~VtkXmlParser() override = default;

  void StartElement(const char* title, const char** attributes) override {
    if (skipped_ > 0 || this->NumberOfOpenElements >= kDeepest || ++elements_ > kMostElements) {
      ++skipped_;
      left_out_ = true;
      return;
    }
    this->Superclass::StartElement(title, attributes);
  }
  void EndElement(const char* title) override {
    if (skipped_ > 0) {
      --skipped_;
      return;
    }
    this->Superclass::EndElement(title);
  }

 private:
  static constexpr std::size_t kDeepest = 32;          // nesting of elements: VTK destroys them by recursion
  static constexpr std::size_t kMostElements = 20000;  // elements of a file, all of which VTK keeps
  std::size_t elements_ = 0, skipped_ = 0;
  bool left_out_ = false;
};

}  // namespace tetwarp
