#include "io/dicom_assemble.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <set>

#include "io/dicom_stack.h"
#include "io/dicom_text.h"

namespace tetwarp {
namespace {

using Headers = std::vector<DicomFileHeader>;

std::string orientation_text(const std::array<double, 6>& cosines) {
  std::string text;
  for (const double value : cosines) {
    if (!text.empty()) text += '\\';
    text += number(value);
  }
  return text;
}

/// Round-off of at least four digits: 1e-4 is 0.05 mm at the far end of a 500 mm slice.
bool same_orientation(const DicomFileHeader& a, const DicomFileHeader& b) {
  return std::equal(a.orientation->begin(), a.orientation->end(), b.orientation->begin(),
                    [](double x, double y) { return std::abs(x - y) <= 1e-4; });
}

/// Moves out of `files` what is by its kind no slice, one line each into `series.set_aside`.
void set_other_kinds_aside(Headers& files, DicomSeries& series) {
  std::erase_if(files, [&](const DicomFileHeader& header) {
    const std::string kind = other_kind(header);
    if (!kind.empty()) series.set_aside.push_back(header.file.string() + ": " + kind);
    return !kind.empty();
  });
}

/// The first problem that `judge` finds, and in how many more files it finds one.
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
  if (more > 0) *first += " (" + std::to_string(more) + " more of " + std::to_string(files.size()) + " files likewise)";
  return first;
}

/// Keeps the orientation that at least three quarters of the slices share and sets the others aside (a scout in the
/// series). @return a refusal where none does
std::optional<std::string> keep_one_orientation(Headers& files, DicomSeries& series) {
  const DicomFileHeader* usual = &files.front();
  std::ptrdiff_t usual_count = 0;
  std::vector<const DicomFileHeader*> seen;
  for (const DicomFileHeader& header : files) {
    const auto is_same = [&](const auto* other) { return same_orientation(header, *other); };
    if (std::any_of(seen.begin(), seen.end(), is_same)) continue;
    seen.push_back(&header);
    const auto count =
        std::count_if(files.begin(), files.end(), [&](const auto& f) { return same_orientation(header, f); });
    if (count > usual_count) {
      usual = &header;
      usual_count = count;
    }
  }
  if (seen.size() == 1) return std::nullopt;
  if (usual_count * 4 < std::ssize(files) * 3) {
    return "mixed orientations: " + orientation_text(*seen[0]->orientation) + " in " + seen[0]->file.string() + ", " +
           orientation_text(*seen[1]->orientation) + " in " + seen[1]->file.string() + " (" +
           std::to_string(seen.size()) + " orientations in " + std::to_string(files.size()) +
           " files); put the slices of one orientation in a folder of their own";
  }
  const DicomFileHeader reference = *usual;
  std::erase_if(files, [&](const DicomFileHeader& header) {
    if (same_orientation(header, reference)) return false;
    series.set_aside.push_back(header.file.string() + ": Image Orientation " + orientation_text(*header.orientation) +
                               ", the other slices have " + orientation_text(*reference.orientation));
    return true;
  });
  return std::nullopt;
}

/// What must be the same in all slices. @return a refusal that names the first two files that differ
std::optional<std::string> inconsistency(const Headers& files) {
  const DicomFileHeader& first = files.front();
  const auto differ = [&](const std::string& what, const DicomFileHeader& other, const std::string& expected,
                          const std::string& found) {
    return "mixed " + what + ": " + expected + " in " + first.file.string() + ", " + found + " in " +
           other.file.string() + "; put the slices that belong together in a folder of their own";
  };
  const auto spacing = [](const DicomFileHeader& h) { return number(h.spacing->y) + "\\" + number(h.spacing->x); };
  for (const DicomFileHeader& other : files) {
    const PixelFormat &a = first.pixels, &b = other.pixels;
    if (a.rows != b.rows || a.columns != b.columns) return differ("Rows x Columns", other, size_text(a), size_text(b));
    // 1e-5 is 0.005 mm over 500 mm.
    const glm::dvec2 change = glm::abs(*first.spacing - *other.spacing) / *first.spacing;
    if (change.x > 1e-5 || change.y > 1e-5) return differ("Pixel Spacing", other, spacing(first), spacing(other));
    if (first.frame_of_reference_uid != other.frame_of_reference_uid) {
      return differ("Frame of Reference UID", other, first.frame_of_reference_uid, other.frame_of_reference_uid);
    }
    if (first.study_uid != other.study_uid)
      return differ("Study Instance UID", other, first.study_uid, other.study_uid);
  }
  return std::nullopt;
}

/// Rescale Type (0028,1054) in the standard's word or spelt out; CT without it is HU (PS3.3 C.8.2.1.1.7).
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
      warnings.insert("Rescale Type is " + pixels.rescale_type + ": the values may not be HU");
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
                      padding_text(files.front()) + " in " + files.front().file.string() + ", not in all others");
    }
  }
  series.warnings.insert(series.warnings.end(), warnings.begin(), warnings.end());
}

/// A refusal about kinds: nothing is left that could be a slice.
std::string nothing_left(const DicomSeries& series) {
  const std::size_t count = series.set_aside.size();
  return "no CT slice in the series, " + series.set_aside.front() +
         (count > 1 ? " (" + std::to_string(count) + " files)" : std::string()) + "; choose a CT series";
}

/// All steps in order; each may end in a refusal.
std::optional<std::string> judge(Headers& files, DicomSeries& series) {
  if (auto problem = first_problem(files, geometry_problem)) return problem;
  if (auto problem = keep_one_orientation(files, series)) return problem;
  const auto pixels = first_problem(files, pixel_problem);
  if (auto problem = inconsistency(files)) return pixels ? pixels : problem;
  const auto stack = stack_slices(files, series);  // the geometry is of use even where pixels are not
  if (!pixels) warn_of_values(files, series);
  return pixels ? pixels : stack;
}

}  // namespace

DicomSeries assemble_series(Headers files) {
  DicomSeries series;
  std::sort(files.begin(), files.end(), [](const DicomFileHeader& a, const DicomFileHeader& b) {
    return std::tie(a.instance_number, a.file) < std::tie(b.instance_number, b.file);
  });
  series.series_uid = files.front().series_uid;
  series.study_uid = files.front().study_uid;
  series.frame_of_reference_uid = files.front().frame_of_reference_uid;
  series.modality = files.front().modality;
  set_other_kinds_aside(files, series);
  if (files.empty()) {
    series.refusal = nothing_left(series);
    return series;
  }
  series.study_uid = files.front().study_uid;
  series.frame_of_reference_uid = files.front().frame_of_reference_uid;
  series.modality = files.front().modality;
  series.refusal = judge(files, series);
  for (const DicomFileHeader& header : files) {
    DicomSlice slice{header.file, header.sop_instance_uid, header.transfer_syntax_uid, header.instance_number, 0};
    if (header.position && header.orientation) {
      slice.position_mm = glm::dot(*header.position, rotation_of(*header.orientation)[2]);
    }
    series.slices.push_back(std::move(slice));
  }
  return series;
}

}  // namespace tetwarp
