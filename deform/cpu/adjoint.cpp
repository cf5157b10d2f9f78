// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "deform/adjoint.h"

#include <tbb/blocked_range.h>
#include <tbb/enumerable_thread_specific.h>
#include <tbb/parallel_for.h>

#include <algorithm>
#include <atomic>
#include <variant>
#include <vector>

#include "deform/core/adjoint.h"
#include "deform/cpu/arena.h"
#include "deform/field_check.h"
#include "deform/snapped_mesh.h"
#include "deform/target_check.h"

namespace tetwarp {

namespace cpu {

namespace {

/// What is known of every voxel of the output, and the tetrahedra by number.
struct Owned {
  std::vector<std::uint32_t> tetrahedron;  ///< as `Maps::tetrahedra`
  std::vector<std::uint8_t> mapped;        ///< whether it comes from somewhere, perhaps staying; empty: if it is owned
  std::variant<LatticeTetrahedra, MeshTetrahedra> tetrahedra;
  Nudge nudge;
  bool coarse = false;
};

/// Makes the larger one of two numbers the first. Neither is NaN.
void raise(std::atomic<double>& largest, double value) {
  double known = largest.load(std::memory_order_relaxed);
  while (value > known && !largest.compare_exchange_weak(known, value, std::memory_order_relaxed)) continue;
}

/// What a thread keeps of tetrahedra that it met: a tetrahedron is met again in the rows beside.
/// @tparam Kept  has `number`, kNoTetrahedron at first, and is made anew by `hold`
template <class Kept>
class KeptTetrahedra {
 public:
  KeptTetrahedra() : kept_(kRoom) {}

  /// What is kept of a tetrahedron. @param hold  `hold(kept)` makes it, in the place of another one
  template <class Hold>
  Kept& at(std::uint32_t number, Hold&& hold) {
    Kept& kept = kept_[number * 2654435761u >> (32 - kBits)];  // multiplicative hashing (Knuth, vol. 3, 6.4)
    if (kept.number != number) {
      hold(kept);
      kept.number = number;
    }
    return kept;
  }
  std::vector<Kept>& all() { return kept_; }

 private:
  static constexpr int kBits = 11;
  static constexpr std::size_t kRoom = 1 << kBits;
  std::vector<Kept> kept_;
};

/// The passes of a call over the voxels of the output.
/// @tparam Tetrahedra  gives the tetrahedron with a number
template <class V, bool kCoarse, class Tetrahedra>
class Passes {
 public:
  Passes(Arena& arena, const Geometry& output, const Owned& owned, const Tetrahedra& tetrahedra,
         const std::vector<AdjointPlan<V>>& plans, const Control& control)
      : arena_(arena),
        size_(output.size),
        owned_(owned),
        tetrahedra_(tetrahedra),
        plans_{plans.data(), static_cast<int>(plans.size())},
        control_(control) {}

  /// dL/d(displacement), one a vertex.
  /// @param output_from_mm  linear map of the output grid
  /// @param of_owners       memory for a vector a voxel
  void find_displacement(std::span<glm::vec3> gradient, const glm::dmat3& output_from_mm,
                         std::vector<glm::vec3>& of_owners) {
    std::atomic<double> largest = 0;
    std::atomic<bool> all_finite = true;
    of_owners.resize(owned_.tetrahedron.size());
    for_each_row<Place>([&](std::int64_t first, const glm::i64vec3& at, KeptTetrahedra<Place>& kept) {
      float most = 0;
      bool finite = true;
      for_each_owned(first, at, [&](std::int64_t n, const glm::i64vec3& voxel, std::uint32_t number) {
        const Place& place = place_of(kept, number);
        const glm::vec3 h = place.map.pull_back(plans_.of_place(n, voxel, offset(place, voxel)));
        of_owners[static_cast<std::size_t>(n)] = h;
        for (int axis = 0; axis < 3; ++axis) {
          const float size = std::fabs(h[axis]);
          if (size - size != 0) finite = false;
          most = size > most ? size : most;  // never NaN
        }
      });
      if (!finite) all_finite = false;
      if (finite) raise(largest, most);
    });
    if (!all_finite) {
      std::fill(gradient.begin(), gradient.end(), glm::vec3(NAN));
      return;
    }
    const Quantum quantum(static_cast<double>(size_.x * size_.y * size_.z), largest);
    std::vector<std::int64_t> sums(3 * gradient.size());
    for_each_row<Corners>(
        [&](std::int64_t first, const glm::i64vec3& at, KeptTetrahedra<Corners>& kept) {
          for_each_owned(first, at, [&](std::int64_t n, const glm::i64vec3& voxel, std::uint32_t number) {
            Corners& of = kept.at(number, [&](Corners& corners) {
              corners.give_to(sums);
              const NumberedTetrahedron t = tetrahedra_(number);
              std::copy_n(t.vertex, 4, corners.vertex);
              corners.map = WeightMap(t.t);
            });
            float weight[4];
            of.map.weights(
                voxel, owned_.nudge.signs(voxel), [&] { return tetrahedra_(number).t; }, weight);
            const glm::dvec3 h(of_owners[static_cast<std::size_t>(n)]);
            for (int corner = 0; corner < 4; ++corner) {
              for (int axis = 0; axis < 3; ++axis)
                of.part[corner][axis] += quantum.steps(double{weight[corner]} * h[axis]);
            }
          });
        },
        [&](KeptTetrahedra<Corners>& kept) {
          for (Corners& of : kept.all()) of.give_to(sums);
        });
    arena_.execute([&] {
      tbb::parallel_for(tbb::blocked_range<std::size_t>(0, gradient.size(), 4096), [&](const auto& range) {
        for (std::size_t n = range.begin(); n < range.end(); ++n) {
          const glm::dvec3 g(quantum.value(sums[3 * n]), quantum.value(sums[3 * n + 1]),
                             quantum.value(sums[3 * n + 2]));
          gradient[n] = per_mm(output_from_mm, g);
        }
      });
    });
  }

  /// dL/d(source) of a target, from its `AdjointPlan::sums`.
  void find_source(const AdjointPlan<V>& plan, V* gradient) {
    std::atomic<double> largest = 0;
    std::atomic<bool> all_finite = true;
    for_each_row<Place>([&](std::int64_t first, const glm::i64vec3&, KeptTetrahedra<Place>&) {
      double most = 0;
      for (std::int64_t n = first; n < first + size_.x; ++n) {
        if (is_mapped(n)) most = std::max(most, largest_given(plan, n));
      }
      raise(largest, most);
    });
    const Quantum quantum(static_cast<double>(size_.x * size_.y * size_.z), largest);
    const auto add = [](std::int64_t& sum, std::int64_t steps) {
      std::atomic_ref(sum).fetch_add(steps, std::memory_order_relaxed);
    };
    for_each_row<Place>([&](std::int64_t first, const glm::i64vec3& at, KeptTetrahedra<Place>& kept) {
      bool finite = true;
      for_each_owned(first, at, [&](std::int64_t n, const glm::i64vec3& voxel, std::uint32_t number) {
        finite = add_to_source(plan, n, voxel, offset(place_of(kept, number), voxel), quantum, add) && finite;
      });
      for (std::int64_t i = 0; i < size_.x && !owned_.mapped.empty(); ++i) {  // those that stay
        const std::int64_t n = first + i;
        if (owned_.tetrahedron[static_cast<std::size_t>(n)] == kNoTetrahedron && is_mapped(n)) {
          const glm::i64vec3 voxel = at + glm::i64vec3(i, 0, 0);
          finite = add_to_source(plan, n, voxel, typename PlaceMap<kCoarse>::Offset{}, quantum, add) && finite;
        }
      }
      if (!finite) all_finite = false;
    });
    const std::int64_t count = plan.source.size.x * plan.source.size.y * plan.source.size.z * plan.components;
    arena_.execute([&] {
      tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, count, 16384), [&](const auto& range) {
        for (std::int64_t n = range.begin(); n < range.end(); ++n)
          gradient[n] = all_finite ? static_cast<V>(quantum.value(plan.sums[n])) : static_cast<V>(NAN);
      });
    });
  }

 private:
  /// What is kept of a tetrahedron where its voxels' places are wanted.
  struct Place {
    std::uint32_t number = kNoTetrahedron;
    PlaceMap<kCoarse> map{};
  };
  /// What is kept of a tetrahedron where its vertices get something.
  struct Corners {
    std::uint32_t number = kNoTetrahedron;
    std::uint32_t vertex[4]{};
    WeightMap map{};
    std::int64_t part[4][3]{};  ///< what they got, quanta

    /// Adds what the vertices got to their sums.
    void give_to(std::vector<std::int64_t>& sums) {
      for (int corner = 0; corner < 4; ++corner) {
        for (int axis = 0; axis < 3; ++axis) {
          if (part[corner][axis] != 0) {
            std::atomic_ref(sums[3 * std::size_t{vertex[corner]} + static_cast<std::size_t>(axis)])
                .fetch_add(part[corner][axis], std::memory_order_relaxed);
          }
          part[corner][axis] = 0;
        }
      }
    }
  };

  bool is_mapped(std::int64_t n) const {
    const auto at = static_cast<std::size_t>(n);
    return owned_.mapped.empty() ? owned_.tetrahedron[at] != kNoTetrahedron : owned_.mapped[at] != 0;
  }
  const Place& place_of(KeptTetrahedra<Place>& kept, std::uint32_t number) const {
    return kept.at(number, [&](Place& place) { place.map = PlaceMap<kCoarse>(tetrahedra_(number).t); });
  }
  auto offset(const Place& place, const glm::i64vec3& voxel) const {
    return place.map.offset(voxel, owned_.nudge.signs(voxel), [&] { return tetrahedra_(place.number).t; });
  }

  /// Calls `visit(number of the voxel, voxel, number of its owner)` for voxels of a row.
  template <class Visit>
  void for_each_owned(std::int64_t first, const glm::i64vec3& at, Visit&& visit) const {
    for (std::int64_t i = 0; i < size_.x; ++i) {
      const std::uint32_t owner = owned_.tetrahedron[static_cast<std::size_t>(first + i)];
      if (owner != kNoTetrahedron) visit(first + i, at + glm::i64vec3(i, 0, 0), owner);
    }
  }

  /// Calls `work(number of the first voxel, that voxel, what the thread keeps)` for all rows, and at last
  /// `finish(kept)` for each thread.
  template <class Kept, class Work, class Finish>
  void for_each_row(Work&& work, Finish&& finish) {
    constexpr std::int64_t kRows = 16;
    tbb::enumerable_thread_specific<KeptTetrahedra<Kept>> kept;
    arena_.execute([&] {
      tbb::parallel_for(tbb::blocked_range<std::int64_t>(0, size_.y * size_.z, kRows), [&](const auto& range) {
        if (control_.stop.stop_requested()) throw Cancelled();
        KeptTetrahedra<Kept>& of_thread = kept.local();
        for (std::int64_t row = range.begin(); row < range.end(); ++row)
          work(row * size_.x, glm::i64vec3(0, row % size_.y, row / size_.y), of_thread);
      });
    });
    for (KeptTetrahedra<Kept>& of_thread : kept) finish(of_thread);
  }
  template <class Kept, class Work>
  void for_each_row(Work&& work) {
    for_each_row<Kept>(std::forward<Work>(work), [](KeptTetrahedra<Kept>&) {});
  }

  Arena& arena_;
  glm::i64vec3 size_;
  const Owned& owned_;
  const Tetrahedra& tetrahedra_;
  AdjointPlans<V> plans_;
  const Control& control_;
};

class Adjoint final : public ResampleAdjoint {
 public:
  Adjoint(const Geometry& output, const Limits& limits)
      : ResampleAdjoint(output), arena_(limits), resampler_(make_cpu_resampler(output, limits)) {}

  void set_field(const FieldView& field, const Control& control) override {
    ready_ = false;
    resampler_->set_field(field, {.jacobian_range = false}, {.stop = control.stop});
    const auto voxels = static_cast<std::size_t>(voxel_count(output()));
    owned_.tetrahedron.resize(voxels);
    owned_.mapped.resize(field.outside == Outside::rest ? voxels : 0);
    Maps maps{.tetrahedra = map_view(owned_.tetrahedron, VoxelType::u32)};
    if (!owned_.mapped.empty()) maps.coverage = map_view(owned_.mapped, VoxelType::u8);
    resampler_->resample(whole(output()), {}, maps, control);
    if (field.mesh) {
      arena_.execute([&] { mesh_ = snap_mesh(output(), field, control); });
      const auto of_mesh = field.mesh->tetrahedra.size();
      owned_.tetrahedra =
          MeshTetrahedra{mesh_.vertices.data(), mesh_.tetrahedra.data(),
                         static_cast<std::uint32_t>(mesh_.tetrahedra.size() - of_mesh), field.mesh->tetrahedra.data(),
                         static_cast<std::uint32_t>(vertex_count(field) - std::ssize(field.mesh->rest))};
      owned_.nudge = mesh_.nudge;
      owned_.coarse = mesh_.coarse;
    } else {
      const LatticeFrame frame = make_lattice_frame(output(), field);
      owned_.tetrahedra = LatticeTetrahedra{frame, field.displacement};
      owned_.nudge = frame.nudge;
      owned_.coarse = frame.coarse;
    }
    vertices_ = static_cast<std::size_t>(vertex_count(field));
    ready_ = true;
  }

  void apply(std::span<const AdjointTarget> targets, const DisplacementGradient& displacement,
             const Control& control) override {
    require(ready_, "apply needs a field: call set_field first");
    check_adjoint(output(), targets, displacement, vertices_);
    for (const AdjointTarget& target : targets) {
      require_host(target.source.memory, "a source");
      require_host(target.output_gradient.memory, "the gradient of an output");
      require_host(target.source_gradient.memory, "the gradient of a source");
    }
    require_host(displacement.memory, "the gradient of the displacement");
    if (targets.empty()) {
      std::fill(displacement.values.begin(), displacement.values.end(), glm::vec3(0));
    } else if (targets.front().source.type == VoxelType::f32) {
      apply_to<float>(targets, displacement, control);
    } else {
      apply_to<double>(targets, displacement, control);
    }
  }

 private:
  template <class T>
  VolumeView map_view(std::vector<T>& values, VoxelType type) const {
    return {&output(), whole(output()), type, 1, std::as_writable_bytes(std::span(values)).data()};
  }

  template <class V>
  void apply_to(std::span<const AdjointTarget> targets, const DisplacementGradient& displacement,
                const Control& control) {
    std::vector<AdjointPlan<V>> plans;
    std::vector<std::vector<double>> slices;
    std::vector<std::vector<std::int64_t>> sums;
    std::vector<V*> gradients;
    for (const AdjointTarget& target : targets) {
      const Geometry& grid = *target.source.geometry;
      const glm::i64vec3& size = grid.size;
      const int components = target.source.components;
      slices.push_back(uneven_slices(grid));
      gradients.push_back(reinterpret_cast<V*>(target.source_gradient.voxels));
      const bool wanted = gradients.back() != nullptr;
      sums.emplace_back(wanted ? static_cast<std::size_t>(voxel_count(grid) * components) : 0);
      plans.push_back({{reinterpret_cast<const V*>(target.source.voxels), size, glm::i64vec3(0),
                        glm::i64vec3(1, size.x, size.x * size.y) * std::int64_t{components}},
                       relate(grid, output(), slices.back().empty() ? nullptr : slices.back().data()),
                       components,
                       target.interpolation,
                       reinterpret_cast<const V*>(target.output_gradient.voxels),
                       wanted ? sums.back().data() : nullptr});
    }
    std::visit(
        [&](const auto& tetrahedra) {
          const auto run = [&](auto passes) {
            if (!displacement.values.empty())
              passes.find_displacement(displacement.values, index_from_point(output()).linear, of_owners_);
            for (std::size_t p = 0; p < plans.size(); ++p)
              if (gradients[p]) passes.find_source(plans[p], gradients[p]);
          };
          using Tetrahedra = std::decay_t<decltype(tetrahedra)>;
          if (owned_.coarse)
            run(Passes<V, true, Tetrahedra>(arena_, output(), owned_, tetrahedra, plans, control));
          else
            run(Passes<V, false, Tetrahedra>(arena_, output(), owned_, tetrahedra, plans, control));
        },
        owned_.tetrahedra);
  }

  Arena arena_;
  std::unique_ptr<ForwardResampler> resampler_;
  Owned owned_;
  SnappedMesh mesh_;                  ///< of a field that has a mesh
  std::vector<glm::vec3> of_owners_;  ///< of a call: a vector a voxel
  std::size_t vertices_ = 0;
  bool ready_ = false;
};

}  // namespace

}  // namespace cpu

std::unique_ptr<ResampleAdjoint> make_cpu_adjoint(const Geometry& output, Limits limits) {
  return std::make_unique<cpu::Adjoint>(output, limits);
}

}  // namespace tetwarp
