#include "apps/further_volumes.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>

#include "apps/map_outputs.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

constexpr char kForm[] = "expected IN=OUT[:nearest|linear|cubic|vote][:background=V][:own]";

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts(1);
  for (const char c : text) {
    if (c == at) {
      parts.emplace_back();
    } else {
      parts.back() += c;
    }
  }
  return parts;
}

std::optional<double> number(std::string_view text) {
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return {};
  return value;
}

/// Reads one option that follows OUT. @return whether it is one
bool read_option(std::string_view text, FurtherOptions& options) {
  constexpr std::string_view kBackground = "background=";
  if (text == "own") {
    options.own = true;
  } else if (text.starts_with(kBackground)) {
    options.background = number(text.substr(kBackground.size()));
    return options.background.has_value();
  } else {
    options.interpolation = interpolation_named(text);
    return options.interpolation.has_value();
  }
  return true;
}

}  // namespace

FurtherOptions parse_further(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos) throw UsageError("--with \"" + text + "\" names no output; " + kForm);
  FurtherOptions options;
  options.input.path = text.substr(0, equals);
  const std::vector<std::string> parts = split(text.substr(equals + 1), ':');
  options.output = parts.front();
  for (auto part = parts.begin() + 1; part != parts.end(); ++part) {
    if (!read_option(*part, options)) {
      throw UsageError("unknown option \"" + *part + "\" of --with \"" + text + "\"; " + kForm);
    }
  }
  if (options.output.empty()) throw UsageError("--with \"" + text + "\" names no output; " + kForm);
  require_image_suffix(options.output, "an output of --with");
  return options;
}

std::vector<std::filesystem::path> FurtherVolumes::inputs(const std::vector<std::string>& texts) {
  std::vector<std::filesystem::path> paths;
  for (const std::string& text : texts) paths.push_back(parse_further(text).input.path);
  return paths;
}

FurtherVolumes::FurtherVolumes(const std::vector<std::string>& texts, OutputSet& outputs) {
  for (const std::string& text : texts) {
    One& one = volumes_.emplace_back();
    one.options = parse_further(text);
    one.staged = outputs.add(one.options.output);
  }
}

std::uint64_t FurtherVolumes::bytes(std::uint64_t output_voxels) {
  std::uint64_t bytes = 0;
  for (One& one : volumes_) {
    one.header = open_input(one.options.input, {.stop = interrupt_token()}, true);
    if (one.options.background && !fits(one.header.type, *one.options.background)) {
      throw UsageError("background=" + nlohmann::json(*one.options.background).dump() + " does not fit the voxels, " +
                       to_string(one.header.type) + ", " + one.options.input.path.string() +
                       "; choose a value in their range");
    }
    const auto voxels = static_cast<std::uint64_t>(voxel_count(one.header.geometry));
    bytes += size_bytes(one.header.type) * static_cast<std::uint64_t>(one.header.components) *
             (voxels + (one.options.own ? voxels : output_voxels));
  }
  return bytes;
}

void FurtherVolumes::read(const CommonOptions& common, const Control& control) {
  for (One& one : volumes_) {
    one.input = read_input(one.options.input, one.header, common, control);
    one.sha256 = one.input.is_dicom() ? one.input.dicom->sha256 : hash_file(one.options.input.path);
  }
}

std::vector<Geometry> FurtherVolumes::own_grids() const {
  std::vector<Geometry> grids;
  for (const One& one : volumes_) {
    const Geometry grid = straightened(one.header.geometry);
    if (one.options.own && std::find(grids.begin(), grids.end(), grid) == grids.end()) grids.push_back(grid);
  }
  return grids;
}

std::vector<Target> FurtherVolumes::targets_on(const Geometry& grid, bool own, Interpolation otherwise) {
  std::vector<Target> targets;
  for (One& one : volumes_) {
    if (one.options.own != own || (own && straightened(one.header.geometry) != grid)) continue;
    one.output = AnyVolume(grid, one.input.volume.type(), one.input.volume.components());
    targets.push_back({.source = std::as_const(one.input.volume).view(),
                       .output = one.output.view(),
                       .interpolation = one.options.interpolation.value_or(otherwise),
                       .background = one.options.background.value_or(one.input.background),
                       .padding = one.input.is_dicom() ? one.input.dicom->padding : std::nullopt});
    one.target = targets.back();
  }
  return targets;
}

void FurtherVolumes::write(const std::optional<int>& compression, const std::string& descrip) const {
  for (const One& one : volumes_) {
    write_image(one.staged, one.output.view(),
                {.compression = compression.value_or(-1), .metadata = {{"descrip", descrip}}});
  }
}

nlohmann::json FurtherVolumes::describe() const {
  nlohmann::json list = nlohmann::json::array();
  for (const One& one : volumes_) {
    list.push_back({{"input", one.options.input.path.string()},
                    {"sha256", one.sha256},
                    {"output", one.options.output.string()},
                    {"grid", one.options.own ? "own" : "output"},
                    {"voxel_type", to_string(one.output.type())},
                    {"interpolation", name_of(one.target.interpolation)},
                    {"background", one.target.background}});
  }
  return list;
}

}  // namespace tetwarp::apps
