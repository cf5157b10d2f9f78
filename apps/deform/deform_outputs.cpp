// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/deform/deform_outputs.h"

#include "io/opened_file.h"

namespace tetwarp::apps {

namespace {

std::filesystem::path folder_of(const std::filesystem::path& file) {
  return file.has_parent_path() ? file.parent_path() : std::filesystem::path(".");
}

template <class Choice>
std::vector<std::filesystem::path> add_all(const std::vector<Choice>& choices, OutputSet& set) {
  std::vector<std::filesystem::path> staged;
  for (const Choice& choice : choices) staged.push_back(set.add(choice.output));
  return staged;
}

}  // namespace

DeformOutputs begin_outputs(const DeformRequest& request) {
  const DeformOptions& options = request.options;
  const bool only_look = options.dry_run && !options.folder.empty();
  DeformOutputs outputs{OutputSet(request.reads, options.common.overwrite, options.folder, only_look)};
  OutputSet& set = outputs.set;
  // The series of a single file is read from its folder, so a derived series must not land there. What is not there is
  // no file: who reads it says so.
  if (request.series && !options.input.single && is_file(options.input.path))
    set.add_reads({folder_of(options.input.path)});
  outputs.volume = set.add(options.output, request.series ? StagedOutput::Kind::folder : StagedOutput::Kind::file);
  outputs.sidecar = set.add(sidecar_of(options.output));
  if (options.bids) outputs.bids = set.add(bids_sidecar_of(options.output));
  outputs.maps.coverage = set.add(options.maps.coverage);
  outputs.maps.inverse = set.add(options.maps.inverse);
  outputs.maps.jacobian = set.add(options.maps.jacobian);
  outputs.maps.folds = set.add(options.maps.folds);
  outputs.volumes = add_all(request.volumes, set);
  outputs.structures = add_all(request.structures, set);
  outputs.field = set.add(options.write_field);
  outputs.report = set.add(options.report);
  outputs.preview = set.add(options.preview);
  outputs.points = add_all(request.points, set);
  return outputs;
}

}  // namespace tetwarp::apps
