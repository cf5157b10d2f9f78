// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/manifest.h"

#include <algorithm>
#include <cctype>
#include <optional>
#include <set>

#include "apps/batch/draw.h"
#include "apps/batch/manifest_rows.h"
#include "apps/batch/output_folder.h"
#include "apps/cli/command_line.h"
#include "apps/cli/reads.h"
#include "apps/deform/deform_request.h"
#include "deform/text/text_number.h"
#include "io/edit_distance.h"
#include "io/lower_case.h"
#include "io/opened_file.h"
#include "io/scenario_file.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace fs = std::filesystem;

namespace {

constexpr std::size_t kMostCases = 100000;
const std::set<std::string> kOwnKeys = {"case", "input", "seed", "variants", "comment"};
const std::set<std::string> kOfTheBatch = {"threads", "device", "memory", "overwrite", "quiet", "verbose", "dry-run"};
const std::set<std::string> kInputs = {"scenario", "labels", "deidentify-key"};
const std::set<std::string> kOutputs = {"output", "coverage", "inverse", "jacobian",
                                        "folds",  "preview",  "report",  "write-field"};

const std::vector<OptionKind>& known_options() {
  static const std::vector<OptionKind> options = deform_options();
  return options;
}

const OptionKind* option_named(const std::string& name) {
  const auto found = std::find_if(known_options().begin(), known_options().end(),
                                  [&](const OptionKind& option) { return option.name == name; });
  return found == known_options().end() ? nullptr : &*found;
}

bool is_list(const std::string& key) {
  const OptionKind* const option = option_named(key);
  return option && option->list;
}

std::string nearest_key(const std::string& key) {
  const std::vector<std::string> keys = manifest_keys();
  const auto nearest = std::min_element(keys.begin(), keys.end(), [&](const std::string& a, const std::string& b) {
    return edit_distance(a, key) < edit_distance(b, key);
  });
  return edit_distance(*nearest, key) <= std::max<std::size_t>(2, key.size() / 3) ? "; is \"" + *nearest + "\" meant?"
                                                                                  : "; see docs/reference/batch.md";
}

/// Why an id cannot be the name of a folder on every system; empty: it can.
std::string problem_of_id(const std::string& id) {
  if (id.empty()) return "no case id; give each row one";
  if (!is_plain_name(id)) {
    return "the case id \"" + shown(id.substr(0, kLongestName)) +
           "\" cannot be a folder's name everywhere; letters, digits, '.', '_' and '-' are allowed, at most 100, "
           "a letter or digit first";
  }
  if (is_file_of_a_batch(id))
    return "the case id \"" + id + "\" is the name of a file of the batch's own; choose another";
  return "";
}

template <class Number>
Number whole_number(const ManifestRow& row, const std::string& key, Number least, Number most) {
  const std::string text = row.text(key);
  const auto number = number_from<Number>(text);
  require(number && *number >= least && *number <= most, key + " is \"" + shown(text) + "\"; a whole number from " +
                                                             std::to_string(least) + " to " + std::to_string(most) +
                                                             " is expected");
  return *number;
}

/// The folders to which the paths of a row are relative.
struct Places {
  fs::path inputs;   ///< the folder of the manifest
  fs::path outputs;  ///< the folder of the case
};

/// The path of an input, which is relative to the manifest's folder. A ".." is left to the system, which follows links
/// first.
std::string input(const std::string& text, const Places& places) {
  fs::path plain;
  for (const fs::path& part : places.inputs / text) {
    if (part != ".") plain /= part;
  }
  const std::string path = plain.empty() ? "." : plain.string();
  return path.starts_with('-') ? "./" + path : path;
}

/// The path of an output, a name in the case's folder. @param text  the name; for `with` and `points` with options
/// behind it
std::string output(const std::string& key, const std::string& text, const Places& places) {
  const std::string name = text.substr(0, text.find(':'));
  require(!name.empty() && fs::path(name).filename() == name && !name.starts_with('.'),
          key + " is \"" + shown(name) + "\"; a name in the folder of the case is expected, no path");
  return (places.outputs / text).string();
}

std::string value_of(const std::string& key, const std::string& text, const Places& places) {
  if (key == "field" || key == "pull-field")
    return with_files_renamed(text, [&](const std::string& file) { return input(file, places); });
  if (key == "grid") return text == "same" || text == "fit" ? text : input(text, places);
  if (kInputs.contains(key)) return input(text, places);
  if (kOutputs.contains(key)) return output(key, text, places);
  if (key != "with" && key != "points") return text;
  const std::size_t equals = text.find('=');
  require(equals != std::string::npos, key + " is \"" + shown(text) + "\"; IN=OUT is expected");
  return input(text.substr(0, equals), places) + "=" + output(key, text.substr(equals + 1), places);
}

/// Reads one manifest.
class Reader {
 public:
  Reader(const fs::path& manifest, const fs::path& output_dir)
      : base_(manifest.parent_path()), output_dir_(output_dir), errors_(manifest) {}

  std::vector<BatchCase> read(const fs::path& manifest);

 private:
  void take(const ManifestRow& row);
  void take_variant(const ManifestRow& row, const std::string& id, std::uint64_t variant);
  static std::vector<std::string> arguments_of(const ManifestRow& row, const Places& places, std::uint64_t variant);
  bool check_keys(const ManifestRow& row);
  static void check_files(const DeformOptions& options);

  fs::path base_, output_dir_;
  ManifestErrors errors_;
  std::set<std::string> ids_;  ///< ids so far, in lower case
  std::vector<BatchCase> cases_;
};

std::vector<std::string> Reader::arguments_of(const ManifestRow& row, const Places& places, std::uint64_t variant) {
  std::vector<std::string> arguments = {input(row.text("input"), places)};
  const std::uint64_t seed = row.has("seed") ? whole_number<std::uint64_t>(row, "seed", 0, UINT64_MAX) : 0;
  for (const OptionKind& option : known_options()) {  // in one order, whatever the order of the columns
    std::vector<std::string> values = row.has(option.name) ? row.values.at(option.name) : std::vector<std::string>();
    if (option.name == "output" && values.empty()) values = {"deformed.nii.gz"};
    for (std::size_t n = 0; n < values.size(); ++n) {
      if (option.flag) {
        const std::string truth = lower(values[n]);
        if (truth == "true" || truth == "1" || truth == "yes")
          arguments.push_back("--" + option.name);
        else
          require(truth == "false" || truth == "0" || truth == "no",
                  option.name + " is \"" + shown(values[n]) + "\"; true or false is expected");
        continue;
      }
      std::string value = values[n];
      if (option.name == "field" && is_random(value)) {
        require(row.has("seed"), "\"" + shown(value) + "\" is drawn at random; give the row a seed");
        value = draw(value, seed, variant, n);
      }
      arguments.push_back("--" + option.name + "=" + value_of(option.name, value, places));
    }
  }
  return arguments;
}

void Reader::check_files(const DeformOptions& options) {
  const auto exists = [](const fs::path& path) {
    require(kind_at(path) != PathKind::nothing,
            "no such file or folder, " + shown(path) + "; paths are relative to the manifest");
  };
  exists(options.input.path);
  if (!options.scenario.empty()) {
    exists(options.scenario);
    read_scenario(options.scenario);  // a page that cannot be read is found before any case begins
  }
  const Reads others = other_reads_of(options, parse_sources(options));
  for (const fs::path& path : others.paths()) exists(path);
}

void Reader::take_variant(const ManifestRow& row, const std::string& id, std::uint64_t variant) {
  if (!ids_.insert(lower(id)).second) {
    return errors_.add(
        row.line, "the case id \"" + id + "\" is taken, in upper or lower case; two cases would have the same folder");
  }
  const fs::path folder = output_dir_ / id;
  try {
    BatchCase of;
    of.id = id;
    of.line = row.line;
    of.arguments = arguments_of(row, {base_, folder}, variant);
    of.row = arguments_of(row, {}, variant);
    of.options = parse_deform(of.arguments);
    of.options.folder = folder;
    if (variant == 0) check_files(of.options);
    cases_.push_back(std::move(of));
  } catch (const Error& error) {
    errors_.add(row.line, error.what());
  } catch (const fs::filesystem_error& error) {  // a name that is too long, or a folder that may not be looked into
    errors_.add(row.line, "cannot be looked at (" + error.code().message() + "), " + shown(error.path1()));
  }
}

bool Reader::check_keys(const ManifestRow& row) {
  bool good = true;
  const auto refuse = [&](const std::string& what) {
    errors_.add(row.line, what);
    good = false;
  };
  for (const auto& [key, values] : row.values) {
    const auto is_cut = [](const std::string& value) { return value.find('\0') != std::string::npos; };
    if (std::ranges::any_of(values, is_cut)) refuse("\"" + shown(key) + "\" holds a NUL character; take it out");
    if (kOfTheBatch.contains(key))
      refuse("\"" + key + "\" is for the whole batch, not for a case; take it out");
    else if (!kOwnKeys.contains(key) && !option_named(key))
      refuse("unknown key \"" + shown(key) + "\"" + nearest_key(key));
  }
  if (const std::string problem = problem_of_id(row.text("case")); !problem.empty()) refuse(problem);
  if (!row.has("input")) refuse("no input; give the row one");
  if (row.has("field") + row.has("pull-field") + row.has("scenario") != 1)
    refuse("one of field, pull-field and scenario is expected");
  return good;
}

void Reader::take(const ManifestRow& row) {
  if (!check_keys(row)) return;
  const std::string id = row.text("case");
  if (!row.has("variants")) return take_variant(row, id, 0);
  try {
    const auto variants = whole_number<std::uint64_t>(row, "variants", 1, kMostCases);
    const std::size_t width = std::to_string(variants).size();
    for (std::uint64_t variant = 0; variant < variants; ++variant) {
      std::string number = std::to_string(variant + 1);
      number.insert(0, width - number.size(), '0');
      take_variant(row, id + "-" + number, variant);
      if (cases_.size() > kMostCases) throw InputError("more than 100000 cases; divide the manifest");
    }
  } catch (const Error& error) {
    errors_.add(row.line, error.what());
  }
}

std::vector<BatchCase> Reader::read(const fs::path& manifest) {
  const std::vector<ManifestRow> rows = read_rows(manifest, is_list, errors_);
  for (const ManifestRow& row : rows) take(row);
  errors_.throw_if_any();
  require(!cases_.empty(), "no case in the manifest, " + shown(manifest));
  return std::move(cases_);
}

}  // namespace

std::vector<std::string> command_of(const BatchCase& of) {
  std::vector<std::string> command = {"deform"};
  command.insert(command.end(), of.arguments.begin(), of.arguments.end());
  return command;
}

std::vector<std::string> manifest_keys() {
  std::vector<std::string> keys(kOwnKeys.begin(), kOwnKeys.end());
  for (const OptionKind& option : known_options()) {
    if (!kOfTheBatch.contains(option.name)) keys.push_back(option.name);
  }
  return keys;
}

std::vector<BatchCase> read_manifest(const fs::path& manifest, const fs::path& output_dir) {
  return Reader(manifest, output_dir).read(manifest);
}

}  // namespace tetwarp::apps
