// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// Several volumes in one series, made by editing copies of a real one.
#include <gtest/gtest.h>

#include <algorithm>

#include "io/dicom_series.h"
#include "tests/support/dicom/dicom_edit.h"
#include "tests/support/real_data.h"
#include "tests/support/says.h"
#include "tests/support/scratch.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

using Edit = std::function<void(DcmDataset&)>;
using Labels = std::vector<std::string>;

Edit put(const DcmTagKey& tag, const std::string& value) {
  return [tag, value](DcmDataset& data) { data.putAndInsertString(tag, value.c_str()); };
}

/// Makes a series of copies of slices of an abdomen, 2.5 mm apart. The first voxel of every copy of the n-th kind is n.
class Copies {
 public:
  explicit Copies(const fs::path& source) : source_(scan_dicom(source).series.at(0)) {}

  void add(const std::string& name, std::size_t first, std::size_t count, std::size_t step, const Edit& edit,
           bool named = true) {
    ++kinds_;
    for (std::size_t n = 0; n < count; ++n) {
      const DicomSlice& slice = source_.slices.at(first + n * step);
      edit_copy(slice.file, folder() / (name + "-" + slice.file.filename().string()), [&](DcmDataset& data) {
        if (named)
          rename_instance(data, std::to_string(kinds_));
        else
          data.putAndInsertString(DCM_SOPInstanceUID, "");
        mark(data);
        edit(data);
      });
    }
  }
  /// Adds a phase of `kSlices` slices from the first one.
  void add_phase(const std::string& name, const Edit& edit) { add(name, 0, kSlices, 1, edit); }

  fs::path folder() const { return scratch_ / "in"; }
  const Scratch& scratch() const { return scratch_; }
  const DicomSeries& source() const { return source_; }
  std::vector<DicomSeries> series() const { return scan_dicom(folder()).series; }

  static constexpr std::size_t kSlices = 5;

 private:
  void mark(DcmDataset& data) const {
    const Uint16* words = nullptr;
    unsigned long count = 0;
    if (data.findAndGetUint16Array(DCM_PixelData, words, &count).bad()) throw std::runtime_error("no pixels");
    std::vector<Uint16> changed(words, words + count);
    changed.front() = static_cast<Uint16>(kinds_);
    data.putAndInsertUint16Array(DCM_PixelData, changed.data(), changed.size());
  }

  const Scratch scratch_;
  DicomSeries source_;
  int kinds_ = 0;
};

Labels labels_of(const std::vector<DicomSeries>& series) {
  Labels labels;
  for (const DicomSeries& one : series) labels.push_back(one.label);
  return labels;
}

struct Phases {
  const char* name;
  std::function<Edit(int)> edit;  ///< changes of phase 0 to 9
  std::string (*label)(int);
};

void PrintTo(const Phases& phases, std::ostream* out) { *out << phases.name; }

class TenPhases : public testing::TestWithParam<Phases> {};

TEST_P(TenPhases, AreTenVolumesInOrderWithTheirOwnVoxels) {
  TETWARP_REAL_DATA(real, "overlap-kits-and-topogram/kits-00072");
  Copies copies(real);
  const int order[] = {3, 9, 0, 4, 1, 8, 2, 7, 5, 6};
  for (const int phase : order) copies.add_phase("p" + std::to_string(9 - phase), GetParam().edit(phase));
  const std::vector<DicomSeries> series = copies.series();
  ASSERT_EQ(series.size(), 10u);
  const DicomVolume source = load_dicom(copies.source());
  for (int phase = 0; phase < 10; ++phase) {
    EXPECT_EQ(series[phase].label, GetParam().label(phase));
    EXPECT_EQ(series[phase].refusal, std::nullopt);
    DicomVolume loaded = load_dicom(series[phase]);
    EXPECT_TRUE(same_grid(loaded.volume.geometry, series.front().geometry, 0));
    const auto slice = static_cast<std::ptrdiff_t>(512 * 512);
    const auto mark = static_cast<int>(std::find(std::begin(order), std::end(order), phase) - std::begin(order)) + 1;
    for (std::size_t k = 0; k < Copies::kSlices; ++k) {
      const auto begin = loaded.volume.voxels.begin() + std::ptrdiff_t(k) * slice;
      EXPECT_EQ(*begin, mark - 1024);
      EXPECT_TRUE(std::equal(begin + 1, begin + slice, source.volume.voxels.begin() + std::ptrdiff_t(k) * slice + 1));
    }
  }
}

INSTANTIATE_TEST_SUITE_P(
    OfCopies, TenPhases,
    testing::Values(Phases{"TemporalPosition",
                           [](int n) { return put(DCM_TemporalPositionIdentifier, std::to_string(n + 1)); },
                           [](int n) { return "time point " + std::to_string(n + 1); }},
                    Phases{"AcquisitionNumber", [](int n) { return put(DCM_AcquisitionNumber, std::to_string(n + 3)); },
                           [](int n) { return "acquisition " + std::to_string(n + 3); }},
                    Phases{"TriggerTime", [](int n) { return put(DCM_TriggerTime, std::to_string(n * 70) + ".0"); },
                           [](int n) { return "trigger time " + std::to_string(n * 70) + " ms"; }},
                    Phases{"SeriesDescription",
                           [](int n) { return put(DCM_SeriesDescription, "Gated, " + std::to_string(n * 10) + ".0%"); },
                           [](int n) { return "phase " + std::to_string(n * 10) + " %"; }}),
    [](const auto& tested) { return tested.param.name; });

TEST(RealSplit, TwoEnergiesAreTwoVolumes) {
  TETWARP_REAL_DATA(real, "overlap-kits-and-topogram/kits-00072");
  Copies copies(real);
  copies.add_phase("a", put(DCM_KVP, "140"));
  copies.add_phase("b", put(DCM_KVP, "80"));
  EXPECT_EQ(labels_of(copies.series()), (Labels{"80 kV", "140 kV"}));
}

TEST(RealSplit, TwoReconstructionsOfUnequalSlicesAreTwoVolumes) {
  TETWARP_REAL_DATA(real, "overlap-kits-and-topogram/kits-00072");
  Copies copies(real);
  copies.add("soft", 0, 18, 1, put(DCM_ConvolutionKernel, "B30s"));
  copies.add("sharp", 0, 9, 2, put(DCM_ConvolutionKernel, "B70f"));
  const std::vector<DicomSeries> series = copies.series();
  EXPECT_EQ(labels_of(series), (Labels{"kernel B30s", "kernel B70f"}));
  EXPECT_EQ(series.at(0).geometry.spacing.z, 2.5);
  EXPECT_EQ(series.at(1).geometry.spacing.z, 5);
  EXPECT_EQ(series.at(1).geometry.size.z, 9);
}

TEST(RealSplit, OverlappingBlocksOfAScanAreTwoVolumes) {
  TETWARP_REAL_DATA(real, "overlap-kits-and-topogram/kits-00072");
  Copies copies(real);
  copies.add("a", 0, 11, 1, put(DCM_AcquisitionNumber, "2"));
  copies.add("b", 8, 10, 1, put(DCM_AcquisitionNumber, "3"));
  const std::vector<DicomSeries> series = copies.series();
  EXPECT_EQ(labels_of(series), (Labels{"acquisition 2", "acquisition 3"}));
  EXPECT_EQ(series.at(0).geometry.size.z, 11);
  EXPECT_EQ(series.at(1).geometry.size.z, 10);
  EXPECT_EQ(series.at(1).geometry.origin.z, series.at(0).geometry.origin.z + 8 * 2.5);
}

TEST(RealSplit, ARetakenSliceIsRefusedAlthoughItsClockAndNumberDiffer) {
  TETWARP_REAL_DATA(real, "overlap-kits-and-topogram/kits-00072");
  Copies copies(real);
  copies.add("a", 0, 18, 1, [](DcmDataset&) {});
  copies.add("b", 7, 1, 1, [](DcmDataset& data) {
    data.putAndInsertString(DCM_AcquisitionNumber, "3");
    data.putAndInsertString(DCM_InstanceNumber, "19");
    data.putAndInsertString(DCM_ContentTime, "100000");
  });
  const std::vector<DicomSeries> series = copies.series();
  ASSERT_EQ(series.size(), 1u);
  EXPECT_TRUE(says(series[0].refusal.value_or("accepted"),
                   {"2 slices at the same position", "Acquisition Number (0020,0012) gives a volume of one slice"}));
}

/// The UIDs of the series that are derived from each volume.
std::vector<std::string> derived_uids(const Copies& copies) {
  std::vector<std::string> uids;
  for (const DicomSeries& series : copies.series()) {
    const DicomVolume volume = load_dicom(series);
    const fs::path out = copies.scratch() / ("out" + std::to_string(uids.size()));
    fs::remove_all(out);
    fs::create_directory(out);
    DicomDerivation derivation;
    derivation.field_sha256 = std::string(64, '0');
    derivation.parameters = "interpolation=linear";
    derivation.description = "Deformed";
    uids.push_back(write_derived_series(out, view(volume.volume), *volume.headers, derivation).series_uid);
  }
  return uids;
}

TEST(RealSplit, SeriesDerivedFromTwoPhasesAreTwoAlsoWithoutInstanceUids) {
  TETWARP_REAL_DATA(real, "overlap-kits-and-topogram/kits-00072");
  for (const bool named : {true, false}) {
    Copies copies(real);
    copies.add("a", 0, 3, 1, put(DCM_AcquisitionNumber, "1"), named);
    copies.add("b", 0, 3, 1, put(DCM_AcquisitionNumber, "2"), named);
    const std::vector<std::string> uids = derived_uids(copies);
    ASSERT_EQ(uids.size(), 2u);
    EXPECT_NE(uids[0], uids[1]) << (named ? "named" : "wiped");
    EXPECT_EQ(uids, derived_uids(copies)) << "the same again";
  }
}

}  // namespace
}  // namespace tetwarp
