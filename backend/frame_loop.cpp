// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "backend/frame_loop.h"

#include <exception>
#include <functional>
#include <optional>
#include <semaphore>
#include <stop_token>
#include <thread>
#include <utility>
#include <vector>

#include "backend/devices.h"
#include "backend/factories.h"

namespace tetwarp {

namespace {

/// What is done to one frame after another, by a thread of its own or by whoever begins it.
class Stage {
 public:
  using Work = std::function<void(int frame, const std::stop_token& stop)>;

  /// @param first  number of the first frame  @param has_thread  whether frames are worked on by a thread
  Stage(int first, bool has_thread, Work work) : next_(first), work_(std::move(work)) {
    if (has_thread) thread_ = std::jthread([this, first](const std::stop_token& stop) { run(first, stop); });
  }
  ~Stage() { request_stop(); }
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  bool has_thread() const { return thread_.joinable(); }
  bool has_begun(int frame) const { return frame < next_; }
  /// Begins the next frame; without a thread it is done then.
  void begin() {
    ++next_;
    if (has_thread()) {
      wanted_.release();
    } else {
      work_(next_ - 1, {});
    }
  }
  /// Waits for the frame that was begun last.
  void wait() {
    if (has_thread()) done_.acquire();
  }
  void request_stop() {
    if (!has_thread()) return;
    thread_.request_stop();
    wanted_.release();
  }

 private:
  void run(int frame, const std::stop_token& stop) {
    for (;; ++frame) {
      wanted_.acquire();
      const bool is_over = stop.stop_requested();
      if (!is_over) work_(frame, stop);
      done_.release();  // also for who waits for a frame that is not worked on any more
      if (is_over) return;
    }
  }

  int next_;
  Work work_;
  std::counting_semaphore<> wanted_{0}, done_{0};
  std::jthread thread_;  ///< ends before what it uses
};

/// A frame after it was simulated.
struct Simulated {
  simulate::FrameResult result;
  std::unique_ptr<simulate::DisplacementCopy> displacement;
  std::optional<VertexField> divided;  ///< the field, where open cuts divide cells
  std::exception_ptr failure;
};

/// A frame after the volume was deformed by it.
struct Deformed {
  simulate::FrameResult result;
  Update update;
  std::exception_ptr failure;
};

}  // namespace

class FrameLoop::Implementation {
 public:
  Implementation(const Parts& parts, BackendKind backend, int device)
      : parts_(parts),
        lattice_(parts.run.model().lattice),
        all_frames_(parts.run.frames()),
        frames_(all_frames_),
        shown_(parts.run.frames_done()),
        simulation_(shown_, backend != BackendKind::cpu, [this](auto... given) { simulate(given...); }),
        deformation_(shown_, backend != BackendKind::cpu, [this](auto... given) { deform(given...); }) {
    for (Simulated& frame : simulated_) frame.displacement = simulate::make_displacement_copy(backend, device);
    if (backend == BackendKind::cpu) return;
    simulating_.emplace(device, DeviceStream::Turn::first);
    deforming_.emplace(device, DeviceStream::Turn::first);
    drawing_.emplace(device);  // rays fill the device, and are not waited for by the frames after this
  }
  ~Implementation() {
    deformation_.request_stop();  // first: it may wait for a frame of the simulation that will not come
    volume_was_read_.release();   // it may wait for this, too
    simulation_.request_stop();
  }

  bool is_done() const { return shown_ == frames_; }

  ShownFrame next(const ViewPlane& plane) {
    require(!is_done(), "the scenario has no further frame");
    if (!deformation_.has_begun(shown_)) deformation_.begin();
    deformation_.wait();
    ++shown_;
    const Deformed frame = std::exchange(deformed_, {});
    if (frame.failure) {
      frames_ = shown_;  // the simulation cannot go on
      std::rethrow_exception(frame.failure);
    }
    if (deformation_.has_thread() && shown_ < frames_) deformation_.begin();
    const Control control = on(drawing_, {});
    read_volume(frame.update.changed, control);
    const std::span<std::uint8_t> rgb = room(3 * static_cast<std::size_t>(plane.width) * plane.height);
    parts_.renderer.render(plane, rgb, control);
    return {frame.result, frame.update.report, rgb};
  }

 private:
  /// Has the renderer read what a frame changed; then the volume may be deformed for the next one, whatever is thrown.
  void read_volume(std::span<const Region> changed, const Control& control) {
    struct Release {
      std::counting_semaphore<>& semaphore;
      ~Release() { semaphore.release(); }
    } const at_the_end{volume_was_read_};
    if (is_volume_set_) {
      parts_.renderer.update_volume(changed, control);
    } else {
      parts_.renderer.set_volume(parts_.target.output, control);
      is_volume_set_ = true;
    }
    if (drawing_) drawing_->wait();
  }

  static Control on(const std::optional<DeviceStream>& stream, const std::stop_token& stop) {
    return {.stop = stop, .stream = stream ? stream->get() : nullptr};
  }

  void simulate(int number, const std::stop_token& stop) {
    Simulated& frame = simulated_[number % 2];
    try {
      const Control control = on(simulating_, stop);
      frame.result = parts_.run.next(control);
      if (parts_.run.divides_cells()) {
        frame.divided = parts_.run.field();
      } else {
        frame.divided.reset();
        frame.displacement->take(parts_.run.simulation().displacement(), control.stream);
      }
    } catch (...) {
      frame.failure = std::current_exception();
    }
  }

  void deform(int number, const std::stop_token& stop) {
    if (!simulation_.has_begun(number)) simulation_.begin();
    simulation_.wait();
    if (stop.stop_requested()) return;
    const Simulated& frame = simulated_[number % 2];
    try {
      if (frame.failure) std::rethrow_exception(frame.failure);
      if (simulation_.has_thread() && number + 1 < all_frames_) simulation_.begin();
      const Control control = on(deforming_, stop);
      parts_.resampler.set_field(field_of(frame), {.jacobian_range = false}, control);
      volume_was_read_.acquire();
      if (stop.stop_requested()) return;
      deformed_.result = frame.result;
      deformed_.update = parts_.resampler.update({&parts_.target, 1}, control, parts_.seen);
    } catch (...) {
      deformed_.failure = std::current_exception();
    }
  }

  FieldView field_of(const Simulated& frame) const {
    if (frame.divided) return view(*frame.divided, parts_.outside);
    return {.lattice = &lattice_,
            .displacement = frame.displacement->values().data(),
            .outside = parts_.outside,
            .memory = frame.displacement->memory()};
  }

  /// Where a picture is put.
  std::span<std::uint8_t> room(std::size_t bytes) {
    if (!drawing_) {
      picture_.resize(bytes);
      return picture_;
    }
    if (!pinned_ || pinned_->bytes().size() != bytes) pinned_ = std::make_unique<PinnedMemory>(bytes);
    return pinned_->bytes();
  }

  Parts parts_;
  Geometry lattice_;
  const int all_frames_;
  int frames_, shown_;      ///< frames until the loop ends; and of them, shown
  Simulated simulated_[2];  ///< frames by number: one is simulated while the volume is deformed by the other
  Deformed deformed_;       ///< the frame that was deformed last
  std::counting_semaphore<> volume_was_read_{1};  ///< by the renderer, so that it may be written
  bool is_volume_set_ = false;                    ///< in the renderer
  std::vector<std::uint8_t> picture_;
  std::unique_ptr<PinnedMemory> pinned_;
  std::optional<DeviceStream> simulating_, deforming_, drawing_;
  Stage simulation_, deformation_;  ///< they end before what they use
};

FrameLoop::FrameLoop(const Parts& parts, BackendKind backend, int device)
    : it_(std::make_unique<Implementation>(parts, backend, device)) {}

FrameLoop::~FrameLoop() = default;

bool FrameLoop::is_done() const { return it_->is_done(); }

ShownFrame FrameLoop::next(const ViewPlane& plane) { return it_->next(plane); }

}  // namespace tetwarp
