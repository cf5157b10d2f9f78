// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <algorithm>
#include <mutex>
#include <set>

#include "io/dicom/derive/dicom_derive.h"
#include "io/dicom/derive/dicom_file.h"
#include "io/dicom/derive/dicom_put.h"
#include "io/dicom/objects/dicom_registration.h"
#include "io/dicom/scan/dicom_header.h"
#include "io/dicom/scan/dicom_stream.h"
#include "io/parallel.h"

namespace tetwarp {

namespace {

void check_volume(const ConstVolumeView& volume, const Geometry& expected, std::span<const SliceRange> sampled) {
  const Geometry& geometry = require_hu_volume(volume);
  require(geometry == expected,
          "the volume to write is not on the grid of the derived series; give the one begun with");
  require(sampled.empty() || sampled.size() == static_cast<std::size_t>(geometry.size.z),
          "the volume has " + std::to_string(geometry.size.z) + " slices and there are " +
              std::to_string(sampled.size()) + " ranges of sampled slices; give one a slice, or none");
}

void check_range(const SliceRange& range, std::size_t slices) {
  require(range.first > range.last || (range.first >= 0 && range.last < static_cast<std::int64_t>(slices)),
          "sampled slices " + std::to_string(range.first) + " to " + std::to_string(range.last) +
              " are not all among the " + std::to_string(slices) + " of the source series; check the ranges");
}

bool says_who(const DicomHeaders& source) {
  return std::any_of(source.slices.begin(), source.slices.end(), [](const auto& slice) {
    return text_of(*slice, DCM_BurnedInAnnotation) == "YES" || text_of(*slice, DCM_RecognizableVisualFeatures) == "YES";
  });
}

}  // namespace

struct DerivedSeriesWriter::State {
  std::filesystem::path folder;
  Geometry geometry;
  const DicomHeaders& source;
  DicomDerivation derivation;
  DerivedSeries series;
  /// One mutex for each slice of the source. Where several derived slices take over one header, they read it one after
  /// the other, for DCMTK's data sets remember where they were read last.
  std::vector<std::mutex> reading = std::vector<std::mutex>(source.slices.size());
  std::set<DcmTagKey> added = {};
  std::vector<std::string> instances = std::vector<std::string>(series.instance_number.size());
  std::mutex mutex = {};
};

DerivedSeriesWriter::DerivedSeriesWriter(std::filesystem::path folder, const Geometry& geometry,
                                         const DicomHeaders& source, DicomDerivation derivation) {
  prepare_dcmtk();
  require(!is_sheared(geometry) && geometry.slices.empty(),
          "a derived series is straight and even, the volume is not; resample it onto straightened()");
  DerivedSeries series = derive_series(source, geometry, derivation);
  state_.reset(new State{std::move(folder), geometry, source, std::move(derivation), std::move(series)});
}
DerivedSeriesWriter::~DerivedSeriesWriter() = default;

void DerivedSeriesWriter::write(const ConstVolumeView& volume, std::int64_t begin, std::int64_t end,
                                std::span<const SliceRange> sampled, int threads, const Control& control) {
  State& to = *state_;
  check_volume(volume, to.geometry, sampled);
  // All ranges are checked before a thread writes a file.
  for (std::int64_t k = begin; k < end && !sampled.empty(); ++k)
    check_range(sampled[static_cast<std::size_t>(k)], to.source.slices.size());
  for_each_index(static_cast<std::size_t>(end - begin), threads, control, [&](std::size_t n) {
    const std::size_t k = static_cast<std::size_t>(begin) + n;
    const SliceRange range = sampled.empty() ? SliceRange{} : sampled[k];
    DcmDataset slice;
    const std::size_t header = to.series.header[k];
    const auto added = [&] {
      const std::lock_guard lock(to.reading[header]);
      return derive_slice(slice, *to.source.slices[header], to.series, to.derivation, range, to.geometry, k);
    }();
    put_hu_format(slice, to.geometry);
    std::string uid = write_dicom_file(to.folder / dicom_file_name(to.series.instance_number[k]), slice,
                                       slice_of(volume, k), to.derivation.form.encoding);
    const std::lock_guard lock(to.mutex);
    to.instances[k] = std::move(uid);
    to.added.insert(added.begin(), added.end());
  });
}

DicomWriteReport DerivedSeriesWriter::report() const {
  const std::lock_guard lock(state_->mutex);
  DicomWriteReport report{.study_uid = state_->series.study_uid,
                          .series_uid = state_->series.series_uid,
                          .frame_of_reference_uid = state_->series.frame_of_reference_uid,
                          .added_empty = {},
                          .sop_instance_uids = state_->instances,
                          .says_who = says_who(state_->source)};
  for (const DcmTagKey& tag : state_->added) report.added_empty.push_back(tag_name(tag));
  return report;
}

std::unique_ptr<ImageWriter> DerivedSeriesWriter::create_registration(const std::filesystem::path& path) const {
  return tetwarp::create_registration(
      path, state_->geometry,
      {state_->source, state_->series, state_->derivation, [this] { return report().sop_instance_uids; }});
}

DicomWriteReport write_derived_series(const std::filesystem::path& folder, const ConstVolumeView& volume,
                                      const DicomHeaders& source, const DicomDerivation& derivation,
                                      std::span<const SliceRange> sampled, int threads, const Control& control) {
  const Geometry& geometry = require_hu_volume(volume);
  DerivedSeriesWriter writer(folder, geometry, source, derivation);
  writer.write(volume, 0, geometry.size.z, sampled, threads, control);
  return writer.report();
}

bool is_tetwarp_dicom(const std::filesystem::path& file) {
  prepare_dcmtk();
  DcmFileFormat format;
  // All attributes that are looked at lie before (0018,a002). Files without a preamble are refused: this program writes
  // one.
  if (parse_dicom(format, file, DCM_ContributionDateTime, ERM_fileOnly).result.bad()) return false;
  DcmDataset& data = *format.getDataset();
  DcmItem* last = nullptr;
  if (data.findAndGetSequenceItem(DCM_ContributingEquipmentSequence, last, -1).bad()) last = &data;
  return text_of(*last, DCM_Manufacturer) == "Tetwarp";
}

}  // namespace tetwarp
