// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "apps/cli/options.h"
#include "deform/fields/point_map.h"
#include "io/field_file.h"

namespace tetwarp::apps {

// What -f and --pull-field name. A text is parsed once, by the functions at the end of this page; all others take the
// value that comes of it: what it reads and what it is called (below), its size and its vectors (read_field.h).

/// A formula, whose parameters are right; its text says it all.
struct NamedFormula {};
/// A file of displacements on a grid. A file of no known kind is taken for one too, and refused when it is read.
struct NamedLattice {
  FieldSource file;
};
/// A file of a mesh whose vertices are displaced.
struct NamedMesh {
  FieldSource file;
};
/// A file of a transform that another program wrote.
struct NamedTransform {
  FieldSource file;
};

/// One field as the command line names it. Of a file no more is known than what tells its kind.
struct NamedField {
  std::string text;  ///< as it was given: what sidecars record
  std::variant<NamedFormula, NamedLattice, NamedMesh, NamedTransform> what;
};

/// The file of a field with the options behind its name; null: it is a formula or a transform.
const FieldSource* source_of(const NamedField& field);

/// Forward fields, applied one after the other: those of -f.
struct ForwardChoice {
  std::vector<NamedField> fields;         ///< at least one; files exist; a mesh is the first or none
  std::optional<std::int64_t> cell_size;  ///< of a lattice over the volume; none where the first has its own vertices
};

/// Fields that map output to input, each point going through one after the other: those of --pull-field. They are
/// files, which need not exist.
struct PullChoice {
  std::vector<NamedField> fields;  ///< at least one, no mesh
};
/// Their texts: "1Warp.nii.gz, then 0GenericAffine.mat".
std::string text_of(const PullChoice& choice);

/// The field of a command, in either direction.
using FieldChoice = std::variant<ForwardChoice, PullChoice>;

/// The map of a formula on a volume, which gives its centre and the unit `vox`.
/// @throws UsageError for parameters that do not go with the volume
PointMap formula_map(const NamedField& formula, const Geometry& volume);

/// The files that a field is read from: none of a formula, of a mesh also that of its deformed places, of a transform
/// also the initial ones of elastix.
std::vector<std::filesystem::path> files_of(const NamedField& field);
/// Those of all fields, in their order.
std::vector<std::filesystem::path> files_of(const FieldChoice& field);

/// Fields by name, files without their folders: "wave:amplitude=8, then twist.mha", "pull field inverse.mha".
std::string title_of(const FieldChoice& field);
/// Title for a de-identified volume: formulas, and that there was a file, but not its name; "deformed" of a pull field.
std::string title_without_names(const FieldChoice& field);

/// A file with the options behind its name as one text: what `parse_field_source` parses.
std::string text_of(const FieldSource& source);

/// A file with the options behind its name, `PATH` or `PATH:KEY=VALUE,...`: a field, or whatever else `info` is given.
/// It need not exist. @throws UsageError for options that do not go with it
FieldSource parse_field_file(const std::string& text, NiftiFrame frame);

/// @throws UsageError for no text at all; one that is no formula and no file, or has wrong parameters or options; a
/// mesh that is not the first; a cell size below 1, or for a first field with vertices of its own
ForwardChoice parse_forward_fields(const std::vector<std::string>& texts, std::optional<std::int64_t> cell_size,
                                   NiftiFrame frame);
/// Fields one after the other, each by itself: those of --sequence. @throws UsageError as the function above
std::vector<ForwardChoice> parse_sequence(const std::vector<std::string>& texts, std::optional<std::int64_t> cell_size,
                                          NiftiFrame frame);
/// @throws UsageError for no text at all; options that do not go with the file
/// @throws InputError for a mesh, which is a forward field
PullChoice parse_pull_fields(const std::vector<std::string>& texts, NiftiFrame frame);
/// The one that was given. @throws UsageError for none, and as the two above
FieldChoice parse_field(const FieldArguments& given, NiftiFrame frame);

/// A text of -f with other names of its files, for a command that runs elsewhere; a formula stays as it is.
/// @param renamed  gives the other name of a file
/// @throws InputError for options that are not KEY=VALUE
std::string with_files_renamed(const std::string& text, const std::function<std::string(const std::string&)>& renamed);

}  // namespace tetwarp::apps
