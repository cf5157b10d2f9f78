// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <algorithm>
#include <cmath>

#include "apps/cli/output.h"
#include "apps/cli/reads.h"
#include "apps/render/movie.h"
#include "apps/render/render_scene.h"
#include "backend/factories.h"
#include "io/lattice_lines.h"
#include "io/preview_scale.h"
#include "io/slice_view.h"
#include "io/transfer_file.h"
#include "io/view_picture.h"

namespace tetwarp::apps {

namespace {

namespace fs = std::filesystem;

std::string degrees(double angle) { return short_number(angle) + " deg"; }

/// One run of the command.
class Rendering {
 public:
  explicit Rendering(const RenderOptions& options);
  void run();

 private:
  bool is_volume() const { return options_.view == "volume"; }
  std::size_t pictures() const { return scene_.frames(); }
  void choose_style();
  Picture picture(std::size_t number);
  Picture volume_picture(std::size_t number);
  Picture slice_picture(std::size_t number);
  void show(std::size_t number);
  void tint();
  std::vector<Slice> slices() const;
  std::optional<glm::dvec3> position() const;
  Window chosen_window() const;
  ViewCaption caption(std::size_t number) const;

  const RenderOptions& options_;
  RenderFields fields_;
  Reads reads_;
  OutputSet outputs_;
  std::vector<fs::path> staged_;
  RenderScene scene_;
  RenderStyle style_;
  std::unique_ptr<Renderer> renderer_;
  std::string backend_;
  std::optional<Window> window_;
  std::vector<std::uint8_t> tint_numbers_;
  std::optional<std::size_t> shown_;  ///< number of the picture for which the volume is deformed now
};

Rendering::Rendering(const RenderOptions& options)
    : options_(options),
      fields_(parse_render_fields(options)),
      reads_(reads_of(options, fields_)),
      outputs_(reads_, options.common.overwrite),
      scene_(options, fields_) {
  const bool film = is_movie(options.output);
  if (!film && options.output.extension() != ".png")
    throw UsageError("unknown suffix of \"" + options.output.string() + "\"; pictures are .png, films .mp4 or .gif");
  if (options.frames > 0 && !fields_.deforming)
    throw UsageError("--frames needs a field that grows, -f or --pull-field");
  if (options.frames > 0 && options.turntable > 0 && options.frames != options.turntable)
    throw UsageError("--frames and --turntable together need the same number");
  if (!fields_.sequence.empty() &&
      (options.frames > 0 || (options.turntable > 0 && options.turntable != static_cast<int>(pictures()))))
    throw UsageError("--sequence has " + std::to_string(pictures()) +
                     " fields, each a picture: leave out --frames, and give --turntable the same number");
  if (options.turntable > 0 && !is_volume()) throw UsageError("--turntable goes with --view volume only");
  if (!is_volume() && !options.transfer.empty()) throw UsageError("--transfer goes with --view volume only");
  const std::optional<glm::dvec3> background = parse_colour(options.background);
  if (!background)
    throw UsageError("--background is \"" + options.background + "\", expected #rrggbb, two hexadecimal digits each");
  style_.background = *background;
  style_.step_voxels = options.step;
  if (is_transfer_file(options))
    style_.transfer = read_transfer_file(options.transfer);
  else if (!options.transfer.empty()) {
    try {
      style_.transfer = transfer_function(options.transfer);
    } catch (const InputError& error) {
      throw UsageError(std::string(error.what()) + ", or a file, .json");
    }
  }
  if (film) require_movie_encoder(options.output);
  const auto count = static_cast<int>(pictures());
  if (film || count == 1) {
    staged_.push_back(outputs_.add(options.output));
  } else {
    for (int n = 1; n <= count; ++n) staged_.push_back(outputs_.add(frame_path(options.output, n, count)));
  }
  outputs_.add_reads(reads_.slices(options.input, scene_.header()));
}

std::optional<glm::dvec3> Rendering::position() const {
  if (options_.position.empty()) return std::nullopt;
  return glm::dvec3(options_.position[0], options_.position[1], options_.position[2]);
}

std::vector<Slice> Rendering::slices() const {
  std::vector<Slice> slices;
  for (const auto& [name, plane] : {std::pair{"axial", AnatomicalPlane::axial},
                                    {"coronal", AnatomicalPlane::coronal},
                                    {"sagittal", AnatomicalPlane::sagittal}}) {
    if (options_.view != "montage" && options_.view != name) continue;
    const std::optional<glm::dvec3> point = position();
    slices.push_back(point ? slice_through(scene_.grid(), plane, *point) : middle_slice(scene_.grid(), plane));
  }
  return slices;
}

/// The window of grey levels for all pictures, chosen from the middle slices of the first one.
Window Rendering::chosen_window() const {
  Window window = choose_window(scene_.volume());
  if (options_.window) window.width = *options_.window;
  if (options_.level) window.level = *options_.level;
  return window;
}

void Rendering::choose_style() {
  window_ = chosen_window();
  if (!is_volume()) return;
  if (style_.transfer.points.empty()) style_.transfer = transfer_function(window_->hounsfield ? "ct-bone" : "mip");
  const bool is_maximum = style_.transfer.projection == Projection::maximum, named = options_.window || options_.level;
  if (named && !is_maximum)
    throw UsageError("--window and --level go with slices and mip, not with " + style_.transfer.name);
  if (is_maximum && (named || (!window_->hounsfield && !is_transfer_file(options_)))) {
    Window window = *window_;
    if (window_->hounsfield) {  // the window of the transfer function, unless an option gives another
      const double low = style_.transfer.points.front().value, high = style_.transfer.points.back().value;
      window.width = options_.window.value_or(high - low);
      window.level = options_.level.value_or(0.5 * (low + high));
    }
    style_.transfer.points = {{window.level - 0.5 * window.width, glm::dvec3(0), 0},
                              {window.level + 0.5 * window.width, glm::dvec3(1), 0}};
  }
  const BackendKind backend = chosen(options_.backend);
  backend_ = name_of(backend);
  renderer_ = make_renderer(backend, options_.device, {.threads = options_.common.threads});
  renderer_->set_style(style_);
}

void Rendering::show(std::size_t number) {
  const bool still = options_.frames == 0 && fields_.sequence.empty();
  if (shown_ && (still || number == *shown_)) return;
  scene_.show(number);
  if (!shown_) choose_style();
  shown_ = number;
  if (!is_volume()) return;
  renderer_->set_volume(scene_.volume());
  tint();
}

/// Tints each voxel by the last overlay that has a value for it.
void Rendering::tint() {
  tint_numbers_.clear();
  std::optional<OverlayKind> kind;
  for (const OverlayWish& wish : scene_.wishes()) {
    if (wish.kind == OverlayKind::lattice) continue;
    if (kind && *kind != wish.kind)
      throw UsageError("--view volume shows one of coverage, folds and jacobian at a time");
    kind = wish.kind;
  }
  if (!kind) return;
  const TintScale scale(*kind);
  const Geometry& grid = scene_.grid();
  tint_numbers_.resize(static_cast<std::size_t>(voxel_count(grid)));
  for (std::int64_t k = 0; k < grid.size.z; k += 16) {  // slab by slab, for maps take more memory than tint numbers
    Region slab = whole(grid);
    slab.begin.z = k;
    slab.end.z = std::min(k + 16, grid.size.z);
    for (const OverlayWish& wish : scene_.wishes()) {
      if (wish.kind != *kind) continue;
      const OwnedOverlay owned = scene_.overlay(wish, slab);
      const ConstVolumeView& map = owned.overlay.map;
      const std::int64_t slice = grid.size.x * grid.size.y, offset = (k - map.buffered.begin.z) * slice;
      dispatch(map.type, [&](auto zero) {
        const auto* const values = reinterpret_cast<const decltype(zero)*>(map.voxels) + offset;
        for (std::int64_t n = 0; n < voxel_count(slab); ++n)
          tint_numbers_[static_cast<std::size_t>(k * slice + n)] = scale.number(static_cast<double>(values[n]));
      });
    }
  }
  const VolumeView numbers{
      &grid, whole(grid), VoxelType::u8, 1, std::as_writable_bytes(std::span(tint_numbers_)).data(), Memory::host};
  renderer_->set_tints({numbers, scale.colours()});
}

ViewCaption Rendering::caption(std::size_t number) const {
  ViewCaption caption;
  const std::string field = scene_.field_title(number);
  caption.title = is_volume() ? style_.transfer.name : options_.view;
  if (!field.empty()) caption.title += ", " + field;
  if (options_.frames > 1) {
    char share[32];
    std::snprintf(share, sizeof share, " x %.2f", static_cast<double>(number) / (options_.frames - 1));
    caption.title += share;
  }
  return caption;
}

Picture Rendering::volume_picture(std::size_t number) {
  const double turned = options_.turntable > 0 ? 360.0 * static_cast<double>(number) / options_.turntable : 0;
  const Camera camera{.angle_deg = options_.angle + turned,
                      .elevation_deg = options_.elevation,
                      .zoom = options_.zoom,
                      .every_angle = options_.turntable > 0,
                      .width = options_.size[0],
                      .height = options_.size[1],
                      .target = position()};
  const ViewPlane plane = view_plane(camera, scene_.grid());
  Picture picture(camera.width, camera.height);
  renderer_->render(plane, picture.bytes(), {.stop = interrupt_token()});
  if (const VertexField* field = scene_.lattice_field()) draw_lattice(picture, plane, *field);
  if (options_.plain) return picture;
  ViewCaption said = caption(number);
  said.details = {"angle " + degrees(camera.angle_deg) + ", elevation " + degrees(camera.elevation_deg)};
  for (const OverlayWish& wish : scene_.wishes()) said.details.push_back(legend_of(wish.kind));
  annotate(picture, plane, said);
  return picture;
}

Picture Rendering::slice_picture(std::size_t number) {
  const std::vector<Slice> slices = this->slices();
  std::vector<SlicePart> parts;
  std::vector<std::shared_ptr<const AnyVolume>> maps;
  for (const Slice& slice : slices) {
    SlicePart part{slice, {}};
    for (const OverlayWish& wish : scene_.wishes()) {
      const OwnedOverlay owned = scene_.overlay(wish, region_of(scene_.grid(), slice));
      part.overlays.push_back(owned.overlay);
      maps.push_back(owned.map);
    }
    parts.push_back(std::move(part));
  }
  return draw_slices(scene_.volume(), parts,
                     {.window = *window_,
                      .width = options_.size[0],
                      .height = options_.size[1],
                      .caption = caption(number),
                      .plain = options_.plain});
}

Picture Rendering::picture(std::size_t number) {
  show(number);
  return is_volume() ? volume_picture(number) : slice_picture(number);
}

void Rendering::run() {
  scene_.read();
  Stage stage(options_.common, "render");
  const Picture first =
      picture(0);  // made before any file is written, to find options that do not go together and devices that fail
  const Control control = stage.control();
  const auto next = [&](std::size_t number) {
    if (control.stop.stop_requested()) throw Cancelled();
    control.progress(static_cast<double>(number) / static_cast<double>(pictures()));
    return number == 0 ? first : picture(number);
  };
  outputs_.write([&] {
    if (is_movie(options_.output))
      return write_movie(staged_[0], options_.output, pictures(), options_.rate, next, control.stop);
    for (std::size_t n = 0; n < pictures(); ++n) write_png(staged_[n], next(n));
  });
  outputs_.commit();
  for (const std::string& note : scene_.notes()) say(options_.common, "tetwarp: note: " + note);
  say(options_.common, "wrote " + options_.output.string() + ": " + std::to_string(pictures()) +
                           (pictures() == 1 ? " picture" : " pictures") +
                           (backend_.empty() ? "" : ", rendered by " + backend_));
}

}  // namespace

int run_render(const RenderOptions& options) {
  try {
    Rendering(options).run();
  } catch (const DeviceError& error) {
    if (!leaves_open(options.backend)) throw;
    say(options.common, std::string("tetwarp: warning: ") + error.what() + "; the CPU is used");
    RenderOptions on_cpu = options;
    on_cpu.backend = BackendChoice::cpu;
    Rendering(on_cpu).run();
  }
  return 0;
}

}  // namespace tetwarp::apps
