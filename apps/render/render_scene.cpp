// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/render/render_scene.h"

#include <algorithm>
#include <array>

#include "cuda/backend.h"
#include "io/image_file.h"

namespace tetwarp::apps {

namespace {

constexpr std::array<std::pair<const char*, OverlayKind>, 4> kKinds = {{{"coverage", OverlayKind::coverage},
                                                                        {"folds", OverlayKind::folds},
                                                                        {"jacobian", OverlayKind::jacobian},
                                                                        {"lattice", OverlayKind::lattice}}};

struct MapShape {
  VoxelType type;
  int components;
  VolumeView Maps::*place;
};

MapShape shape_of(OverlayKind kind) {
  switch (kind) {
    case OverlayKind::coverage: return {VoxelType::u8, 1, &Maps::coverage};
    case OverlayKind::folds: return {VoxelType::u16, 1, &Maps::owners};
    case OverlayKind::jacobian: return {VoxelType::f32, 1, &Maps::jacobian};
    default: return {VoxelType::f32, 3, &Maps::inverse_mm};
  }
}

/// Fills a map of a part of a grid. Its memory holds that part alone; the view says where it lies.
OwnedOverlay make_map(Resampler& resampler, const Geometry& grid, OverlayKind kind, const Region& region,
                      std::span<const Target> targets) {
  const MapShape shape = shape_of(kind);
  Geometry part = grid;
  part.size = region.end - region.begin;
  auto map = std::make_shared<AnyVolume>(part, shape.type, shape.components);
  VolumeView view = map->view();
  view.geometry = &grid;
  view.buffered = region;
  Maps maps;
  maps.*shape.place = view;
  resampler.resample(region, targets, maps, {.stop = interrupt_token()});
  return {{kind, view}, map};
}

void scale(std::vector<glm::vec3>& displacement, double amount) {
  for (glm::vec3& vector : displacement) vector *= static_cast<float>(amount);
}

}  // namespace

OverlayWish overlay_wish(const std::string& text) {
  const std::size_t split = text.find('=');
  const std::string name = text.substr(0, split);
  const auto found = std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& kind) { return name == kind.first; });
  if (found == kKinds.end())
    throw UsageError("unknown overlay \"" + name + "\"; there are coverage, folds, jacobian and lattice");
  if (split != std::string::npos && split + 1 == text.size())
    throw UsageError("--overlay " + text + " names no file behind =");
  return {found->second, split == std::string::npos ? "" : text.substr(split + 1)};
}

bool is_transfer_file(const RenderOptions& options) {
  return std::filesystem::path(options.transfer).extension() == ".json";
}

RenderScene::RenderScene(const RenderOptions& options) : options_(options), input_options_(options.input) {
  input_options_.hash = FileHash::left_out;
  deforms_ = !options.fields.empty() || !options.pull_field.empty() || !options.sequence.empty();
  for (const std::string& text : options.overlays) {
    const OverlayWish wish = overlay_wish(text);
    if (wish.source.empty() && !deforms_)
      throw UsageError("--overlay " + text + " needs the field that deforms VOLUME (-f), or a file: " + text + "=FILE");
    if (wish.kind == OverlayKind::lattice && wish.source.empty() && !options.pull_field.empty())
      throw UsageError("--overlay lattice needs a forward field; a pull field has no lattice that moves");
    wishes_.push_back(wish);
  }
  if (!options.fields.empty()) check_fields(options.fields, options.cell_size);
  if (!options.sequence.empty()) check_fields(options.sequence, {});
  header_ = open_input(input_options_, options.common);
  grid_ = straightened(header_.geometry);
  notes_ = header_.notes;
}

RenderScene::~RenderScene() = default;

std::size_t RenderScene::frames() const {
  if (!options_.sequence.empty()) return options_.sequence.size();
  return static_cast<std::size_t>(std::max({options_.frames, options_.turntable, 1}));
}

void RenderScene::read() {
  {
    Stage stage(options_.common, "read");
    input_ = read_input(input_options_, header_, options_.common, stage.control());
  }
  if (!deforms_ && grid_ != header_.geometry) {  // then it is resampled onto a straight, even grid
    field_.direction = Direction::pull;
    field_.pull = resting_pull_field(grid_);
    notes_.push_back("the slices of VOLUME lean or lie at uneven distances: it is shown resampled onto " +
                     to_string(grid_.size) + " voxels");
    deforms_ = true;
  } else if (deforms_) {
    Stage stage(options_.common, "field");
    read_fields(stage.control());
  }
  for (const OverlayWish& wish : wishes_) {
    files_.push_back(nullptr);
    if (wish.source.empty()) continue;
    if (wish.kind == OverlayKind::lattice) {
      drawn_lattice_ =
          read_forward_field({wish.source}, header_.geometry, options_.cell_size, options_.common, {}).field;
      lattice_resampler_ = make_cpu_resampler(grid_, {.threads = options_.common.threads});
      lattice_resampler_->set_field(view(drawn_lattice_, Outside::background), {.stop = interrupt_token()});
      continue;
    }
    for (std::string& note : notes_of_file(wish.source, options_.common.nifti_frame)) notes_.push_back(std::move(note));
    auto map = std::make_shared<AnyVolume>(read_image(wish.source, options_.common.nifti_frame));
    require(same_grid(map->geometry(), grid_, 0.01 * std::min({grid_.spacing.x, grid_.spacing.y, grid_.spacing.z})) &&
                map->components() == 1,
            "an overlay has one value at each voxel of VOLUME, " + to_string(grid_.size) + ", found " +
                to_string(map->geometry().size) + ", or another place, " + wish.source);
    files_.back() = map;
  }
}

void RenderScene::read_fields(const Control& control) {
  const Geometry& source = header_.geometry;
  if (!options_.pull_field.empty()) {
    field_.direction = Direction::pull;
    field_.pull = read_pull_field(options_.pull_field, source, grid_, options_.common, control, field_);
    for (const std::string& note : field_.notes) notes_.push_back(note);
  } else if (options_.sequence.empty()) {
    field_.forward = read_forward_field(options_.fields, source, options_.cell_size, options_.common, control);
    notes_.insert(notes_.end(), field_.forward.notes.begin(), field_.forward.notes.end());
  }
}

void RenderScene::set_frame_field(double amount, const Control& control) {
  const Limits limits{.threads = options_.common.threads};
  if (!resampler_) {
    Backend backend = make_backend(options_.backend, field_.direction, grid_, options_.device, limits);
    backend_ = backend.name;
    resampler_ = std::move(backend.resampler);
  }
  if (field_.direction == Direction::pull) {
    const PullField* shown = &field_.pull;
    if (amount != 1) {
      frame_pull_ = field_.pull;
      scale(frame_pull_.displacement, amount);
      shown = &frame_pull_;
    }
    return resampler_->set_field(view(*shown, options_.outside), control);
  }
  shown_field_ = &field_.forward.field;
  if (amount != 1) {
    frame_field_ = field_.forward.field;
    scale(frame_field_.displacement, amount);
    scale(frame_field_.mesh.displacement, amount);
    shown_field_ = &frame_field_;
  }
  resampler_->set_field(view(*shown_field_, options_.outside), control);
}

void RenderScene::show(std::size_t frame) {
  if (!deforms_) return;
  const Control control{.stop = interrupt_token()};
  if (!options_.sequence.empty())
    field_.forward = read_forward_field({options_.sequence[frame]}, header_.geometry, {}, options_.common, control);
  const bool grows = options_.frames > 1;
  set_frame_field(grows ? static_cast<double>(frame) / (options_.frames - 1) : 1, control);
  if (!output_.data()) output_ = AnyVolume(grid_, input_.volume.type());
  const Target target{.source = std::as_const(input_.volume).view(),
                      .output = output_.view(),
                      .interpolation = Interpolation::linear,
                      .background = options_.fill.value_or(input_.background),
                      .padding = input_.is_dicom() ? input_.dicom->padding : std::nullopt};
  resampler_->resample(whole(grid_), {&target, 1}, {}, control);
}

ConstVolumeView RenderScene::volume() const { return deforms_ ? output_.view() : input_.volume.view(); }

const VertexField* RenderScene::lattice_field() const {
  for (const OverlayWish& wish : wishes_) {
    if (wish.kind != OverlayKind::lattice) continue;
    const VertexField& field = wish.source.empty() ? *shown_field_ : drawn_lattice_;
    return field.lattice.size.x > 0 ? &field : nullptr;
  }
  return nullptr;
}

OwnedOverlay RenderScene::computed(OverlayKind kind, const Region& region) {
  if (kind != OverlayKind::lattice && kind != OverlayKind::coverage)
    return make_map(*resampler_, grid_, kind, region, {});
  // Coverage needs a volume to be resampled: it tells whether a value came through.
  Geometry part = grid_;
  part.size = region.end - region.begin;
  AnyVolume slab(part, input_.volume.type());
  VolumeView slab_view = slab.view();
  slab_view.geometry = &grid_;
  slab_view.buffered = region;
  const Target target{.source = std::as_const(input_.volume).view(), .output = slab_view};
  OwnedOverlay made = make_map(*resampler_, grid_, kind, region,
                               kind == OverlayKind::coverage ? std::span(&target, 1) : std::span<const Target>());
  if (shown_field_) made.overlay.lattice = shown_field_->lattice;
  return made;
}

OwnedOverlay RenderScene::from_file(const OverlayWish& wish, const Region& region) {
  if (wish.kind == OverlayKind::lattice) {
    OwnedOverlay made = make_map(*lattice_resampler_, grid_, wish.kind, region, {});
    made.overlay.lattice = drawn_lattice_.lattice;
    return made;
  }
  const auto at = static_cast<std::size_t>(&wish - wishes_.data());
  return {{wish.kind, files_[at]->view()}, files_[at]};
}

OwnedOverlay RenderScene::overlay(const OverlayWish& wish, const Region& region) {
  return wish.source.empty() ? computed(wish.kind, region) : from_file(wish, region);
}

std::string RenderScene::field_title(std::size_t frame) const {
  if (!options_.sequence.empty()) return title_of_fields({options_.sequence[frame]}, "");
  return title_of_fields(options_.fields, options_.pull_field);
}

}  // namespace tetwarp::apps
