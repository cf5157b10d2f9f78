// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <array>
#include <chrono>
#include <condition_variable>
#include <deque>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <thread>

#include "view/session/pane_line.h"
#include "view/session/request.h"
#include "view/session/session.h"

namespace tetwarp::viewer {

/// What a page shows beside pictures.
struct State {
  std::uint32_t request = 0;  ///< number of the last request that was taken
  int frames = 0;             ///< simulated so far
  bool is_moving = false;     ///< whether further ones are to come
  bool can_undo = false, can_redo = false, holds = false;
  std::vector<glm::dvec4> pins;                    ///< where what is pinned lies: centre, LPS mm, and radius, mm
  std::optional<glm::dvec4> ball;                  ///< centre, LPS mm, and radius, mm
  std::vector<std::pair<std::string, bool>> cuts;  ///< name, and whether it is open
  bool can_play = false, plays = false;            ///< phases of the given scenario, or the reel
  int frame = 0;                                   ///< of the reel
  simulate::Method method = simulate::Method::chainmail;
  std::vector<simulate::Tissue> tissues;
  std::optional<Quality> quality;     ///< of what is seen; empty while it is not known
  std::optional<glm::dvec3> fold_at;  ///< LPS mm of the worst tetrahedron, where one is turned inside out or flat
  glm::dvec3 cursor_mm{0};            ///< where all slices meet
  SliceLook look;
  std::string style;  ///< name of the transfer function
  /// Of each pane the number of its last picture, if that is exact and shows the last request; else of the next one.
  std::array<std::uint32_t, request::kPanes> pictures{};
};

/// Fields that were made before, and are shown one by one instead of what a hand does.
struct Reel {
  int frames = 1;
  bool grows = false;  ///< whether one field grows, from nothing in frame 0 to all of it in the last; else a sequence
  bool pulls = false;  ///< whether they are pull fields
  /// Makes the field of a frame, from 0.
  std::function<AnyField(int)> field;
};

/// What is to be kept, as it is when it is asked for.
struct SaveJob {
  request::Save wish;
  std::uint32_t number = 0;  ///< of the request
  bool is_by_hand = true;    ///< whether hands worked; else a reel is shown
  std::string scenario;      ///< text of what was done; empty where nothing was
  int frames = 0;            ///< of the scenario
  bool has_cuts = false;     ///< whether it has any, so that fields are meshes
  int frame = 0;             ///< of the reel
  Camera camera;
  glm::dvec3 cursor_mm{0};  ///< where all slices meet
  SliceLook look;
  std::string style;  ///< name of the transfer function
  /// What the panes show: their names and PNG files.
  std::vector<std::pair<std::string, std::vector<std::byte>>> pictures;
};

/// An answer to a request.
struct Answer {
  enum class Kind : std::uint8_t {
    held,     ///< what was gripped, pinned or touched lies at `at_mm`
    value,    ///< of a probe
    nothing,  ///< nothing is seen there, or nobody has a value there
    problem   ///< it could not be done; `text` says why
  } kind = Kind::nothing;
  std::uint32_t number = 0;  ///< of the request
  glm::dvec3 at_mm{0};       ///< of the deformed picture
  double after = 0, before = 0;
  std::string text = {};
};

/// How often something was done, and how long all of it took.
struct Spent {
  int count = 0;
  double seconds = 0;
};
/// Where the time of a stage went.
struct StageTimes {
  Spent steps,  ///< of the simulation
      slices,   ///< pictures of slices; the first one of a field makes it ready
      volumes,  ///< pictures of the volume, with deforming it
      rests;    ///< exact volumes
};

/// A session, or a reel of fields, on a thread of its own, which takes requests in order, steps while something moves,
/// and makes pictures as fast as they are shown. It knows no network.
class Stage {
 public:
  /// Who is told of what comes out. Calls come from threads of the stage, one at a time for each function.
  struct Listener {
    std::function<void(Picture)> picture;
    std::function<void(State)> state;
    std::function<void(Answer)> answer;
    std::function<void(SaveJob)> save;
  };
  struct Setup {
    simulate::Scenario scenario;       ///< see `Session`
    const simulate::Patient* patient;  ///< null where a reel is shown
    Scene* scene;
    std::optional<Reel> reel = {};
    std::function<simulate::MakeSimulation(simulate::Method)> make;
    bool has_device = false;  ///< so that pictures of what moves need not be small
    std::size_t most_snapshot_bytes = Session::kMostSnapshotBytes;
  };

  /// Patient and scene must outlive the stage.
  Stage(Setup setup, Listener listener);
  /// Ends what is under way.
  ~Stage();
  Stage(const Stage&) = delete;
  Stage& operator=(const Stage&) = delete;

  /// Asks for something; comes back at once.
  void ask(Request request);
  /// Somebody looks from now on: everything is shown anew. Or nobody does: nothing is simulated.
  void watch(bool somebody);
  /// Lets a function see the session between two things that the stage does, after all that was asked before; comes
  /// back at once.
  /// @return  is ready when the function has come back, and has what it threw; or has std::future_error where the stage
  ///          ended before
  std::future<void> visit(std::function<void(const Session&)> see);
  /// Where the time went so far.
  StageTimes times();

 private:
  class Timer;
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kSlices = 3;  ///< the first panes
  static constexpr int kMostPixels = 1600;   ///< on a side of the volume's picture

  void run(const std::stop_token& stop);
  Clock::time_point work();
  bool take_requests();
  void receive_visits();
  void take(const Request& request);
  void refuse(std::uint32_t number, const std::exception& error);
  void step();
  void next_frame();
  void show_frame(int frame);
  bool is_due(const PaneLine& line) const;
  bool is_smooth() const;
  Clock::duration pictures_took() const;
  bool show_panes();
  void show(PaneLine& line, request::Pane pane, bool is_exact, const Control& control);
  void rest();
  Session& session() const;
  int frames() const;
  std::optional<glm::dvec3> worst(const Control& control) const;
  void changed_field();
  void all_is_new();
  std::vector<glm::dvec4> pin_places();
  void tell_state();
  void begin_session(simulate::Method method);
  std::optional<glm::dvec3> place(const request::Pointed& pointed);
  glm::dvec3 seen(const request::Pointed& pointed);
  glm::dvec3 undeformed(const glm::dvec3& at_mm);
  ViewPlane plane(const PaneLine& line, int most) const;
  PaneImage image(request::Pane pane);
  void change(const std::function<void()>& how);
  void all_stale(bool slices, bool volume);

  // One for each request.
  void on(const request::Size&);
  void on(const request::Look&);
  void on(const request::Turn&);
  void on(const request::Levels&);
  void on(const request::Style&);
  void on(const request::Compare&);
  void on(const request::LayOver&);
  void on(const request::Probe&);
  void on(const request::Shown&);
  void on(const request::Grip&);
  void on(const request::Move&);
  void on(const request::Release&);
  void on(const request::Pin&);
  void on(const request::Unpin&);
  void on(const request::Cut&);
  void on(const request::Suture&);
  void on(const request::Reopen&);
  void on(const request::Ball&);
  void on(const request::LiftBall&);
  void on(const request::Play&);
  void on(const request::Frame&);
  void on(const request::Undo&);
  void on(const request::Redo&);
  void on(const request::Reset&);
  void on(const request::Use&);
  void on(const request::Tissues&);
  void on(const request::Save&);

  Setup setup_;
  Listener listener_;
  Scene& scene_;
  std::unique_ptr<Session> session_;         ///< null where a reel is shown
  int frame_ = 0;                            ///< of the reel
  std::vector<glm::dvec4> pins_, pins_now_;  ///< what is pinned: where it lay, and where it lies
  simulate::Method method_;
  glm::dvec3 cursor_mm_;
  Camera camera_;
  SliceLook look_;
  std::string style_;
  std::optional<Quality> quality_;
  std::optional<glm::dvec3> fold_at_;
  std::uint32_t number_ = 0;  ///< of the request that was taken last
  int cuts_made_ = 0;         ///< for their names
  bool is_moving_ = false;    ///< whether tissue has not come to rest
  int resting_steps_ = 0;     ///< steps since the hand did something
  Clock::time_point stepped_{}, changed_{};
  Clock::duration step_took_{};                          ///< the last step
  std::array<Clock::duration, request::kPanes> took_{};  ///< the last picture of each pane that was not exact

  std::mutex mutex_;  ///< of what follows
  std::condition_variable wake_;
  std::deque<Request> asked_;
  std::vector<std::packaged_task<void(const Session&)>> visits_;
  bool watched_ = false, watch_changed_ = false, woken_ = false;
  std::stop_source resting_;  ///< of what is made at rest; requests end it
  StageTimes times_;

  // Ended in the opposite order: the thread gives work to the encoders, and these to the lines.
  std::array<std::unique_ptr<PaneLine>, request::kPanes> lines_;
  Encoders encoders_;
  std::jthread thread_;
};

}  // namespace tetwarp::viewer
