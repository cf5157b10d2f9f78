// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Frames of Enhanced CT in every transfer syntax, and in all the ways in which their bytes may lie in a file.
#include <gtest/gtest.h>

#include "deform/errors.h"
#include "io/dicom_series.h"
#include "tests/support/dicom/coded_slices.h"
#include "tests/support/dicom/enhanced_maker.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;
using Hu = std::vector<std::int16_t>;

Hu load(const fs::path& path) {
  const DicomScan scan = scan_dicom(path);
  if (scan.series.size() != 1) throw std::runtime_error("expected one series");
  return load_dicom(scan.series.front()).volume.voxels;
}

std::string refusal(const fs::path& path) {
  try {
    load(path);
  } catch (const InputError& error) {
    return error.what();
  }
  return "accepted";
}

TEST(DicomFrames, NativeFramesOfEverySyntaxAreEqual) {
  const Scratch folder;
  for (const int bits : {16, 8}) {
    const ClassicSlices slices = classic_stack(5, [&](int k, MadeSlice& slice) {
      slice.rows = slice.columns = 5;  // an odd number of bytes a frame
      slice.bits_allocated = slice.bits_stored = bits;
      slice.high_bit = bits - 1;
      slice.is_signed = false;
      slice.words.clear();
      for (int i = 0; i < 25; ++i) slice.words.push_back(static_cast<std::uint16_t>(10 * i + k));
    });
    Hu expected;
    for (int k = 0; k < 5; ++k) {
      for (int i = 0; i < 25; ++i) expected.push_back(static_cast<std::int16_t>(10 * i + k - 1024));
    }
    for (const E_TransferSyntax encoding : {EXS_LittleEndianExplicit, EXS_LittleEndianImplicit, EXS_BigEndianExplicit,
                                            EXS_DeflatedLittleEndianExplicit}) {
      MadeEnhanced().write(folder / "all.dcm", slices, encoding);
      EXPECT_EQ(load(folder / "all.dcm"), expected) << DcmXfer(encoding).getXferName() << ", " << bits << " bits";
    }
  }
}

/// Three slices in a compressed transfer syntax.
class CodedFrames : public testing::TestWithParam<Coding> {
 protected:
  static void SetUpTestSuite() { register_encoders(); }
  void SetUp() override {
    for (int k = 0; k < 3; ++k) {
      MadeSlice slice = GetParam().slice();
      for (std::uint16_t& word : slice.words)
        word = static_cast<std::uint16_t>((word + 37 * k) & (GetParam().bits == 8 ? 255 : 4095));
      slice.position = position_text(0, 0, 2 * k);
      slice.sop_instance += std::to_string(k);
      frames_.push_back(GetParam().frame(folder_.path(), slice));
      slices_.push_back(classic_slice(slice));
      fs::create_directories(folder_ / "classic");
      write_encapsulated(folder_ / "classic" / std::to_string(k), slice, GetParam().uid, {frames_.back()});
    }
  }
  /// @param offsets  the Basic Offset Table
  fs::path write(const std::vector<std::string>& fragments, const std::vector<std::uint32_t>& offsets = {},
                 const std::function<void(DcmDataset&)>& edit = {}) {
    MadeEnhanced made;
    made.edit = edit;
    const std::unique_ptr<DcmDataset> data = made.of(slices_);
    write_file(file_, file_start(GetParam().uid) + attributes_of(*data) + encapsulated(fragments, offsets));
    return file_;
  }

  const Scratch folder_;
  const fs::path file_ = folder_ / "all.dcm";
  ClassicSlices slices_;
  std::vector<std::string> frames_;
};

/// Fragments of `size` bytes of each frame, and where each frame begins behind the offset table.
struct Pieces {
  std::vector<std::string> fragments = {};
  std::vector<std::uint32_t> offsets = {};

  Pieces(const std::vector<std::string>& frames, std::size_t size) {
    std::uint32_t at = 0;
    for (const std::string& frame : frames) {
      offsets.push_back(at);
      for (std::size_t begin = 0; begin < frame.size(); begin += size) {
        fragments.push_back(frame.substr(begin, size));
        at += static_cast<std::uint32_t>(8 + fragments.back().size());
      }
    }
  }
};

void put_extended(DcmDataset& data, const std::vector<std::uint32_t>& offsets) {
  const std::vector<Uint64> values(offsets.begin(), offsets.end());
  auto table = std::make_unique<DcmOther64bitVeryLong>(DcmTag(DCM_ExtendedOffsetTable));
  table->putUint64Array(values.data(), values.size());
  data.insert(table.release(), OFTrue);
}

TEST_P(CodedFrames, OneFragmentEachNeedsNoTable) {
  const Hu expected = load(folder_ / "classic");
  EXPECT_EQ(load(write(frames_)), expected);
  EXPECT_EQ(load(write(frames_, Pieces(frames_, SIZE_MAX).offsets)), expected);
  if (GetParam().is_lossless && !GetParam().name.starts_with("High")) {
    EXPECT_EQ(expected[120], 37);
    EXPECT_EQ(expected[240], 74);
  }
}

TEST_P(CodedFrames, SeveralFragmentsEachAreToldApartByEitherTable) {
  const Hu expected = load(folder_ / "classic");
  for (const std::size_t size : {std::size_t{2}, std::size_t{10}, std::size_t{64}}) {
    const Pieces pieces(frames_, size);
    EXPECT_EQ(load(write(pieces.fragments, pieces.offsets)), expected) << size;
    const auto extended = [&](DcmDataset& data) { put_extended(data, pieces.offsets); };
    EXPECT_EQ(load(write(pieces.fragments, {}, extended)), expected) << size;
    EXPECT_EQ(load(write(pieces.fragments, pieces.offsets, extended)), expected) << size;
  }
}

TEST_P(CodedFrames, FragmentsThatMayBelongToEitherFrameAreRefused) {
  const Pieces pieces(frames_, 20);
  const std::string count = std::to_string(pieces.fragments.size());
  EXPECT_TRUE(says(refusal(write(pieces.fragments)), {"all.dcm", "offset table", count + " fragments of 3 frames"}));
  EXPECT_TRUE(says(refusal(write(pieces.fragments, {0, pieces.offsets[1]})), {"3 entries", "Basic Offset Table", "2"}));
  for (const std::vector<std::uint32_t>& wrong :
       {std::vector<std::uint32_t>{0, pieces.offsets[1] + 2, pieces.offsets[2]},
        {0, 0, pieces.offsets[2]},
        {0, pieces.offsets[2], pieces.offsets[1]},
        {28, pieces.offsets[1], pieces.offsets[2]},
        {0, pieces.offsets[1], 0xfffffff0}})
    EXPECT_TRUE(says(refusal(write(pieces.fragments, wrong)), {"all.dcm", "beginning of frame", "Offset Table"}));
  EXPECT_TRUE(
      says(refusal(write(pieces.fragments, {0, 28, 56}, [&](DcmDataset& data) { put_extended(data, pieces.offsets); })),
           {"offset tables that agree"}));
  EXPECT_TRUE(says(refusal(write({frames_[0], frames_[1]})), {"a fragment of each frame", "2 fragments of 3 frames"}));
  EXPECT_TRUE(says(refusal(write({})), {"a fragment of each frame", "0 fragments"}));
}

TEST_P(CodedFrames, DamagedFrameIsNamed) {
  std::vector<std::string> damaged = frames_;
  damaged[1] = "nothing that was coded";
  EXPECT_TRUE(says(refusal(write(damaged)), {"pixel data cannot be decoded", "all.dcm, frame 2: "}));
}

TEST_P(CodedFrames, CutShortFileNamesTheFirstFrameThatIsMissing) {
  write(frames_);
  fs::resize_file(file_, fs::file_size(file_) - 8 - frames_[2].size() - 8 - 3);
  EXPECT_TRUE(says(refusal(file_), {"truncated", "all.dcm", "frame 2"}));
  const Pieces pieces(frames_, 20);
  write(pieces.fragments, pieces.offsets);
  fs::resize_file(file_, fs::file_size(file_) - 8 - 3);
  EXPECT_TRUE(says(refusal(file_), {"truncated", "all.dcm", "frame 3"}));
}

INSTANTIATE_TEST_SUITE_P(Codings, CodedFrames, testing::ValuesIn(codings()),
                         [](const auto& coding) { return coding.param.name; });

TEST(DicomFrames, FramesThatDcmtkCodesAreThoseOfTheClassicSlices) {
  register_encoders();
  const Scratch folder;
  const ClassicSlices slices = classic_stack(4, [](int k, MadeSlice& slice) {
    slice.rows = 10;
    slice.columns = 12;
    slice.words = busy_words(120);
    slice.words[0] = static_cast<std::uint16_t>(k);
  });
  write_classic(folder / "classic", slices);
  const Hu expected = load(folder / "classic");
  for (const E_TransferSyntax encoding :
       {EXS_RLELossless, EXS_JPEGProcess14, EXS_JPEGProcess14SV1, EXS_JPEGLSLossless}) {
    MadeEnhanced().write(folder / "all.dcm", slices, encoding);
    EXPECT_EQ(load(folder / "all.dcm"), expected) << DcmXfer(encoding).getXferName();
  }
}

}  // namespace
}  // namespace tetwarp
