// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <nanobind/stl/array.h>
#include <nanobind/stl/filesystem.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>
#include <unistd.h>

#include <condition_variable>
#include <deque>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string_view>
#include <utility>

#include "io/scenario_file.h"
#include "io/staged_output.h"
#include "python/src/arrays.h"
#include "python/src/calls.h"
#include "python/src/fields.h"
#include "python/src/module.h"
#include "view/server/browser.h"
#include "view/server/viewer.h"
#include "view/session/default_scenario.h"

namespace tetwarp::python {

namespace {

using viewer::Viewer;

/// What is looked at, beside its voxels.
struct ViewInput {
  double background;
  std::optional<std::pair<double, double>> padding;  ///< first and last value that is no data
  std::optional<std::filesystem::path> scenario;     ///< a file
  std::optional<std::int64_t> cell_size;             ///< instead of the scenario's
};
/// How the page is served.
struct ViewPlace {
  std::vector<std::string> kinds;  ///< what the deformed volume may be saved as
  std::string folder;
  std::uint16_t port;  ///< 0: one that is free
  bool frames;
};

/// A viewer on voxels of Python.
///
/// None of its threads takes the interpreter's lock, so that its end waits for none that Python holds up: what a page
/// wishes is put into a queue, which a thread of Python reads.
class BoundViewer {
 public:
  BoundViewer(const ConstArray& ct, const Geometry& grid, const std::optional<ConstArray>& labels,
              const std::optional<Geometry>& labels_grid, const ViewInput& input, const ViewPlace& place,
              const std::string& backend, int device, int threads, const CallOptions& options)
      : ct_(ct), grid_(grid), labels_(labels), labels_grid_(labels_grid), process_(getpid()) {
    Viewer::Setup setup;
    setup.source = voxels_of(ct_, grid_, "the volume");
    require(setup.source.memory == Memory::host, "the volume lies on a device; the viewer takes one in host memory");
    std::optional<ConstVolumeView> labelled;
    if (labels_) {
      require(labels_grid_.has_value(), "the labels have no grid");
      labelled = voxels_of(*labels_, *labels_grid_, "the labels");
      require(labelled->memory == Memory::host, "the labels lie on a device; the viewer takes them in host memory");
    }
    setup.background = input.background;
    if (input.padding) setup.padding = PaddingRange{input.padding->first, input.padding->second};
    setup.device = device;
    setup.limits = {.threads = threads_of(threads)};
    setup.title = "Volume";
    setup.volume_kinds = place.kinds;
    setup.folder = place.folder;
    setup.port = place.port;
    setup.frames = place.frames;
    setup.labels = labelled;
    setup.save = [this](viewer::SaveJob job, std::function<void(Viewer::Saved)> done) {
      const std::lock_guard lock(mutex_);
      wishes_.emplace_back(std::move(job), std::move(done));
      wake_.notify_one();
    };
    run_call(options, false, [&](const Control& control) {
      setup.backend = kind_of(backend);
      setup.scenario = input.scenario ? read_scenario(*input.scenario)
                                      : viewer::default_scenario(grid_, runs_on_device(setup.backend));
      if (input.cell_size) setup.scenario.cell_size = *input.cell_size;
      setup.patient = simulate::examine(setup.source, labelled ? &*labelled : nullptr, setup.scenario.cell_size,
                                        setup.scenario.body_above_hu, {.stop = control.stop});
      viewer_ = std::make_unique<Viewer>(std::move(setup));
    });
  }
  ~BoundViewer() {
    if (getpid() != process_) static_cast<void>(viewer_.release());  // a fork has not its threads
  }
  BoundViewer(const BoundViewer&) = delete;
  BoundViewer& operator=(const BoundViewer&) = delete;

  int port() { return it().port(); }
  std::string address() { return it().address(); }
  /// Opens a browser. @return whether one was started
  bool open() {
    const WithoutGil released;
    browser_ = std::make_unique<viewer::Browser>(it().address());
    return browser_->is_open();
  }
  /// Field, text of the scenario and number of frames; what is not wanted is None or empty.
  nb::tuple done(bool with_field, bool with_scenario) {
    Viewer::Done done;
    {
      const WithoutGil released;
      done = it().done(with_field, with_scenario);
    }
    const nb::object field = with_field ? nb::object(as_tuple(std::move(done.field))) : nb::object(nb::none());
    return nb::make_tuple(field, done.scenario, done.frames);
  }
  /// Waits for what a page wishes: name, kind of volume, text of the scenario, whether the field is wished, and PNG
  /// files of panes by their names. None: the viewer ends.
  nb::object next_wish() {
    std::optional<viewer::SaveJob> job;
    {
      WithoutGil released;
      std::unique_lock lock(mutex_);
      wake_.wait(lock, released.stop.get_token(), [this] { return ends_ || !wishes_.empty(); });
      if (!wishes_.empty()) {
        job = std::move(wishes_.front().first);
        answer_ = std::move(wishes_.front().second);
        wishes_.pop_front();
      }
    }
    if (!job) return nb::none();
    nb::dict pictures;
    for (const auto& [pane, bytes] : job->pictures) pictures[pane.c_str()] = nb::bytes(bytes.data(), bytes.size());
    return nb::make_tuple(job->wish.name, job->wish.volume, job->scenario, job->wish.field, pictures);
  }
  /// Says what became of the wish that was given last.
  void answer(std::vector<std::string> files, std::string command, std::string problem) {
    const std::lock_guard lock(mutex_);
    if (answer_) std::exchange(answer_, {})({std::move(files), std::move(command), std::move(problem)});
  }
  /// Ends the stage: no further wish comes, and `next_wish` gives None after those that came.
  void stop() {
    const WithoutGil released;
    it().stop();
    const std::lock_guard lock(mutex_);
    ends_ = true;
    wake_.notify_all();
  }
  /// Closes the line to the page, after `stop`. Nothing else may be called then but `answer`, which does nothing.
  void close() {
    const WithoutGil released;
    {
      const std::lock_guard lock(mutex_);
      answer_ = {};
      wishes_.clear();
    }
    browser_.reset();
    viewer_.reset();
  }

 private:
  /// @throws InputError after `close`
  Viewer& it() {
    require(viewer_ != nullptr, "the viewer is closed");
    return *viewer_;
  }

  const ConstArray ct_;
  const Geometry grid_;
  const std::optional<ConstArray> labels_;
  const std::optional<Geometry> labels_grid_;
  const pid_t process_;
  std::mutex mutex_;  ///< of the next four
  std::condition_variable_any wake_;
  std::deque<std::pair<viewer::SaveJob, std::function<void(Viewer::Saved)>>> wishes_;
  bool ends_ = false;
  std::function<void(Viewer::Saved)> answer_;  ///< to the wish that was taken last
  std::unique_ptr<Viewer> viewer_;
  std::unique_ptr<viewer::Browser> browser_;
};

/// Writes bytes to a file that is not there yet; it appears when it is complete.
void write_bytes(const std::filesystem::path& path, const nb::bytes& bytes) {
  const std::string_view written(bytes.c_str(), bytes.size());
  const WithoutGil released;
  write_new_file(path, written);
}

}  // namespace

void add_view(nb::module_& core) {
  nb::class_<ViewInput>(core, "ViewInput")
      .def(
          "__init__",
          [](ViewInput* self, double background, std::optional<std::pair<double, double>> padding,
             std::optional<std::filesystem::path> scenario, std::optional<std::int64_t> cell_size) {
            new (self) ViewInput{background, padding, std::move(scenario), cell_size};
          },
          nb::arg("background"), nb::arg("padding").none(), nb::arg("scenario").none(), nb::arg("cell_size").none());
  nb::class_<ViewPlace>(core, "ViewPlace")
      .def(
          "__init__",
          [](ViewPlace* self, std::vector<std::string> kinds, std::string folder, std::uint16_t port, bool frames) {
            new (self) ViewPlace{std::move(kinds), std::move(folder), port, frames};
          },
          nb::arg("kinds"), nb::arg("folder"), nb::arg("port"), nb::arg("frames"));
  nb::class_<BoundViewer>(core, "Viewer")
      .def(
          nb::init<const ConstArray&, const Geometry&, const std::optional<ConstArray>&, const std::optional<Geometry>&,
                   const ViewInput&, const ViewPlace&, const std::string&, int, int, const CallOptions&>(),
          nb::arg("ct"), nb::arg("grid"), nb::arg("labels").none(), nb::arg("labels_grid").none(), nb::arg("input"),
          nb::arg("place"), nb::arg("backend"), nb::arg("device"), nb::arg("threads"), nb::arg("options"))
      .def_prop_ro("port", &BoundViewer::port)
      .def_prop_ro("address", &BoundViewer::address)
      .def("open", &BoundViewer::open)
      .def("done", &BoundViewer::done, nb::arg("with_field"), nb::arg("with_scenario"))
      .def("next_wish", &BoundViewer::next_wish)
      .def("answer", &BoundViewer::answer, nb::arg("files"), nb::arg("command"), nb::arg("problem"))
      .def("stop", &BoundViewer::stop)
      .def("close", &BoundViewer::close);
  core.def("forwarding_command", &viewer::forwarding_command, nb::arg("port"));
  core.def("write_bytes", &write_bytes, nb::arg("path"), nb::arg("bytes"));
  core.def("has_desktop", &viewer::has_desktop);
  core.def("came_by_ssh", &viewer::came_by_ssh);
}

}  // namespace tetwarp::python
