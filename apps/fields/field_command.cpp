// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/fields/read_field.h"
#include "io/field_file.h"
#include "io/image_file.h"

namespace tetwarp::apps {

int run_field(const FieldCommandOptions& options) {
  if (!has_image_suffix(options.output)) {
    throw UsageError("unknown suffix of \"" + options.output.string() +
                     "\"; a field is written as .mha .nrrd .nii .nii.gz");
  }
  const ForwardChoice choice =
      parse_forward_fields(options.field.forward, options.field.cell_size, options.common.nifti_frame);
  const Reads reads = reads_of(choice, options.like);
  OutputSet outputs(reads, options.common.overwrite);
  const std::filesystem::path output = outputs.add(options.output);
  Stage stage(options.common, "field");
  const InputHeader like = open_input(options.like, options.common);
  outputs.add_reads(reads.slices(options.like, like));
  const ReadForwardField source = read_field(choice, like.geometry, options.common.threads, stage.control());
  require(source.field.mesh.is_empty(),
          "a mesh, " + choice.fields.front().text +
              ", has no lattice that a field file could hold; give it to deform or invert");
  outputs.write([&] { write_field_file(output, source.field); });
  outputs.commit();
  for (const std::string& note : like.notes) say(options.common, "tetwarp: note: " + note);
  for (const std::string& note : source.origin.notes) say(options.common, "tetwarp: note: " + note);
  say(options.common,
      "wrote " + options.output.string() + ": forward field, " + to_string(source.field.lattice.size) + " vertices");
  return 0;
}

}  // namespace tetwarp::apps
