// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "itkbridge/transform_file.h"

#include <algorithm>
#include <fstream>

#include "deform/errors.h"
#include "deform/text/text_number.h"
#include "itkbridge/transforms/elastix_parameters.h"
#include "itkbridge/transforms/matlab_record.h"
#include "itkbridge/transforms/parameter_file.h"
#include "itkbridge/transforms/plastimatch_spline.h"

namespace tetwarp {
namespace {

constexpr std::string_view kHdf5 = "\x89HDF\r\n\x1a\n", kText = "#Insight Transform File V1.0";

std::string first_bytes(const std::filesystem::path& path) {
  std::error_code ignored;  // set for a name that no file can have
  require(std::filesystem::is_regular_file(path, ignored),
          "not a file, " + path.string() + "; expected a transform file");
  std::ifstream file(path, std::ios::binary);
  std::string bytes(kText.size(), '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

/// Reads ITK's text: for each transform a line `Transform: CLASS`, and its lines `Parameters:` and `FixedParameters:`
/// in either order.
class TextReader {
 public:
  explicit TextReader(const std::filesystem::path& path) : file_(path.string()), stream_(path, std::ios::binary) {}

  std::vector<TransformRecord> read() {
    for (std::string line; std::getline(stream_, line);) {
      ++line_;
      if (const std::string_view text = trimmed(line); !text.empty() && text.front() != '#') read_line(text);
    }
    end_record();
    return std::move(records_);
  }

 private:
  void read_line(std::string_view text) {
    const auto colon = text.find(':');
    const std::string_view key = trimmed(text.substr(0, colon));
    const std::string where = "line " + std::to_string(line_) + " of " + file_;
    const bool fixed = key == "FixedParameters";
    require(colon != std::string_view::npos && (key == "Transform" || key == "Parameters" || fixed),
            "\"" + std::string(key.substr(0, 60)) + "\" in " + where +
                "; expected Transform:, Parameters: or FixedParameters:");
    const std::string_view value = trimmed(text.substr(colon + 1));
    if (key == "Transform") {
      end_record();
      records_.push_back({std::string(value), {}, {}});
      return;
    }
    bool& seen = fixed ? has_fixed_ : has_parameters_;
    require(!records_.empty() && !seen, std::string(key) + " without a transform, or twice, in " + where);
    seen = true;
    (fixed ? records_.back().fixed : records_.back().parameters) =
        parse_numbers(value, std::string(key) + " in " + where);
  }

  void end_record() {
    if (!records_.empty() && !records_.back().type.starts_with("CompositeTransform")) {
      require(has_fixed_ && has_parameters_, "no " + std::string(has_parameters_ ? "FixedParameters" : "Parameters") +
                                                 " for " + records_.back().type.substr(0, 60) + ", " + file_ +
                                                 "; the file may be truncated");
    }
    has_fixed_ = has_parameters_ = false;
  }

  std::string file_;
  std::ifstream stream_;
  std::int64_t line_ = 0;
  bool has_fixed_ = false, has_parameters_ = false;
  std::vector<TransformRecord> records_;
};

/// The parts of the transform that a file of ITK holds. @throws InputError for several transforms
std::vector<TransformRecord> parts_of(std::vector<TransformRecord> records, const std::string& file) {
  const auto is_composite = [](const TransformRecord& record) { return record.type.starts_with("CompositeTransform"); };
  const bool composite = !records.empty() && is_composite(records.front());
  if (composite) records.erase(records.begin());
  require(!records.empty(), "no transform in " + file);
  require(composite || records.size() == 1, std::to_string(records.size()) + " transforms and no composite, " + file +
                                                "; expected one transform, or a CompositeTransform first");
  for (const TransformRecord& record : records)
    require(!is_composite(record), "a composite inside a composite, " + file + "; flatten it");
  return records;
}

}  // namespace

std::string_view trimmed(std::string_view text) {
  const auto begin = text.find_first_not_of(kBlank);
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(kBlank) - begin + 1);
}

std::vector<double> parse_numbers(std::string_view text, const std::string& where) {
  std::vector<double> values;
  for (std::size_t at = text.find_first_not_of(kBlank); at != std::string_view::npos;
       at = text.find_first_not_of(kBlank, at)) {
    const std::string_view word = text.substr(at, text.find_first_of(kBlank, at) - at);
    const auto value = number_from<double>(word);
    require(value.has_value(),
            [&] { return "\"" + std::string(word.substr(0, 40)) + "\" where a number is expected, " + where; });
    values.push_back(*value);
    at += word.size();
  }
  return values;
}

StoredTransform read_transform(const std::filesystem::path& path, const std::stop_token& stop) {
  const std::string magic = first_bytes(path), file = path.string();
  if (magic.starts_with(kHdf5)) return {TransformTool::itk, parts_of(read_transform_hdf5(path, stop), file)};
  if (magic.starts_with(kText)) return {TransformTool::itk, parts_of(TextReader(path).read(), file)};
  if (magic.starts_with(kPlastimatchMagic)) return {TransformTool::plastimatch, {read_plastimatch_spline(path)}};
  if (is_matlab_record(magic)) return {TransformTool::itk, parts_of(read_matlab_records(path), file)};
  require(!magic.starts_with("MATLAB "),
          "a MAT-file of MATLAB 5 or later, " + file +
              ", which no program writes for a transform but SPM; save its 4 x 4 matrix as text and give tool=");
  require(is_elastix_file(path), "not a transform file, " + file +
                                     "; expected ITK's HDF5, text (#Insight Transform File V1.0) or .mat, elastix's "
                                     "parameters or plastimatch's B-spline");
  return {TransformTool::elastix, read_elastix(path)};
}

void tetwarp_load_transform(const std::filesystem::path& path, const std::stop_token& stop, LoadedTransform& loaded) {
  loaded.stored = read_transform(path, stop);
  loaded.map = make_transform(loaded.stored, path.string());
  loaded.affine = std::ranges::none_of(loaded.stored.parts, [](const TransformRecord& part) {
    return part.type.starts_with("BSplineTransform") || part.type.starts_with("DisplacementFieldTransform");
  });
}

void tetwarp_transform_files(const std::filesystem::path& path, std::vector<std::filesystem::path>& files) {
  const std::string magic = first_bytes(path);
  const bool alone = magic.starts_with(kHdf5) || magic.starts_with(kText) || magic.starts_with(kPlastimatchMagic) ||
                     is_matlab_record(magic);
  files = alone || !is_elastix_file(path) ? std::vector<std::filesystem::path>{path} : elastix_files(path);
}

}  // namespace tetwarp
