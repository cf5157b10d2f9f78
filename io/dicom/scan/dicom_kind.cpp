// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/dicom/scan/dicom_kind.h"

#include <glm/common.hpp>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "io/dicom/scan/dicom_stack.h"
#include "io/dicom/scan/dicom_traits.h"
#include "io/dicom_series.h"
#include "io/dicom_text.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

using Headers = std::vector<DicomFileHeader>;

constexpr std::size_t kMostKinds = 64;

/// An attribute, or several, in which kinds of slices may differ.
struct Aspect {
  const char* name;
  bool (*same)(const DicomFileHeader&, const DicomFileHeader&);
  std::string (*text)(const DicomFileHeader&);
};

const std::array<Aspect, 6>& aspects() {
  static const std::array<Aspect, 6> all = {{
      {"Image Orientation (0020,0037)", same_orientation,
       [](const DicomFileHeader& h) { return plane_name(rotation_of(*h.orientation)[2]); }},
      {"Rows x Columns",
       [](const DicomFileHeader& a, const DicomFileHeader& b) {
         return a.pixels.rows == b.pixels.rows && a.pixels.columns == b.pixels.columns;
       },
       [](const DicomFileHeader& h) { return size_text(h.pixels); }},
      {"Pixel Spacing (0028,0030)", same_pixel_spacing,
       [](const DicomFileHeader& h) {
         return "pixels of " + number(h.spacing->y) + " x " + number(h.spacing->x) + " mm";
       }},
      {"Frame of Reference UID (0020,0052)",
       [](const DicomFileHeader& a, const DicomFileHeader& b) {
         return a.frame_of_reference_uid == b.frame_of_reference_uid;
       },
       [](const DicomFileHeader& h) { return "frame of reference " + shown(h.frame_of_reference_uid); }},
      {"Study Instance UID (0020,000D)",
       [](const DicomFileHeader& a, const DicomFileHeader& b) { return a.study_uid == b.study_uid; },
       [](const DicomFileHeader& h) { return "study " + shown(h.study_uid); }},
      {"Stack ID (0020,9056)",
       [](const DicomFileHeader& a, const DicomFileHeader& b) {
         return !a.frame || !b.frame || trait_of(a, Trait::stack) == trait_of(b, Trait::stack);
       },
       [](const DicomFileHeader& h) {
         const DicomFileHeader* const one[] = {&h};
         return labels_of(Trait::stack, one).front();
       }},
  }};
  return all;
}

bool same_kind(const DicomFileHeader& a, const DicomFileHeader& b) {
  return std::all_of(aspects().begin(), aspects().end(), [&](const Aspect& aspect) { return aspect.same(a, b); });
}

/// Whether the kind of `a` comes before that of `b` in a series that holds both. The order depends on the values alone,
/// not on that of the files: what is compared exactly comes first, then axial before coronal before sagittal, and small
/// pixels before large ones.
bool comes_before(const DicomFileHeader& a, const DicomFileHeader& b) {
  const std::string_view stack_a = a.frame ? trait_of(a, Trait::stack) : "",
                         stack_b = b.frame ? trait_of(b, Trait::stack) : "";
  if (stack_a != stack_b) return is_before(Trait::stack, stack_a, stack_b);
  const auto exact = [](const DicomFileHeader& h) {
    return std::tie(h.study_uid, h.frame_of_reference_uid, h.pixels.rows, h.pixels.columns);
  };
  if (exact(a) != exact(b)) return exact(a) < exact(b);
  if (!same_orientation(a, b)) return *a.orientation > *b.orientation;
  return std::tie(a.spacing->x, a.spacing->y) < std::tie(b.spacing->x, b.spacing->y);
}

void name_differences(std::vector<SliceKind>& kinds, const Headers& files) {
  const auto example = [&](const SliceKind& kind) -> const DicomFileHeader& { return files[kind.slices.front()]; };
  for (const Aspect& aspect : aspects()) {
    const auto is_usual = [&](const SliceKind& kind) { return aspect.same(example(kind), files.front()); };
    if (std::all_of(kinds.begin(), kinds.end(), is_usual)) continue;
    for (SliceKind& kind : kinds) {
      kind.label += (kind.label.empty() ? "" : ", ") + aspect.text(example(kind));
      kind.differ_by += (kind.differ_by.empty() ? "" : " and ") + std::string(aspect.name);
    }
  }
  std::set<std::string> labels;
  for (const SliceKind& kind : kinds) labels.insert(kind.label);
  if (labels.size() == kinds.size()) return;
  for (SliceKind& kind : kinds) kind.label += " (" + orientation_text(*example(kind).orientation) + ")";
}

}  // namespace

bool same_orientation(const DicomFileHeader& a, const DicomFileHeader& b) {
  return std::equal(a.orientation->begin(), a.orientation->end(), b.orientation->begin(),
                    [](double x, double y) { return std::abs(x - y) <= 1e-4; });
}

bool same_pixel_spacing(const DicomFileHeader& a, const DicomFileHeader& b) {
  const glm::dvec2 change = glm::abs(*a.spacing - *b.spacing) / *a.spacing;
  return change.x <= 1e-5 && change.y <= 1e-5;
}

std::string orientation_text(const std::array<double, 6>& cosines) {
  std::string text;
  for (const double value : cosines) {
    if (!text.empty()) text += '\\';
    text += number(value);
  }
  return text;
}

std::vector<SliceKind> slice_kinds(const Headers& files) {
  std::vector<SliceKind> kinds;
  for (std::size_t n = 0; n < files.size(); ++n) {
    const auto kind = std::find_if(kinds.begin(), kinds.end(), [&](const SliceKind& one) {
      return same_kind(files[one.slices.front()], files[n]);
    });
    if (kind != kinds.end()) {
      kind->slices.push_back(n);
      continue;
    }
    if (kinds.size() == kMostKinds) return {};
    kinds.push_back({{n}, {}, {}});
  }
  std::stable_sort(kinds.begin(), kinds.end(), [&](const SliceKind& a, const SliceKind& b) {
    return comes_before(files[a.slices.front()], files[b.slices.front()]);
  });
  name_differences(kinds, files);
  return kinds;
}

}  // namespace tetwarp
