#include <cstdio>
#include <nlohmann/json.hpp>

#include "apps/backend.h"
#include "apps/field_source.h"
#include "apps/input.h"
#include "apps/output.h"
#include "io/field_file.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

std::string text_of(const Residuals& residuals) {
  char text[96];
  std::snprintf(text, sizeof text, "mean %.3g, 99 %% below %.3g, largest %.3g mm", residuals.mean,
                residuals.percentile_99, residuals.largest);
  return text;
}

}  // namespace

int run_invert(const InvertOptions& options) {
  if (!has_image_suffix(options.output)) {
    throw UsageError("unknown suffix of \"" + options.output.string() +
                     "\"; a displacement field is written as .mha .nrrd .nii .nii.gz");
  }
  check_fields(options.fields, options.cell_size);
  std::vector<std::filesystem::path> inputs = field_files(options.fields);
  inputs.push_back(options.like.path);
  OutputSet outputs(inputs, options.common.overwrite);
  const std::filesystem::path output = outputs.add(options.output), report_path = outputs.add(options.report);
  const Control stop{.stop = interrupt_token()};
  const InputHeader like = open_input(options.like, stop);

  Stage field_stage(options.common, "field");
  const ForwardField field =
      read_forward_field(options.fields, like.geometry, options.cell_size, options.common, field_stage.control());
  const double field_seconds = field_stage.seconds();

  Stage invert_stage(options.common, "invert");
  PullField inverse{like.geometry, std::vector<glm::vec3>(static_cast<std::size_t>(voxel_count(like.geometry)))};
  const Limits limits{.threads = options.common.threads};
  const Backend backend = make_backend(options.backend, Direction::forward, like.geometry, options.device, limits);
  backend.resampler->set_field(view(field.field, Outside::background), {.stop = stop.stop, .jacobian_range = false});
  const Report report = backend.resampler->resample(
      whole(like.geometry), {}, {.coverage = {}, .inverse_mm = samples_of(inverse)}, invert_stage.control());
  const double invert_seconds = invert_stage.seconds();

  Stage check_stage(options.common, "check");
  const Residuals there = forward_after_inverse(field.field, inverse, limits, stop),
                  back = inverse_after_forward(field.field, inverse, limits, stop);
  const double check_seconds = check_stage.seconds();

  outputs.write([&] {
    write_field_file(output, inverse);
    if (report_path.empty()) return;
    json document = provenance("invert");
    document["backend"] = backend.name;
    document["field"] = {
        {"sha256", hash_field(field.field, options.common.threads)},
        {"notes", field.notes},
        {"files", to_json(field.files)}};
    document["field"].update(place_json(field.field));
    document["output"] = {{"path", options.output.string()}, {"geometry", to_json(like.geometry)}};
    document["covered"] = report.covered;
    document["uncovered"] = report.uncovered;
    document["inverted"] = report.inverted;
    document["forward_after_inverse"] = to_json(there);
    document["inverse_after_forward"] = to_json(back);
    document["stages"] = {{"field", {{"seconds", field_seconds}}},
                          {"invert", {{"seconds", invert_seconds}}},
                          {"check", {{"seconds", check_seconds}}}};
    write_json(report_path, document);
  });
  outputs.commit();
  for (const std::string& note : field.notes) say(options.common, "tetwarp: note: " + note);
  if (report.inverted > 0) {
    say(options.common, "tetwarp: warning: the field folds, " + std::to_string(report.inverted) +
                            " tetrahedra are inverted: where several places map to one, the inverse gives one of them");
  }
  say(options.common, "wrote " + options.output.string() + ": inverse displacement, " + to_string(like.geometry.size) +
                          " samples, " + std::to_string(report.uncovered) + " of them empty");
  say(options.common, "forward after inverse: " + text_of(there));
  say(options.common, "inverse after forward: " + text_of(back));
  return 0;
}

}  // namespace tetwarp::apps
