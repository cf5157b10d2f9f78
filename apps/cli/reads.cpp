// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/reads.h"

#include "apps/deform/along_structures.h"
#include "apps/deform/along_volumes.h"
#include "apps/deform/field_source.h"
#include "apps/deform/output_grid.h"
#include "apps/deform/points_option.h"
#include "apps/render/render_scene.h"
#include "deform/fields/formula.h"
#include "io/dicom_segmentation.h"
#include "io/image_file.h"
#include "io/transform_file.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;

namespace {

/// Of a DICOM object, which is one file, or of a volume.
void add_along(Reads& reads, const std::string& text) {
  const fs::path path = text.substr(0, text.find('='));
  if (AlongStructures::is_one(text) || is_dicom_segmentation(path))
    reads.add_file(path);
  else
    reads.add_volume(parse_along(text).input);
}

void add_fields(Reads& reads, const std::vector<std::string>& fields, const std::string& pull_field) {
  for (const std::string& text : fields) reads.add_field(text);
  if (!pull_field.empty()) reads.add_field(pull_field);
}

void add_overlay(Reads& reads, const std::string& text) {
  const OverlayWish wish = overlay_wish(text);
  if (wish.source.empty()) return;
  if (wish.kind == OverlayKind::lattice)
    reads.add_field(wish.source);
  else
    reads.add_file(wish.source);
}

}  // namespace

void Reads::add_file(const fs::path& path) {
  all_.push_back({{.path = path, .series = {}}, false});
  paths_.push_back(path);
}

void Reads::add_volume(const InputOptions& volume) {
  all_.push_back({volume, true});
  paths_.push_back(volume.path);
}

void Reads::add_field(const std::string& text) {
  if (is_formula(text)) return;
  const FieldSource source = field_source(text);
  add_file(source.path);
  if (source.options.contains("deformed")) add_file(source.option("deformed"));
  if (!is_transform_file(source.path)) return;
  try {
    const std::vector<fs::path> files = files_of_transform(source.path);
    for (std::size_t n = 1; n < files.size(); ++n) add_file(files[n]);
  } catch (const Error&) {  // whoever reads it says why, and nothing is written
  }
}

std::vector<fs::path> Reads::slices(const InputOptions& opened, const InputHeader& header) const {
  std::vector<fs::path> files;
  const auto add = [&](const InputHeader& of) {
    if (!of.series) return;
    for (const DicomSlice& slice : of.series->slices) {
      if (files.empty() || files.back() != slice.file) files.push_back(slice.file);
    }
  };
  for (const One& one : all_) {
    if (!one.is_volume) continue;
    if (one.volume == opened)
      add(header);
    else if (!has_image_suffix(one.volume.path))
      add(open_input(one.volume, {.stop = interrupt_token()}, true));
  }
  return files;
}

std::vector<std::string> Reads::digests(int threads) const {
  std::vector<std::string> digests;
  for (const One& one : all_)
    digests.push_back(one.is_volume ? hash_volume(one.volume, threads) : hash_file(one.volume.path));
  return digests;
}

Reads other_reads_of(const DeformOptions& options) {
  Reads reads;
  add_fields(reads, options.fields, options.pull_field);
  if (!options.scenario.empty()) reads.add_file(options.scenario);
  if (!options.labels.empty()) reads.add_volume({.path = options.labels, .series = {}});
  for (const std::string& text : options.with) add_along(reads, text);
  if (names_volume(options.grid)) reads.add_volume(grid_volume(options.grid));
  for (const fs::path& path : PointsOption(options.points).inputs()) reads.add_file(path);
  if (!options.deidentify_key.empty()) reads.add_file(options.deidentify_key);
  return reads;
}

Reads reads_of(const DeformOptions& options) {
  Reads reads = other_reads_of(options);
  reads.add_volume(options.input);
  return reads;
}

Reads reads_of(const FieldOptions& options) {
  Reads reads;
  add_fields(reads, options.fields, "");
  reads.add_volume(options.like);
  return reads;
}

Reads reads_of(const InvertOptions& options) {
  Reads reads;
  add_fields(reads, options.fields, options.pull_field);
  reads.add_volume(options.like);
  return reads;
}

Reads reads_of(const SimulateOptions& options) {
  Reads reads;
  reads.add_file(options.scenario);
  if (!options.labels.empty()) reads.add_volume({.path = options.labels, .series = {}});
  reads.add_volume(options.input);
  return reads;
}

Reads reads_of(const RenderOptions& options) {
  Reads reads;
  add_fields(reads, options.fields, options.pull_field);
  add_fields(reads, options.sequence, "");
  if (is_transfer_file(options)) reads.add_file(options.transfer);
  for (const std::string& text : options.overlays) add_overlay(reads, text);
  reads.add_volume(options.input);
  return reads;
}

std::string hash_volume(const InputOptions& volume, int threads) {
  const Control stop{.stop = interrupt_token()};
  if (has_image_suffix(volume.path)) return hash_file(volume.path);
  const InputHeader header = open_input(volume, stop, true);
  return header.series ? hash_files(*header.series, threads, stop) : hash_file(volume.path);
}

}  // namespace tetwarp::apps
