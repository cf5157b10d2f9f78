// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/render/render_scene.h"

#include <algorithm>
#include <array>

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

OverlayWish parse_overlay(const std::string& text, const RenderOptions& options) {
  const std::size_t split = text.find('=');
  const std::string name = text.substr(0, split);
  const auto found = std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& kind) { return name == kind.first; });
  if (found == kKinds.end())
    throw UsageError("unknown overlay \"" + name + "\"; there are coverage, folds, jacobian and lattice");
  if (split != std::string::npos && split + 1 == text.size())
    throw UsageError("--overlay " + text + " names no file behind =");
  OverlayWish wish{text, found->second, {}, {}};
  if (split == std::string::npos) return wish;
  const std::string source = text.substr(split + 1);
  if (wish.kind == OverlayKind::lattice)
    wish.lattice = parse_forward_fields({source}, options.field.cell_size, options.common.nifti_frame);
  else
    wish.map = source;
  return wish;
}

}  // namespace

RenderFields parse_render_fields(const RenderOptions& options) {
  RenderFields fields;
  if (options.field.is_given()) fields.deforming = parse_field(options.field, options.common.nifti_frame);
  fields.sequence = parse_sequence(options.sequence, options.field.cell_size, options.common.nifti_frame);
  for (const std::string& text : options.overlays) fields.overlays.push_back(parse_overlay(text, options));
  return fields;
}

Reads reads_of(const RenderOptions& options, const RenderFields& fields) {
  Reads reads;
  if (fields.deforming) reads.add_field(*fields.deforming);
  for (const ForwardChoice& one : fields.sequence) reads.add_field(one);
  if (is_transfer_file(options)) reads.add_file(options.transfer);
  for (const OverlayWish& wish : fields.overlays) {
    if (wish.lattice) reads.add_field(*wish.lattice);
    if (!wish.map.empty()) reads.add_file(wish.map);
  }
  reads.add_volume(options.input);
  return reads;
}

bool is_transfer_file(const RenderOptions& options) {
  return std::filesystem::path(options.transfer).extension() == ".json";
}

RenderScene::RenderScene(const RenderOptions& options, const RenderFields& fields)
    : options_(options), fields_(fields), input_options_(options.input), deforms_(fields.deform()) {
  input_options_.hash = FileHash::left_out;
  const bool pulls = fields.deforming && std::holds_alternative<PullChoice>(*fields.deforming);
  for (const OverlayWish& wish : fields.overlays) {
    if (!wish.is_of_deformation()) continue;
    if (!deforms_)
      throw UsageError("--overlay " + wish.text + " needs the field that deforms VOLUME (-f), or a file: " + wish.text +
                       "=FILE");
    if (wish.kind == OverlayKind::lattice && pulls)
      throw UsageError("--overlay lattice needs a forward field; a pull field has no lattice that moves");
  }
  header_ = open_input(input_options_, options.common);
  grid_ = straightened(header_.geometry);
  notes_ = header_.notes;
}

RenderScene::~RenderScene() = default;

std::size_t RenderScene::frames() const {
  if (!fields_.sequence.empty()) return fields_.sequence.size();
  return static_cast<std::size_t>(std::max({options_.frames, options_.turntable, 1}));
}

void RenderScene::read() {
  {
    Stage stage(options_.common, "read");
    input_ = read_input(input_options_, header_, options_.common, stage.control());
  }
  if (!deforms_ && grid_ != header_.geometry) {  // then it is resampled onto a straight, even grid
    field_ = zero_pull_field(grid_);
    notes_.push_back("the slices of VOLUME lean or lie at uneven distances: it is shown resampled onto " +
                     to_string(grid_.size) + " voxels");
    deforms_ = true;
  } else if (deforms_) {
    Stage stage(options_.common, "field");
    read_field(stage.control());
  }
  for (const OverlayWish& wish : wishes()) read_overlay(wish);
}

void RenderScene::add_notes(const std::vector<std::string>& notes) {
  for (const std::string& note : notes) {
    if (std::ranges::find(notes_, note) == notes_.end()) notes_.push_back(note);
  }
}

void RenderScene::read_overlay(const OverlayWish& wish) {
  maps_.push_back(nullptr);
  if (wish.lattice) {
    ReadForwardField read = apps::read_field(*wish.lattice, header_.geometry, options_.common.threads, {});
    drawn_lattice_ = std::move(read.field);
    add_notes(read.origin.notes);
    lattice_resampler_ = make_cpu_resampler(grid_, {.threads = options_.common.threads});
    lattice_resampler_->set_field(view(drawn_lattice_, Outside::background), {}, {.stop = interrupt_token()});
  }
  if (wish.map.empty()) return;
  for (std::string& note : notes_of_file(wish.map, options_.common.nifti_frame)) notes_.push_back(std::move(note));
  auto map = std::make_shared<AnyVolume>(read_image(wish.map, options_.common.nifti_frame));
  require(same_grid(map->geometry(), grid_, 0.01 * std::min({grid_.spacing.x, grid_.spacing.y, grid_.spacing.z})) &&
              map->components() == 1,
          "an overlay has one value at each voxel of VOLUME, " + to_string(grid_.size) + ", found " +
              to_string(map->geometry().size) + ", or another place, " + wish.map.string());
  maps_.back() = map;
}

void RenderScene::read_field(const Control& control) {
  if (!fields_.deforming) return;  // of a sequence each is read when it is shown
  const Geometry& source = header_.geometry;
  const auto take = [&](auto&& read) {
    field_ = std::move(read.field);
    add_notes(read.origin.notes);
  };
  if (const auto* pull = std::get_if<PullChoice>(&*fields_.deforming))
    take(apps::read_field(*pull, grid_, options_.common.threads, control));
  else
    take(apps::read_field(std::get<ForwardChoice>(*fields_.deforming), source, options_.common.threads, control));
}

void RenderScene::set_frame_field(double amount, const Control& control) {
  if (!resampler_) {
    const Limits limits{.threads = options_.common.threads};
    resampler_ = make_resampler_for(field_, grid_, {options_.backend, options_.device}, limits);
    backend_ = name_of(resampler_.backend());
  }
  shown_field_ = &field_;
  if (amount != 1) {
    frame_field_ = scaled(field_, amount);
    shown_field_ = &frame_field_;
  }
  set_field(resampler_, *shown_field_, options_.outside, {}, control);
}

void RenderScene::show(std::size_t frame) {
  if (!deforms_) return;
  const Control control{.stop = interrupt_token()};
  if (!fields_.sequence.empty()) {
    ReadForwardField read =
        apps::read_field(fields_.sequence[frame], header_.geometry, options_.common.threads, control);
    field_ = std::move(read.field);
    add_notes(read.origin.notes);
  }
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
  for (const OverlayWish& wish : wishes()) {
    if (wish.kind != OverlayKind::lattice) continue;
    const VertexField& field = wish.lattice ? drawn_lattice_ : *shown_forward_field();
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
  if (const VertexField* shown = shown_forward_field()) made.overlay.lattice = shown->lattice;
  return made;
}

OwnedOverlay RenderScene::from_file(const OverlayWish& wish, const Region& region) {
  if (wish.lattice) {
    OwnedOverlay made = make_map(*lattice_resampler_, grid_, wish.kind, region, {});
    made.overlay.lattice = drawn_lattice_.lattice;
    return made;
  }
  const auto at = static_cast<std::size_t>(&wish - wishes().data());
  return {{wish.kind, maps_[at]->view()}, maps_[at]};
}

OwnedOverlay RenderScene::overlay(const OverlayWish& wish, const Region& region) {
  return wish.is_of_deformation() ? computed(wish.kind, region) : from_file(wish, region);
}

std::string RenderScene::field_title(std::size_t frame) const {
  if (!fields_.sequence.empty()) return title_of(fields_.sequence[frame]);
  return fields_.deforming ? title_of(*fields_.deforming) : "";
}

}  // namespace tetwarp::apps
