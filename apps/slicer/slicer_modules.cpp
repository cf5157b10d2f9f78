// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

// What the modules ask for. Flags are those of the command, but for the pair that names a field: which option of the
// command takes it depends on its direction.

#include <algorithm>

#include "apps/cli/options.h"
#include "apps/slicer/slicer_module.h"
#include "deform/errors.h"

namespace tetwarp::apps {

namespace {

constexpr const char* kFieldFiles = R"(fileExtensions=".h5,.tfm,.txt,.nrrd,.mha,.nii.gz")";

/// The groups that say by which field.
SlicerGroup field_group() {
  return {"Deformation",
          "By a transform, or else by a formula",
          {{.element = "transform",
            .name = "transform",
            .label = "Transform",
            .description = "Linear, B-spline or displacement field",
            .channel = "input",
            .attributes = kFieldFiles},
           {.element = "string-enumeration",
            .name = "direction",
            .label = "Direction of the transform",
            .description = "resampling: it maps output to input, as Slicer writes its transforms; modeling: it moves "
                           "tissue from input to output. A NRRD file that says otherwise is refused",
            .by_default = "resampling",
            .choices = {"resampling", "modeling"}},
           {.element = "string",
            .name = "formula",
            .label = "Formula",
            .description = "Instead of a transform, such as elastic:amplitude=8,spacing=40,seed=7 (lengths in mm)"},
           {.element = "integer",
            .name = "cellSize",
            .label = "Cell size",
            .description = "A vertex every so many voxels, of a formula or a modeling transform",
            .by_default = "4"}}};
}

SlicerGroup machine_group() {
  return {
      "Machine",
      "Where it is computed; the values are the same everywhere",
      {{.element = "string-enumeration",
        .name = "backend",
        .label = "Backend",
        .description = "auto: a CUDA device where there is one",
        .by_default = "auto",
        .choices = {"auto", "cuda", "cpu"}},
       {.element = "integer", .name = "threads", .label = "Threads", .description = "0 is all", .by_default = "0"}}};
}

SlicerModule deform_module() {
  const auto map = [](const char* name, const char* label, const char* description, const char* type) {
    return SlicerParameter{.element = "image",
                           .name = name,
                           .label = label,
                           .description = description,
                           .channel = "output",
                           .attributes = std::string("type=\"") + type + "\" fileExtensions=\".nrrd\""};
  };
  return {
      "deform",
      "Deform (Tetwarp)",
      "Deforms a volume exactly: each voxel is sampled where the one tetrahedron that owns it came from. There are "
      "no holes and no double writes, and the values are the same on every machine.",
      {{"Volumes",
        "What is deformed",
        {{.element = "image",
          .name = "INPUT",
          .label = "Input volume",
          .description = "Undeformed",
          .channel = "input",
          .attributes = R"(type="scalar" fileExtensions=".nrrd")",
          .index = 0},
         {.element = "image",
          .name = "OUTPUT",
          .label = "Output volume",
          .description = "Deformed, on the grid of the input",
          .channel = "output",
          .attributes = R"(type="scalar" fileExtensions=".nrrd")",
          .index = 1}}},
       field_group(),
       {"Sampling",
        "How values come about",
        {{.element = "string-enumeration",
          .name = "interpolation",
          .label = "Interpolation",
          .description = "vote is for label maps",
          .by_default = "linear",
          .choices = {"linear", "nearest", "cubic", "vote"}},
         {.element = "string-enumeration",
          .name = "outside",
          .label = "Outside the deformation",
          .description = "refuse: it has to cover the volume; rest: voxels stay; background: they get the background",
          .by_default = "refuse",
          .choices = {"refuse", "rest", "background"}}}},
       {"Maps",
        "What the deformation does at each voxel",
        {map("coverage", "Coverage", "1 where a voxel got a value through the deformation", "label"),
         map("jacobian", "Jacobian determinant", "Of the forward map, negative where it folds", "scalar"),
         map("inverse", "Inverse displacement", "Output to input, LPS mm", "vector")}},
       machine_group()}};
}

SlicerModule invert_module() {
  return {"invert",
          "Invert (Tetwarp)",
          "Inverts a deformation exactly, on the grid of a volume. NaN says where nothing maps.",
          {{"Volumes",
            "Where the inverse is sampled",
            {{.element = "image",
              .name = "like",
              .label = "Reference volume",
              .description = "Its grid is that of the inverse",
              .channel = "input",
              .attributes = R"(type="scalar" fileExtensions=".nrrd")"},
             {.element = "image",
              .name = "output",
              .label = "Inverse displacement",
              .description = "LPS mm; the file says its direction",
              .channel = "output",
              .attributes = R"(type="vector" fileExtensions=".nrrd")"}}},
           field_group(),
           machine_group()}};
}

SlicerModule simulate_module() {
  return {"simulate",
          "Simulate (Tetwarp)",
          "Simulates what happens to a CT in a scenario: tissue that is held, moved and cut, by ChainMail or springs.",
          {{"Scenario",
            "What happens to which volume",
            {{.element = "file",
              .name = "SCENARIO",
              .label = "Scenario",
              .description = "JSON, see docs/reference/scenario.md of Tetwarp",
              .channel = "input",
              .attributes = R"(fileExtensions=".json")",
              .index = 0},
             {.element = "image",
              .name = "INPUT",
              .label = "CT",
              .description = "In Hounsfield units",
              .channel = "input",
              .attributes = R"(type="scalar" fileExtensions=".nrrd")",
              .index = 1},
             {.element = "image",
              .name = "labels",
              .label = "Labels",
              .description = "On the grid of the CT, for tissues and regions by label",
              .channel = "input",
              .attributes = R"(type="label" fileExtensions=".nrrd")"},
             {.element = "image",
              .name = "output",
              .label = "Displacement field",
              .description = "Where each vertex goes, LPS mm: a modeling transform, as the file says",
              .channel = "output",
              .attributes = R"(type="vector" fileExtensions=".nrrd")"}}},
           machine_group()}};
}

const SlicerParameter* find(const SlicerModule& module, const std::string& name) {
  for (const SlicerGroup& group : module.groups)
    for (const SlicerParameter& parameter : group.parameters)
      if (parameter.name == name) return &parameter;
  return nullptr;
}

}  // namespace

const SlicerModule& slicer_module(const std::string& command) {
  static const std::vector<SlicerModule> modules = {deform_module(), invert_module(), simulate_module()};
  const auto found = std::find_if(modules.begin(), modules.end(),
                                  [&](const SlicerModule& module) { return module.command == command; });
  require(found != modules.end(), "no module of the command " + command);
  return *found;
}

std::vector<std::string> command_line_of(const SlicerModule& module, std::span<const std::string> arguments) {
  std::vector<std::string> line = {module.command};
  std::string transform, direction = "resampling", formula, cell_size;
  std::vector<std::string> places;
  for (std::size_t n = 0; n < arguments.size(); ++n) {
    const std::string& argument = arguments[n];
    if (!argument.starts_with("--")) {
      places.push_back(argument);
      continue;
    }
    const std::string name = argument.substr(2);
    const SlicerParameter* const parameter = find(module, name);
    if (parameter == nullptr || parameter->index >= 0)
      throw UsageError("no parameter " + argument + "; see tetwarp-slicer-" + module.command + " --xml");
    if (n + 1 == arguments.size()) throw UsageError(argument + " without a value");
    const std::string& value = arguments[++n];
    if (value.empty()) continue;
    if (name == "transform") {
      transform = value;
    } else if (name == "direction") {
      direction = value;
    } else if (name == "formula") {
      formula = value;
    } else if (name == "cellSize") {
      cell_size = value;
    } else {
      line.insert(line.end(), {argument, value});
    }
  }
  const bool has_field = find(module, "transform") != nullptr;
  if (has_field && (transform.empty() == formula.empty()))
    throw UsageError("a transform or a formula is wanted, " + std::string(transform.empty() ? "none" : "both") +
                     " given");
  const bool is_pull = !transform.empty() && direction == "resampling";
  const std::string& field = transform.empty() ? formula : transform;
  if (is_pull) {
    line.insert(line.end(), {"--pull-field", field});
  } else if (has_field && module.command == "invert") {
    places.insert(places.begin(), field);
  } else if (has_field) {
    line.insert(line.end(), {"-f", field});
  }
  // Files have vertices of their own.
  if (!cell_size.empty() &&
      (transform.empty() || transform.ends_with(".h5") || transform.ends_with(".tfm") || transform.ends_with(".txt")) &&
      !is_pull)
    line.insert(line.end(), {"--cell-size", cell_size});
  if (module.command == "deform" && !places.empty()) {
    line.insert(line.end(), {"-o", places.back()});
    places.pop_back();
  }
  // Slicer has made the files of outputs before.
  line.insert(line.end(), {"--overwrite", "--quiet"});
  line.insert(line.end(), places.begin(), places.end());
  return line;
}

}  // namespace tetwarp::apps
