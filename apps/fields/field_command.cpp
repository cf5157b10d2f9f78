// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/deform/field_source.h"
#include "io/field_file.h"
#include "io/image_file.h"

namespace tetwarp::apps {

int run_field(const FieldOptions& options) {
  if (!has_image_suffix(options.output)) {
    throw UsageError("unknown suffix of \"" + options.output.string() +
                     "\"; a field is written as .mha .nrrd .nii .nii.gz");
  }
  check_fields(options.fields, options.cell_size);
  const Reads reads = reads_of(options);
  OutputSet outputs(reads, options.common.overwrite);
  const std::filesystem::path output = outputs.add(options.output);
  Stage stage(options.common, "field");
  const InputHeader like = open_input(options.like, options.common);
  outputs.add_reads(reads.slices(options.like, like));
  const ForwardField source =
      read_forward_field(options.fields, like.geometry, options.cell_size, options.common, stage.control());
  require(source.field.mesh.is_empty(),
          "a mesh, " + options.fields.front() +
              ", has no lattice that a field file could hold; give it to deform or invert");
  outputs.write([&] { write_field_file(output, source.field); });
  outputs.commit();
  for (const std::string& note : like.notes) say(options.common, "tetwarp: note: " + note);
  for (const std::string& note : source.notes) say(options.common, "tetwarp: note: " + note);
  say(options.common,
      "wrote " + options.output.string() + ": forward field, " + to_string(source.field.lattice.size) + " vertices");
  return 0;
}

}  // namespace tetwarp::apps
