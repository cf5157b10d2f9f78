// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/cli/option_groups.h"

#include <cfloat>
#include <cmath>
#include <map>
#include <optional>

#include "apps/cli/input.h"
#include "deform/text/text_number.h"
#include "io/shown_text.h"

namespace tetwarp::apps {

namespace {

/// The largest numbers that options take for threads, jobs, devices and pictures: more than any machine has, and few
/// enough to be counted in 32 bits.
constexpr std::int64_t kMostThreads = 65536, kMostDevices = 65535;
/// A lattice with larger cells has one cell an axis, of whatever volume.
constexpr std::int64_t kMostCellSize = 65536;

CLI::Validator check(const std::string& expected, std::function<bool(const std::string&)> is_good) {
  return {[expected, is_good](std::string& text) {
            return is_good(text) ? std::string() : "\"" + shown(text) + "\", expected " + expected;
          },
          ""};
}

/// How many bytes a unit of sizes stands for: K, M, G, T, with B or not (powers of 1000), Ki, Mi, Gi, Ti (powers of
/// 1024); no letters: 1. @return nothing for other letters
std::optional<double> factor_of(std::string unit) {
  for (char& c : unit) c = static_cast<char>(std::toupper(static_cast<unsigned char>(c)));
  if (unit.ends_with('B')) unit.pop_back();
  if (unit.empty()) return 1;
  const std::size_t power = std::string_view("KMGT").find(unit[0]);
  if (power == std::string_view::npos || (unit.size() > 1 && unit.substr(1) != "I")) return std::nullopt;
  return std::pow(unit.size() > 1 ? 1024.0 : 1000.0, static_cast<double>(power + 1));
}

/// A size such as "2.5G" in bytes. @return nothing for what is no size, is more than a machine has, or less than a byte
std::optional<std::uint64_t> bytes_of(const std::string& text) {
  constexpr double kMost = 0x1p62;
  const std::size_t end = std::min(text.find_first_not_of("0123456789."), text.size()),
                    unit = std::min(text.find_first_not_of(' ', end), text.size());
  const std::optional<double> number = number_from<double>(text.substr(0, end)), factor = factor_of(text.substr(unit));
  if (end == 0 || !number || !factor) return std::nullopt;
  const double bytes = std::floor(*number * *factor);
  if (!(bytes >= 1 && bytes <= kMost)) return std::nullopt;
  return static_cast<std::uint64_t>(bytes);
}

}  // namespace

CLI::Validator whole_number(std::int64_t least, std::int64_t most) {
  return check("a whole number from " + std::to_string(least) + " to " + std::to_string(most), [=](const auto& text) {
    const auto number = number_from<std::int64_t>(text);
    return number && *number >= least && *number <= most;
  });
}

CLI::Validator real_number(double least, double most) {
  return check("a number from " + exact_number_text(least) + " to " + exact_number_text(most), [=](const auto& text) {
    const auto number = number_from<double>(text);
    return number && *number >= least && *number <= most;
  });
}

CLI::Validator finite_number() {
  return check("a finite number", [](const auto& text) {
    const auto number = number_from<double>(text);
    return number && std::abs(*number) <= FLT_MAX;
  });
}

CLI::Validator positive_number() {
  return check("a number greater than 0", [](const auto& text) {
    const auto number = number_from<double>(text);
    return number && *number > 0 && *number <= FLT_MAX;
  });
}

CLI::Validator size_in_bytes() {
  return {[](std::string& text) {
            const auto bytes = bytes_of(text);
            if (!bytes) return "\"" + shown(text) + "\", expected a size such as 8G, 2.5G, 500M or 512MiB";
            text = std::to_string(*bytes);
            return std::string();
          },
          ""};
}

const char* const kInputHelp = "Folder of DICOM files, one DICOM file, or .nii .nii.gz .nrrd .mha";
const char* const kFieldHelp =
    "Forward field: a file (.mha .nrrd .mgz .nii .nii.gz .mif .mif.gz, of which some need "
    "values=displacements|positions and frame=lps|ras, those of FSL source=MOVING; .npy or "
    ".npz:order=zyx|xyz,units=mm|voxel, with key=NAME; .vts .vti .vtr "
    ".vtk[:displacement=NAME,frame=lps|ras,units=mm|m]), a transform of ITK, ANTs, elastix, plastimatch (.h5 .tfm .txt "
    ".mat .toml), NiftyReg and FSL (their B-splines), FreeSurfer (.lta) or a 4 x 4 matrix "
    "(.mat:tool=greedy|c3d|niftyreg|mrtrix|flirt), each vertex x goes to T(x), an affine one with invert=yes to where "
    "the inverse leads, a mesh (.msh .vtu .vtk .frd .xplt .med .inp, with displacement=NAME and step=N, deformed=FILE, "
    "or table=FILE; the first of several), or identity, wave:amplitude=,wavelength=[,phase=,axis=,along=], "
    "twist:angle=[,axis=], bubble:radius=,strength=[,center=X/Y/Z], bubble-paper:shift=[,center=], "
    "elastic:amplitude=,spacing=,seed=, translate:by=X/Y/Z; mm, or voxels with the suffix vox; degrees. Options stand "
    "behind a name as after .npy. Several compose, the first is applied first";

void add_common(CLI::App& command, CommonOptions& common, bool writes) {
  command.add_option("--threads", common.threads, "Threads; 0 is all")
      ->check(whole_number(0, kMostThreads))
      ->capture_default_str();
  command.add_flag("--quiet", common.quiet, "Say nothing unless something is wrong");
  command.add_flag("--verbose", common.verbose, "Say how long each stage takes");
  if (writes) command.add_flag("--overwrite", common.overwrite, "Replace an output that exists");
}

void add_series(CLI::App& command, InputOptions& input) {
  input.has_options = true;
  command.add_option("--series", input.series, "Series Instance UID, or the number that `tetwarp info` prints")
      ->type_name("UID");
  command.add_flag("--single", input.single, "Read the one DICOM file alone, not its series");
  command
      .add_option_function<std::string>(
          "--uneven", [&input](const std::string& wanted) { input.uneven = wanted == "exact"; },
          "Slices at uneven distances: refuse them, or take each exactly where it is")
      ->check(CLI::IsMember({"refuse", "exact"}))
      ->default_str("refuse");
}

void add_nifti_frame(CLI::App& command, CommonOptions& common, InputOptions& input) {
  command
      .add_option_function<std::string>(
          "--nifti-frame",
          [&common, &input](const std::string& name) {
            common.nifti_frame = input.nifti_frame = name == "qform" ? NiftiFrame::qform : NiftiFrame::sform;
          },
          "What places a NIfTI file that has both: its sform, as nibabel and FSL have it, or its qform, which ITK "
          "takes "
          "unless the sform's code is 1. For every file that is read")
      ->check(CLI::IsMember({"sform", "qform"}))
      ->type_name("sform|qform")
      ->default_str("sform");
}

void add_backend_choice(CLI::App& command, BackendChoice& backend, const char* help) {
  command
      .add_option_function<std::string>(
          "--backend", [&backend](const std::string& word) { backend = backend_choice(word); }, help)
      ->check(CLI::IsMember(backend_words()))
      ->default_str(name_of(backend));
}

void add_backend(CLI::App& command, BackendChoice& backend, int& device, const char* help) {
  add_backend_choice(command, backend, help);
  command.add_option("--device", device, "CUDA device, as `tetwarp --version` numbers them")
      ->check(whole_number(0, kMostDevices))
      ->type_name("N")
      ->capture_default_str();
}

CLI::Option* add_sequence(CLI::App& command, std::vector<std::string>& sequence, const char* help,
                          std::initializer_list<CLI::Option*> excluded) {
  CLI::Option* option = command.add_option("--sequence", sequence, help)->type_name("FIELD");
  for (CLI::Option* other : excluded) option->excludes(other);
  return option;
}

void add_cell_size(CLI::App& command, FieldArguments& field) {
  command
      .add_option("--cell-size", field.cell_size,
                  "Vertices every B voxels, for formulas and transforms only (default 1)")
      ->check(whole_number(1, kMostCellSize))
      ->type_name("B");
}

void add_outside(CLI::App& command, Outside& outside) {
  command
      .add_option("--outside", outside, "A field that does not cover the volume: refuse (default), rest or background")
      ->transform(
          one_of<Outside>({{"refuse", Outside::refuse}, {"rest", Outside::rest}, {"background", Outside::background}}))
      ->type_name("NAME");
}

}  // namespace tetwarp::apps
