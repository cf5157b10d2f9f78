// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "view/server/messages.h"
#include "view/server/server.h"
#include "view/session/stage.h"

namespace tetwarp::viewer {

/// A volume that is looked at and worked on in the browser: a stage, and the server through which a page asks it.
///
/// It works on threads of its own from its construction to its end.
class Viewer {
 public:
  /// What became of a wish to save.
  struct Saved {
    std::vector<std::string> files = {};  ///< that were written
    std::string command = {};             ///< that makes the volume again
    std::string problem = {};             ///< why it failed; empty: it did not
  };
  struct Setup {
    ConstVolumeView source;                      ///< undeformed, one component, in host memory; must outlive the viewer
    std::optional<ConstVolumeView> labels = {};  ///< that go with it; must outlive the viewer
    double background = 0;                       ///< value where nothing maps
    std::optional<PaddingRange> padding = {};
    simulate::Patient patient;      ///< what was examined of the source; unused where there is a reel
    simulate::Scenario scenario;    ///< see `Session`; unused where there is a reel
    std::optional<Reel> reel = {};  ///< fields to show instead of what a hand does
    BackendKind backend = BackendKind::cpu;
    int device = 0;
    Limits limits = {};
    std::string title;                           ///< no name of a patient
    std::vector<std::string> volume_kinds = {};  ///< what the deformed volume may be saved as
    std::vector<std::string> film_kinds = {};    ///< and films
    std::string folder;                          ///< where files go, as the page shows it
    std::uint16_t port = 0;                      ///< 0: one that is free
    bool frames = false;                         ///< whether pages of this machine may show the page in a frame
    /// Is told what to save, by a thread of the stage, which it must not hold up. The name is a plain one
    /// (`require_plain_name`), and kinds are among those above.
    /// @param done  to be called once, from any thread, while the viewer lives
    std::function<void(SaveJob, std::function<void(Saved)> done)> save;
  };

  /// Begins to serve.
  /// @throws InputError for a source or a scenario that cannot be worked on, Error where the port is taken, DeviceError
  ///         and NotCompiled
  explicit Viewer(Setup setup);
  /// Ends what is under way, and closes all connections.
  ~Viewer();
  Viewer(const Viewer&) = delete;
  Viewer& operator=(const Viewer&) = delete;

  std::uint16_t port() const { return server_->port(); }
  /// Where the page is, with the token that a page must know now; see `Server::token`.
  std::string address() const;
  /// What was done so far.
  struct Done {
    VertexField field;     ///< in host memory
    std::string scenario;  ///< text of the file that repeats it; empty before the first frame
    int frames = 0;
  };
  /// Waits for a moment of the stage. Not to be called by its own threads.
  /// @throws Error after `stop`
  Done done(bool with_field, bool with_scenario);
  /// Ends the stage: nothing is simulated and no wish comes from now on. The line to the page stays.
  void stop();
  /// Where the time of the stage went, up to its end.
  StageTimes times();

 private:
  About about() const;
  Stage::Setup stage_setup();
  Stage::Listener listener();
  void save(SaveJob job);

  Setup setup_;
  StageTimes times_;
  // Made in this order, and ended in the opposite one.
  std::unique_ptr<Scene> scene_;
  std::mutex mutex_;  ///< of `stage_` and `is_watched_`, which the server's thread uses
  bool is_watched_ = false;
  std::unique_ptr<Server> server_;
  std::unique_ptr<Stage> stage_;
};

}  // namespace tetwarp::viewer
