// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/fields/field_choice.h"

#include "deform/fields/formula.h"
#include "io/mesh_file.h"
#include "io/opened_file.h"
#include "io/transform_file.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;

namespace {

/// What is wrong with a text is a mistake of the command line, not of an input.
template <class Call>
auto as_usage(Call&& call) {
  try {
    return call();
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
}

/// A formula whose parameters are right on a volume of any size.
NamedField parse_named_formula(const std::string& text) {
  Geometry any;
  any.size = glm::i64vec3(2);
  NamedField formula{text, NamedFormula{}};
  formula_map(formula, any);
  return formula;
}

/// The file of a field, whatever it holds; null: it is a formula.
const FieldSource* file_of(const NamedField& field) {
  const auto* transform = std::get_if<NamedTransform>(&field.what);
  return transform ? &transform->file : source_of(field);
}

/// The field that a text names which is no formula: a file, with its options.
NamedField parse_named_file(const std::string& text, NiftiFrame frame) {
  FieldSource file = as_usage([&] { return parse_field_source(text); });
  file.nifti_frame = frame;
  const bool is_mesh = is_mesh_file(file.path);  // a file that cannot be read is no mistake of the command line
  if (is_transform_file(file.path)) {
    as_usage([&] { check_transform_options(file); });
    return {text, NamedTransform{std::move(file)}};
  }
  if (is_mesh) {
    as_usage([&] { check_mesh_options(file); });
    return {text, NamedMesh{std::move(file)}};
  }
  as_usage([&] { check_field_options(file); });
  return {text, NamedLattice{std::move(file)}};
}

NamedField parse_forward_field(const std::string& text, NiftiFrame frame) {
  if (is_formula(text)) return parse_named_formula(text);
  NamedField file = parse_named_file(text, frame);
  if (kind_at(file_of(file)->path) == PathKind::nothing)
    throw UsageError("\"" + text + "\" is neither a formula nor a file that exists; see tetwarp deform --help");
  return file;
}

/// What a field is called: a formula by its text, a file without its folder.
std::string title_of(const NamedField& field) {
  const FieldSource* file = file_of(field);
  return file ? file->path.filename().string() : field.text;
}

template <class Title>
std::string joined(const std::vector<NamedField>& fields, Title&& title) {
  std::string text;
  for (const NamedField& field : fields) text += (text.empty() ? "" : ", then ") + title(field);
  return text;
}

}  // namespace

const FieldSource* source_of(const NamedField& field) {
  if (const auto* lattice = std::get_if<NamedLattice>(&field.what)) return &lattice->file;
  if (const auto* mesh = std::get_if<NamedMesh>(&field.what)) return &mesh->file;
  return nullptr;
}

PointMap formula_map(const NamedField& formula, const Geometry& volume) {
  return as_usage([&] { return parse_formula(formula.text, volume); });
}

std::vector<fs::path> files_of(const NamedField& field) {
  if (const auto* transform = std::get_if<NamedTransform>(&field.what)) {
    try {
      return files_of_transform(transform->file);
    } catch (const Error&) {  // whoever reads it says why, and nothing is written
      return {transform->file.path};
    }
  }
  const FieldSource* file = source_of(field);
  if (!file) return {};
  std::vector<fs::path> files = {file->path};
  for (const char* key : kFileOptions) {
    if (file->options.contains(key)) files.emplace_back(file->option(key));
  }
  return files;
}

std::vector<fs::path> files_of(const FieldChoice& field) {
  const auto* pull = std::get_if<PullChoice>(&field);
  std::vector<fs::path> files;
  for (const NamedField& one : pull ? pull->fields : std::get<ForwardChoice>(field).fields) {
    for (fs::path& file : files_of(one)) files.push_back(std::move(file));
  }
  return files;
}

std::string title_of(const FieldChoice& field) {
  const auto title = [](const NamedField& one) { return title_of(one); };
  if (const auto* pull = std::get_if<PullChoice>(&field)) return "pull field " + joined(pull->fields, title);
  return joined(std::get<ForwardChoice>(field).fields, title);
}

std::string title_without_names(const FieldChoice& field) {
  if (std::holds_alternative<PullChoice>(field)) return "deformed";
  return joined(std::get<ForwardChoice>(field).fields, [](const NamedField& one) {
    return std::holds_alternative<NamedFormula>(one.what) ? one.text : std::string("a field of a file");
  });
}

std::string text_of(const FieldSource& source) {
  std::string text = source.path.string(), before = ":";
  for (const auto& [key, value] : source.options) {
    text.append(before).append(key).append("=").append(value);
    before = ",";
  }
  return text;
}

FieldSource parse_field_file(const std::string& text, NiftiFrame frame) {
  return *file_of(parse_named_file(text, frame));
}

ForwardChoice parse_forward_fields(const std::vector<std::string>& texts, std::optional<std::int64_t> cell_size,
                                   NiftiFrame frame) {
  if (texts.empty()) throw UsageError("no field; give -f FIELD or --pull-field FILE");
  ForwardChoice parsed{{}, cell_size};
  for (const std::string& text : texts) parsed.fields.push_back(parse_forward_field(text, frame));
  for (std::size_t n = 1; n < texts.size(); ++n) {
    if (std::holds_alternative<NamedMesh>(parsed.fields[n].what)) {
      throw UsageError("the mesh " + texts[n] +
                       " comes after another field, but moves its own vertices alone; let it be the first -f");
    }
  }
  if (!cell_size) return parsed;
  if (*cell_size < 1) throw UsageError("--cell-size is " + std::to_string(*cell_size) + ", expected at least 1");
  if (source_of(parsed.fields.front()))
    throw UsageError("--cell-size is for formulas and transforms, " + texts.front() + " has its own vertices");
  return parsed;
}

std::vector<ForwardChoice> parse_sequence(const std::vector<std::string>& texts, std::optional<std::int64_t> cell_size,
                                          NiftiFrame frame) {
  std::vector<ForwardChoice> sequence;
  for (const std::string& text : texts) sequence.push_back(parse_forward_fields({text}, cell_size, frame));
  return sequence;
}

std::string text_of(const PullChoice& choice) {
  return joined(choice.fields, [](const NamedField& one) { return one.text; });
}

PullChoice parse_pull_fields(const std::vector<std::string>& texts, NiftiFrame frame) {
  if (texts.empty()) throw UsageError("no field; give --pull-field FILE");
  PullChoice parsed;
  for (const std::string& text : texts) {
    parsed.fields.push_back(parse_named_file(text, frame));
    if (std::holds_alternative<NamedMesh>(parsed.fields.back().what))
      throw InputError("a mesh, " + text + ", says where its vertices go; give it with -f");
  }
  return parsed;
}

FieldChoice parse_field(const FieldArguments& given, NiftiFrame frame) {
  if (!given.pull.empty()) return parse_pull_fields(given.pull, frame);
  return parse_forward_fields(given.forward, given.cell_size, frame);
}

std::string with_files_renamed(const std::string& text, const std::function<std::string(const std::string&)>& renamed) {
  if (is_formula(text)) return text;
  const std::string other = renamed(text);
  FieldSource source = parse_field_source(other);
  bool has_files = false;
  for (const char* key : kFileOptions) {
    if (!source.options.contains(key)) continue;
    source.options[key] = renamed(source.options[key]);
    has_files = true;
  }
  if (!has_files) return other;
  return text_of(source);
}

}  // namespace tetwarp::apps
