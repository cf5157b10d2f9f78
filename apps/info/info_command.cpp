// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <cstdio>
#include <nlohmann/json.hpp>
#include <variant>

#include "apps/cli/console.h"
#include "apps/cli/input.h"
#include "apps/cli/output.h"
#include "apps/fields/read_field.h"
#include "apps/info/info_command.h"
#include "apps/info/info_dicom.h"
#include "io/dicom_dose.h"
#include "io/field_file.h"
#include "io/image_file.h"
#include "io/mesh_file.h"
#include "io/opened_file.h"
#include "io/transform_file.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

json describe_field(const FieldSource& source) {
  const FieldFileHeader header = read_field_header(source);
  json document = to_json(header);
  document["path"] = source.path.string();
  document["kind"] = "field";
  document["notes"] = header.notes;
  const glm::i64vec3& size = header.grid.size;
  document["lattice"] = header.has_own_grid ? to_json(header.grid) : json{{"size", {size.x, size.y, size.z}}};
  return document;
}

json describe_mesh(const FieldSource& source) {
  const MeshFileHeader header = read_mesh_header(source);
  json cells = json::object();
  for (std::size_t n = 0; n < kCellShapes.size(); ++n) {
    if (header.cells[n] > 0) cells[to_string(kCellShapes[n])] = header.cells[n];
  }
  const bool known = header.largest_mm.has_value();
  return {{"path", source.path.string()},
          {"kind", "mesh"},
          {"format", header.format},
          {"vertices", header.vertices},
          {"tetrahedra", header.tetrahedra},
          {"cells", cells},
          {"arrays", header.arrays},
          {"displacement", known ? json(header.displacement) : json()},
          {"largest_displacement_mm", known ? json(*header.largest_mm) : json()},
          {"direction", to_string(Direction::forward)},
          {"frame", header.frame},
          {"units", header.units},
          {"known",
           {{"direction", to_string(FieldBasis::by_format)},
            {"frame", to_string(header.frame_basis)},
            {"units", to_string(header.units_basis)}}},
          {"notes", header.notes}};
}

json describe_transform(const FieldSource& source) {
  const TransformFile transform = read_transform_file(source, interrupt_token());
  const bool known = transform.direction.has_value(), pulls = transform.direction == Direction::pull;
  return {{"path", source.path.string()},
          {"kind", "transform"},
          {"tool", transform.tool},
          {"classes", transform.classes},
          {"parameters", transform.parameters},
          {"inverted", transform.inverted},
          {"direction", !known  ? "as the option says: -f or --pull-field"
                        : pulls ? "output to input (pull)"
                                : "input to output (forward)"},
          {"frame", transform.frame},
          {"units", transform.frame == "index" ? "voxel" : "mm"},
          {"absolute", true},
          {"known",
           {{"direction", known ? to_string(transform.basis) : "not stated"},
            {"frame", to_string(transform.basis)},
            {"units", to_string(transform.basis)},
            {"absolute", to_string(FieldBasis::by_format)}}}};
}

json describe_image(const std::filesystem::path& path, NiftiFrame frame) {
  const ImageHeader header = read_image_header(path, frame);
  return {{"path", path.string()},
          {"kind", "volume"},
          {"voxel_type", to_string(header.type)},
          {"components", header.components},
          {"geometry", to_json(header.geometry)},
          {"notes", header.notes}};
}

json describe_dose(const std::filesystem::path& path) {
  const DicomDose dose = read_dose_header(path);
  return {{"path", path.string()}, {"kind", "dose"},           {"voxel_type", to_string(VoxelType::f32)},
          {"components", 1},       {"dose_units", dose.units}, {"geometry", to_json(dose.geometry)}};
}

std::string triple(const json& values) {
  std::string text;
  for (const json& value : values) text += (text.empty() ? "" : " x ") + value.dump();
  return text;
}

void print_grid(const json& grid) {
  std::printf("  size         %s\n", triple(grid["size"]).c_str());
  std::printf("  spacing      %s mm\n", triple(grid["spacing_mm"]).c_str());
  std::printf("  origin       %s mm (LPS)\n", grid["origin_lps_mm"].dump().c_str());
  std::printf("  orientation  %s\n", grid["orientation"].get<std::string>().c_str());
}

void print_lines(const char* title, const json& lines) {
  if (lines.empty()) return;
  std::printf("  %s\n", title);
  for (const json& line : lines) std::printf("    %s\n", line.get<std::string>().c_str());
}

void print_field(const json& document) {
  const auto text = [](const json& value) { return value.get<std::string>(); };
  const json& known = document["known"];
  const std::string direction = text(document["direction"]), basis = text(known["direction"]);
  std::printf("  format       %s\n", text(document["format"]).c_str());
  std::printf("  direction    %s\n", (direction + (direction == basis ? "" : " (" + basis + ")")).c_str());
  std::printf("  vectors      %s (%s), frame %s (%s), %s (%s)\n",
              document["absolute"].get<bool>() ? "positions" : "displacements", text(known["absolute"]).c_str(),
              text(document["frame"]).c_str(), text(known["frame"]).c_str(), text(document["units"]).c_str(),
              text(known["units"]).c_str());
  if (document["lattice"].contains("origin_lps_mm")) {
    print_grid(document["lattice"]);
  } else {
    std::printf("  size         %s\n", triple(document["lattice"]["size"]).c_str());
    std::printf("  place        that of the volume\n");
  }
  print_lines("notes:", document["notes"]);
}

void print_mesh(const json& document) {
  const auto text = [](const json& value) { return value.get<std::string>(); };
  const json& known = document["known"];
  std::string cells, arrays;
  for (const auto& [shape, count] : document["cells"].items())
    cells += (cells.empty() ? "" : ", ") + shape + " " + count.dump();
  for (const json& name : document["arrays"]) arrays += (arrays.empty() ? "" : ", ") + name.dump();
  std::printf("  format       %s\n", text(document["format"]).c_str());
  std::printf("  vertices     %s\n", document["vertices"].dump().c_str());
  std::printf("  tetrahedra   %s, of cells: %s\n", document["tetrahedra"].dump().c_str(), cells.c_str());
  std::printf("  direction    %s (%s)\n", text(document["direction"]).c_str(), text(known["direction"]).c_str());
  std::printf("  positions    frame %s (%s), %s (%s)\n", text(document["frame"]).c_str(), text(known["frame"]).c_str(),
              text(document["units"]).c_str(), text(known["units"]).c_str());
  std::printf("  vectors      %s\n", arrays.empty() ? "none at the vertices" : arrays.c_str());
  if (document["displacement"].is_null()) {
    std::printf(
        "  displacement undecided; give displacement=NAME, step=N, deformed=FILE or table=FILE behind the name\n");
  } else {
    std::printf("  displacement %s, at most %.6g mm\n", document["displacement"].dump().c_str(),
                document["largest_displacement_mm"].get<double>());
  }
  print_lines("notes:", document["notes"]);
}

void print_file(const json& document) {
  std::printf("%s: %s\n", document["path"].get<std::string>().c_str(), document["kind"].get<std::string>().c_str());
  if (document["kind"] == "mesh") {
    print_mesh(document);
  } else if (document["kind"] == "transform") {
    std::printf("  written by   %s\n", document["tool"].get<std::string>().c_str());
    for (const json& name : document["classes"]) std::printf("  class        %s\n", name.get<std::string>().c_str());
    if (document["inverted"].get<bool>()) std::printf("  inverted     yes (invert=yes)\n");
    std::printf("  parameters   %s\n", document["parameters"].dump().c_str());
    std::printf("  direction    %s\n", document["direction"].get<std::string>().c_str());
    std::printf("  points       positions (absolute), frame %s, %s\n", document["frame"].get<std::string>().c_str(),
                document["units"].get<std::string>().c_str());
  } else if (document["kind"] == "field") {
    print_field(document);
  } else {
    std::printf("  voxels       %s, %d a voxel\n", document["voxel_type"].get<std::string>().c_str(),
                document["components"].get<int>());
    if (document.contains("dose_units")) {
      std::printf("  dose         %s\n", document["dose_units"].get<std::string>().c_str());
    }
    print_grid(document["geometry"]);
    if (document.contains("notes")) print_lines("notes:", document["notes"]);
  }
}

/// What INPUT is: a folder or file of DICOM images, or any other file, described.
using Described = std::variant<DicomScan, json>;

Described look_at(const InfoOptions& options) {
  refuse_pipes(options.input.path);
  const FieldSource source = parse_field_file(options.input.path.string(), options.common.nifti_frame);
  const bool field = is_field_file(source), mesh = !field && is_mesh_file(source.path);
  const std::filesystem::path& path = field ? source.path : options.input.path;
  if (field) return describe_field(source);
  if (mesh) return describe_mesh(source);
  if (is_transform_file(source.path)) return describe_transform(source);
  if (has_image_suffix(path)) return describe_image(path, options.common.nifti_frame);
  if (is_dicom_dose(path)) return describe_dose(path);
  Stage stage(options.common, "scan");
  DicomScan scan = scan_dicom(path, options.input.single, stage.control());
  for (const LeftOutFile& file : scan.skipped) {
    require(file.file != path || !file.reason.starts_with("not DICOM"),
            [&] { return "of no format that is known, " + path.string() + " (" + file.reason + ")"; });
  }
  return scan;
}

json document_of(const DicomScan& scan, const InfoOptions& options) { return describe(scan, options.input); }
const json& document_of(const json& document, const InfoOptions&) { return document; }

}  // namespace

nlohmann::json info_document(const InfoOptions& options) {
  return std::visit([&](const auto& what) -> json { return document_of(what, options); }, look_at(options));
}

int run_info(const InfoOptions& options) {
  const Described described = look_at(options);
  if (options.json) {
    const json document = std::visit([&](const auto& what) -> json { return document_of(what, options); }, described);
    std::printf("%s\n", document.dump(2, ' ', false, json::error_handler_t::replace).c_str());
  } else if (const auto* scan = std::get_if<DicomScan>(&described)) {
    print(*scan, options.input);
  } else {
    print_file(std::get<json>(described));
  }
  return 0;
}

}  // namespace tetwarp::apps
