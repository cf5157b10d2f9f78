// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/reads.h"

#include "io/image_file.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;

void Reads::add_file(const fs::path& path) {
  all_.push_back({volume_named(path), false});
  paths_.push_back(path);
}

void Reads::add_volume(const InputOptions& volume) {
  all_.push_back({volume, true});
  paths_.push_back(volume.path);
}

void Reads::add_field(const FieldChoice& field) {
  for (const fs::path& file : files_of(field)) add_file(file);
}

std::vector<fs::path> Reads::slices(const InputOptions& opened, const InputHeader& header) const {
  std::vector<fs::path> files;
  const auto add = [&](const InputHeader& of) {
    if (!of.series) return;
    for (const DicomSlice& slice : of.series->slices) {
      if (files.empty() || files.back() != slice.file) files.push_back(slice.file);
    }
  };
  for (const Input& input : all_) {
    if (!input.is_volume) continue;
    if (input.volume == opened)
      add(header);
    else if (!has_image_suffix(input.volume.path))
      add(open_input(input.volume, {.stop = interrupt_token()}, true));
  }
  return files;
}

std::vector<std::string> Reads::digests(int threads) const {
  std::vector<std::string> digests;
  for (const Input& input : all_)
    digests.push_back(input.is_volume ? hash_volume(input.volume, threads) : hash_file(input.volume.path));
  return digests;
}

Reads reads_of(const FieldChoice& field, const InputOptions& volume) {
  Reads reads;
  reads.add_field(field);
  reads.add_volume(volume);
  return reads;
}

Reads reads_of(const SimulateOptions& options) {
  Reads reads;
  reads.add_file(options.scenario);
  if (!options.labels.empty()) reads.add_volume(volume_named(options.labels));
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
