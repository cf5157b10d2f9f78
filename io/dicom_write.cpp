#include <dcmtk/config/osconfig.h>
#include <dcmtk/dcmdata/dcdeftag.h>
#include <dcmtk/dcmdata/dcfilefo.h>

#include <mutex>
#include <set>

#include "io/dicom_derive.h"
#include "io/dicom_file.h"
#include "io/dicom_header.h"
#include "io/dicom_put.h"
#include "io/parallel.h"

namespace tetwarp {

namespace {

void check_shapes(const ConstVolumeView& volume, const DicomHeaders& source, const DicomDerivation& derivation) {
  const Geometry& geometry = require_hu_volume(volume);
  const std::string slices = std::to_string(geometry.size.z);
  require(source.slices.size() == static_cast<std::size_t>(geometry.size.z),
          "the volume has " + slices + " slices and the source series " + std::to_string(source.slices.size()) +
              "; a derived series needs one header a slice");
  const std::vector<SliceRange>& sampled = derivation.sampled_slices;
  require(sampled.empty() || sampled.size() == static_cast<std::size_t>(geometry.size.z),
          "the volume has " + slices + " slices and there are " + std::to_string(sampled.size()) +
              " ranges of sampled slices; give one a slice, or none");
  for (const SliceRange& range : sampled) {
    require(range.first > range.last || (range.first >= 0 && range.last < geometry.size.z),
            "sampled slices " + std::to_string(range.first) + " to " + std::to_string(range.last) +
                " are not all among the " + slices + " of the source series; check the ranges");
  }
}

}  // namespace

DicomWriteReport write_derived_series(const std::filesystem::path& folder, const ConstVolumeView& volume,
                                      const DicomHeaders& source, const DicomDerivation& derivation, int threads,
                                      const Control& control) {
  prepare_dcmtk();
  check_shapes(volume, source, derivation);
  const DerivedSeries series = derive_series(source, derivation);
  std::set<DcmTagKey> added;
  std::mutex mutex;
  for_each_index(source.slices.size(), threads, control, [&](std::size_t k) {
    DcmDataset slice;
    const auto added_here = derive_slice(slice, *source.slices[k], series, derivation, *volume.geometry, k);
    put_hu_format(slice, *volume.geometry);
    write_dicom_file(folder / dicom_file_name(series.instance_number[k]), slice, slice_of(volume, k));
    const std::lock_guard lock(mutex);
    added.insert(added_here.begin(), added_here.end());
  });
  DicomWriteReport report{series.series_uid, series.frame_of_reference_uid, {}};
  for (const DcmTagKey& tag : added) report.added_empty.push_back(tag_name(tag));
  return report;
}

bool is_tetwarp_dicom(const std::filesystem::path& file) {
  prepare_dcmtk();
  DcmFileFormat format;
  // The attributes asked for are all before (0018,a002). Only files with a preamble: ours have one.
  const OFCondition condition = format.loadFileUntilTag(OFFilename(file.c_str()), EXS_Unknown, EGL_noChange,
                                                        DCM_MaxReadLength, ERM_fileOnly, DCM_ContributionDateTime);
  if (condition.bad()) return false;
  DcmDataset& data = *format.getDataset();
  DcmItem* last = nullptr;
  if (data.findAndGetSequenceItem(DCM_ContributingEquipmentSequence, last, -1).bad()) last = &data;
  return text_of(*last, DCM_Manufacturer) == "Tetwarp";
}

}  // namespace tetwarp
