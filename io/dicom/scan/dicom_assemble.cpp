// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_assemble.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/dicom/scan/dicom_copies.h"
#include "io/dicom/scan/dicom_kind.h"
#include "io/dicom/scan/dicom_split.h"
#include "io/dicom/scan/dicom_stack.h"
#include "io/dicom/scan/dicom_traits.h"
#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

using Headers = std::vector<DicomFileHeader>;

/// Removes from `files` what is no slice by its kind, and adds a line for each to `series.set_aside`.
void set_other_kinds_aside(Headers& files, DicomSeries& series) {
  std::erase_if(files, [&](const DicomFileHeader& header) {
    const std::string kind = other_kind(header);
    if (!kind.empty()) series.set_aside.push_back({header.file, kind, header.frame});
    return !kind.empty();
  });
}

/// The first problem that `judge` finds, and in how many further files it finds one.
std::optional<std::string> first_problem(const Headers& files, std::string (*judge)(const DicomFileHeader&)) {
  std::optional<std::string> first;
  std::size_t more = 0;
  for (const DicomFileHeader& header : files) {
    std::string problem = judge(header);
    if (problem.empty()) continue;
    if (first)
      ++more;
    else
      first = std::move(problem);
  }
  if (more > 0) {
    *first += " (" + std::to_string(more) + " more of " + std::to_string(files.size()) +
              (files.front().frame ? " frames likewise)" : " files likewise)");
  }
  return first;
}

/// An orientation, and the slices that have it.
struct Orientation {
  DicomFileHeader example;
  std::ptrdiff_t slices = 0;
};

/// The orientations of the files, in the order in which they first occur; at most 64, for more are no series.
std::vector<Orientation> orientations_of(const Headers& files) {
  constexpr std::size_t kMost = 64;
  std::vector<Orientation> orientations;
  for (const DicomFileHeader& header : files) {
    const auto is_same = [&](const Orientation& one) { return same_orientation(header, one.example); };
    auto found = std::find_if(orientations.begin(), orientations.end(), is_same);
    if (found == orientations.end() && orientations.size() == kMost) continue;
    if (found == orientations.end()) found = orientations.insert(found, {header});
    ++found->slices;
  }
  return orientations;
}

/// Keeps the orientation that at least three quarters of the slices share, if there is one, and sets the other slices
/// aside: they are scouts that were stored in the series.
void set_scouts_aside(Headers& files, DicomSeries& series) {
  const std::vector<Orientation> orientations = orientations_of(files);
  const auto usual = std::max_element(orientations.begin(), orientations.end(),
                                      [](const auto& a, const auto& b) { return a.slices < b.slices; });
  if (orientations.size() == 1 || usual->slices * 4 < std::ssize(files) * 3) return;
  const auto plane = [](const DicomFileHeader& header) { return plane_name(rotation_of(*header.orientation)[2]); };
  std::erase_if(files, [&](const DicomFileHeader& header) {
    if (same_orientation(header, usual->example)) return false;
    series.set_aside.push_back({header.file,
                                plane(header) + " among " + plane(usual->example) + " slices: Image Orientation " +
                                    orientation_text(*header.orientation) + ", the others have " +
                                    orientation_text(*usual->example.orientation),
                                header.frame});
    return true;
  });
}

std::optional<std::string> mixed_orientations(const Headers& files) {
  const std::vector<Orientation> orientations = orientations_of(files);
  if (orientations.size() == 1) return std::nullopt;
  const DicomFileHeader &first = orientations[0].example, &second = orientations[1].example;
  return "mixed orientations: " + orientation_text(*first.orientation) + " in " + shown(first) + ", " +
         orientation_text(*second.orientation) + " in " + shown(second) + " (" + std::to_string(orientations.size()) +
         " orientations in " + std::to_string(files.size()) +
         " files); put the slices of one orientation in a folder of their own";
}

/// Compares what must be the same in all slices. @return a refusal that names the first two files that differ
std::optional<std::string> inconsistency(const Headers& files) {
  const DicomFileHeader& first = files.front();
  const auto differ = [&](const std::string& what, const DicomFileHeader& other, const std::string& expected,
                          const std::string& found) {
    return "mixed " + what + ": " + expected + " in " + shown(first) + ", " + found + " in " + shown(other) +
           "; put the slices that belong together in a folder of their own";
  };
  const auto spacing = [](const DicomFileHeader& h) { return number(h.spacing->y) + "\\" + number(h.spacing->x); };
  for (const DicomFileHeader& other : files) {
    const PixelFormat &a = first.pixels, &b = other.pixels;
    if (a.rows != b.rows || a.columns != b.columns) return differ("Rows x Columns", other, size_text(a), size_text(b));
    if (!same_pixel_spacing(first, other)) return differ("Pixel Spacing", other, spacing(first), spacing(other));
    if (first.frame_of_reference_uid != other.frame_of_reference_uid) {
      return differ("Frame of Reference UID", other, shown(first.frame_of_reference_uid),
                    shown(other.frame_of_reference_uid));
    }
    if (first.study_uid != other.study_uid)
      return differ("Study Instance UID", other, shown(first.study_uid), shown(other.study_uid));
  }
  return std::nullopt;
}

/// Whether a Rescale Type (0028,1054) means HU, in the standard's word or spelt out. CT without the attribute is in HU
/// (PS3.3 C.8.2.1.1.7).
bool is_hounsfield(const std::string& rescale_type) {
  return rescale_type.empty() || rescale_type == "HU" || rescale_type.starts_with("Hou") ||
         rescale_type.starts_with("HOU");
}

void warn_of_values(const Headers& files, DicomSeries& series) {
  std::set<std::string> warnings;
  const auto padding_text = [](const DicomFileHeader& header) {
    const auto padding = padding_hu(header.pixels);
    return padding ? number(padding->low) + " to " + number(padding->high) + " HU" : std::string("none");
  };
  for (const DicomFileHeader& header : files) {
    const PixelFormat& pixels = header.pixels;
    if (pixels.photometric == "MONOCHROME1")
      warnings.insert("MONOCHROME1: HU are read as they are, only display is inverted");
    if (!is_hounsfield(pixels.rescale_type)) {
      warnings.insert("Rescale Type is " +
                      known_code(pixels.rescale_type, {"OD", "US", "MGML", "Z_EFF", "ED", "EDW", "HU_MOD", "PCT"}) +
                      ": the values may not be HU");
    }
    const auto stored = stored_padding(pixels);
    if (pixels.padding_word && !stored) {
      warnings.insert("Pixel Padding Value " + std::to_string(*pixels.padding_word) + " does not fit " +
                      std::to_string(pixels.bits_stored) + " stored bits: ignored");
    }
    if (stored && std::min(hu_of(pixels, stored->low), hu_of(pixels, stored->high)) < -32768) {
      warnings.insert("Pixel Padding Value lies below int16 in HU: such voxels become -32768");
    }
    if (padding_text(header) != padding_text(files.front())) {
      warnings.insert("Pixel Padding Value differs from slice to slice, no padding is assumed: " +
                      padding_text(files.front()) + " in " + shown(files.front()) + ", not in all others");
    }
  }
  series.warnings.insert(series.warnings.end(), warnings.begin(), warnings.end());
}

/// Warns of what slices of one volume may differ in but should not.
void warn_of_mixture(const Headers& files, DicomSeries& series) {
  for (const Trait trait : {Trait::kernel, Trait::kvp}) {
    const auto other = std::find_if(files.begin(), files.end(), [&](const DicomFileHeader& header) {
      return trait_of(header, trait) != trait_of(files.front(), trait);
    });
    if (other == files.end()) continue;
    const DicomFileHeader* both[] = {&files.front(), &*other};
    const std::vector<std::string> labels = labels_of(trait, both);
    series.warnings.push_back(name_of(trait) + " differs from slice to slice: " + labels[0] + " in " +
                              shown(files.front()) + ", " + labels[1] + " in " + shown(*other));
  }
}

/// The refusal of a series in which no file is left that could be a slice by its kind.
std::string nothing_left(const DicomSeries& series) {
  const std::size_t count = series.set_aside.size();
  return "no CT slice in the series, " + to_string(series.set_aside.front()) +
         (count > 1 ? " (" + std::to_string(count) + " files)" : std::string()) + "; choose a CT series";
}

/// Takes all steps of `assemble_series` for one volume, in order; each may end in a refusal.
std::optional<std::string> judge(Headers& files, DicomSeries& series) {
  if (auto problem = mixed_orientations(files)) return problem;
  const auto pixels = first_problem(files, pixel_problem);
  if (auto problem = inconsistency(files)) return pixels ? pixels : problem;
  // Set even where pixels are refused, for the geometry is of use without them.
  const auto stack = stack_slices(files, series);
  if (!pixels) warn_of_values(files, series);
  if (!pixels && !stack) warn_of_mixture(files, series);
  return pixels ? pixels : stack;
}

void list_slices(const Headers& files, DicomSeries& series) {
  for (const DicomFileHeader& header : files) {
    DicomSlice slice{header.file, header.sop_instance_uid, header.transfer_syntax_uid, header.instance_number, 0,
                     header.frame};
    if (header.position && header.orientation) {
      slice.position_mm = glm::dot(*header.position, rotation_of(*header.orientation)[2]);
    }
    series.slices.push_back(std::move(slice));
  }
}

DicomSeries refused(DicomSeries series, const Headers& files, const std::string& reason) {
  series.refusal = reason;
  list_slices(files, series);
  return series;
}

DicomSeries judged(SplitVolume& volume, DicomSeries series) {
  series.label = std::move(volume.label);
  series.split_by = std::move(volume.split_by);
  series.refusal = judge(volume.files, series);
  if (series.refusal && !volume.tried.empty()) *series.refusal += " (" + volume.tried + ")";
  list_slices(volume.files, series);
  return series;
}

/// The Modality of files that are kept apart or set aside, if it is one of PS3.3 C.7.3.1.1.1; empty for any other text.
std::string shown_modality(const std::string& modality) {
  static const std::set<std::string> kModalities = {
      "ANN",    "AR",      "ASMT",       "AU",         "BDUS",  "BI",       "BMD",        "CD",       "CF",  "CP",
      "CR",     "CS",      "CT",         "CTPROTOCOL", "DD",    "DF",       "DG",         "DM",       "DOC", "DS",
      "DX",     "EC",      "ECG",        "EEG",        "EMG",   "EOG",      "EPS",        "ES",       "FA",  "FID",
      "FS",     "GM",      "HC",         "HD",         "IO",    "IOL",      "IVOCT",      "IVUS",     "KER", "KO",
      "LEN",    "LP",      "LS",         "M3D",        "MA",    "MG",       "MR",         "MS",       "NM",  "OAM",
      "OCT",    "OP",      "OPM",        "OPR",        "OPT",   "OPTBSV",   "OPTENF",     "OPV",      "OSS", "OT",
      "PA",     "PLAN",    "POS",        "PR",         "PT",    "PX",       "REG",        "RESP",     "RF",  "RG",
      "RTDOSE", "RTIMAGE", "RTINTENT",   "RTPLAN",     "RTRAD", "RTRECORD", "RTSEGANN",   "RTSTRUCT", "RWV", "SEG",
      "SM",     "SMR",     "SR",         "SRF",        "ST",    "STAIN",    "TEXTUREMAP", "TG",       "US",  "VA",
      "VF",     "XA",      "XAPROTOCOL", "XC"};
  return kModalities.contains(modality) ? modality : "";
}

void describe(const Headers& files, DicomSeries& series) {
  const DicomFileHeader& header = files.front();
  series.series_uid = header.series_uid;
  series.study_uid = header.study_uid;
  series.frame_of_reference_uid = header.frame_of_reference_uid;
  series.modality = shown_modality(header.modality);
  series.series_number = header.series_number;
  series.description = shown_description(files);
}

}  // namespace

std::vector<DicomSeries> assemble_series(Headers files, const std::stop_token& stop) {
  std::sort(files.begin(), files.end(), [](const DicomFileHeader& a, const DicomFileHeader& b) {
    return std::tie(a.instance_number, a.file) < std::tie(b.instance_number, b.file);
  });
  DicomSeries series;
  describe(files, series);
  set_other_kinds_aside(files, series);
  if (files.empty()) return {refused(series, files, nothing_left(series))};
  describe(files, series);
  if (const auto problem = drop_copies(files, series, stop)) return {refused(series, files, *problem)};
  if (const auto problem = first_problem(files, geometry_problem)) return {refused(series, files, *problem)};
  set_scouts_aside(files, series);
  std::vector<SplitVolume> volumes = split_volumes(std::move(files));
  series.volumes = volumes.size();
  std::vector<DicomSeries> result;
  for (SplitVolume& volume : volumes) {
    describe(volume.files, series);
    result.push_back(judged(volume, series));
    series.set_aside.clear();
  }
  return result;
}

}  // namespace tetwarp
