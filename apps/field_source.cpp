#include "apps/field_source.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <memory>

#include "deform/fields/formula.h"
#include "io/field_file.h"
#include "io/hash.h"

namespace tetwarp::apps {

namespace {

/// One -f: a formula or a file.
PointMap formula_map(const std::string& text, const Geometry& volume) {
  try {
    return parse_formula(text, volume);
  } catch (const InputError& error) {
    throw UsageError(error.what());
  }
}

VertexField read_file(const std::string& path, std::vector<std::string>& notes) {
  if (!read_field_header(path).direction) notes.push_back(path + " does not say its direction: taken as forward");
  return tetwarp::read_forward_field(path);
}

}  // namespace

void check_fields(const std::vector<std::string>& fields, std::optional<std::int64_t> cell_size) {
  if (fields.empty()) throw UsageError("no field; give -f FIELD or --pull-field FILE");
  Geometry any;
  any.size = glm::i64vec3(2);
  for (const std::string& text : fields) {
    if (is_formula(text)) {
      formula_map(text, any);  // a misspelled one is known before anything is read
    } else if (!std::filesystem::exists(text)) {
      throw UsageError("\"" + text + "\" is neither a formula nor a file that exists; see tetwarp deform --help");
    }
  }
  if (!cell_size) return;
  if (*cell_size < 1) throw UsageError("--cell-size is " + std::to_string(*cell_size) + ", expected at least 1");
  if (!is_formula(fields.front()))
    throw UsageError("--cell-size is for formulas, " + fields.front() + " has its own lattice");
}

std::vector<std::filesystem::path> field_files(const std::vector<std::string>& fields) {
  std::vector<std::filesystem::path> files;
  std::copy_if(fields.begin(), fields.end(), std::back_inserter(files),
               [](const std::string& text) { return std::filesystem::exists(text); });
  return files;
}

glm::i64vec3 lattice_size(const std::vector<std::string>& fields, const Geometry& volume,
                          std::optional<std::int64_t> cell_size) {
  if (is_formula(fields.front())) return lattice_over(volume, cell_size.value_or(1)).size;
  return read_field_header(fields.front()).grid.size;
}

ForwardField read_forward_field(const std::vector<std::string>& fields, const Geometry& volume,
                                std::optional<std::int64_t> cell_size, const CommonOptions& common,
                                const Control& control) {
  check_fields(fields, cell_size);
  const Limits limits{.threads = common.threads};
  ForwardField result;
  result.identity = true;
  for (std::size_t n = 0; n < fields.size(); ++n) {
    const std::string& text = fields[n];
    result.identity = result.identity && text == "identity";
    if (n == 0) {
      result.field = is_formula(text) ? sample_on(lattice_over(volume, cell_size.value_or(1)),
                                                  formula_map(text, volume), limits, control)
                                      : read_file(text, result.notes);
    } else if (is_formula(text)) {
      compose(result.field, formula_map(text, volume), limits, control);
    } else {
      const VertexField next = read_file(text, result.notes);
      compose(result.field, piecewise_affine(next), limits, control);
    }
  }
  return result;
}

std::string hash_field(const Geometry& lattice, const std::vector<glm::vec3>& displacement,
                       const std::string& direction, int threads) {
  const auto bytes_of = [](const auto& value) { return std::as_bytes(std::span(&value, 1)); };
  Sha256 hash;
  hash.add("tetwarp field").add(direction);
  hash.add(bytes_of(lattice.size))
      .add(bytes_of(lattice.spacing))
      .add(bytes_of(lattice.origin))
      .add(bytes_of(lattice.direction));
  return hash.add_blocks(std::as_bytes(std::span(displacement)), threads).hex();
}

}  // namespace tetwarp::apps
