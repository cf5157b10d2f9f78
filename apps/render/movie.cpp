// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/render/movie.h"

#include <pthread.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <optional>
#include <sstream>
#include <string>
#include <vector>

#include "deform/errors.h"
#include "itkbridge/child_process.h"

namespace tetwarp::apps {

namespace {

namespace fs = std::filesystem;

/// The path of a program on PATH; empty: it is not there.
fs::path find_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path program = fs::path(folder.empty() ? "." : folder) / name;
    if (::access(program.c_str(), X_OK) == 0 && fs::is_regular_file(program)) return program;
  }
  return {};
}

/// Arguments of ffmpeg to make the film `target` from raw pictures on the standard input. The same pictures give the
/// same bytes: one thread, no times, no name of the encoder.
std::vector<std::string> arguments_for(const Picture& first, const fs::path& target, bool gif, double rate) {
  const std::string size = std::to_string(first.width()) + "x" + std::to_string(first.height());
  char frames[32];
  std::snprintf(frames, sizeof frames, "%.6g", rate);
  std::vector<std::string> arguments = {"-y",         "-nostdin",      "-loglevel", "error",       "-f",
                                        "rawvideo",   "-pixel_format", "rgb24",     "-video_size", size,
                                        "-framerate", frames,          "-i",        "pipe:0"};
  const std::vector<std::string> form =
      gif ? std::vector<std::string>{"-filter_complex", "split[a][b];[a]palettegen[p];[b][p]paletteuse", "-f", "gif"}
          : std::vector<std::string>{"-vf",       "pad=ceil(iw/2)*2:ceil(ih/2)*2",
                                     "-c:v",      "libx264",
                                     "-crf",      "16",
                                     "-pix_fmt",  "yuv420p",
                                     "-movflags", "+faststart",
                                     "-f",        "mp4"};
  arguments.insert(arguments.end(), form.begin(), form.end());
  for (const char* argument : {"-threads", "1", "-fflags", "+bitexact", "-flags:v", "+bitexact", "-map_metadata", "-1"})
    arguments.emplace_back(argument);
  arguments.push_back("file:" + target.string());
  return arguments;
}

/// Makes a file without a name, in memory.
Descriptor make_log() {
  Descriptor log(::memfd_create("tetwarp-film-log", MFD_CLOEXEC));
  if (log.number() < 0) throw Error(std::string("no memory for what ffmpeg says: ") + std::strerror(errno));
  return log;
}

/// The last line of a log, of which the last kilobyte is read.
std::string last_line(const Descriptor& log) {
  struct stat state {};
  ::fstat(log.number(), &state);
  std::string text(1024, '\0');
  const ssize_t read = ::pread(log.number(), text.data(), text.size(), std::max<off_t>(0, state.st_size - 1024));
  text.resize(static_cast<std::size_t>(std::max<ssize_t>(0, read)));
  text.erase(text.find_last_not_of(" \r\n") + 1);
  return text.substr(text.find_last_of("\r\n") + 1);
}

/// Writes all bytes to a pipe. @return false where nothing reads the pipe any more; the signal for that, which would
/// end this program, is held back
bool write_all(const Descriptor& pipe, const std::uint8_t* bytes, std::size_t size) {
  sigset_t signal, before, pending;
  sigemptyset(&signal);
  sigaddset(&signal, SIGPIPE);
  pthread_sigmask(SIG_BLOCK, &signal, &before);
  sigpending(&pending);
  bool broken = false;
  while (size > 0) {
    const ssize_t count = ::write(pipe.number(), bytes, size);
    if (count < 0 && errno == EINTR) continue;
    broken = count < 0;
    if (broken) break;
    bytes += count;
    size -= static_cast<std::size_t>(count);
  }
  if (broken && !sigismember(&pending, SIGPIPE)) {
    const timespec now{};
    while (::sigtimedwait(&signal, nullptr, &now) < 0 && errno == EINTR) continue;
  }
  pthread_sigmask(SIG_SETMASK, &before, nullptr);
  return !broken;
}

/// A running ffmpeg. It ends with this object, whatever it is doing. If this program is killed it ends, too, for its
/// pictures end.
class Encoder {
 public:
  Encoder(const Picture& first, const fs::path& target, const fs::path& name, double rate, const std::stop_token& stop)
      : Encoder(make_pipe(), make_log(), first, target, name, rate, stop) {}

  void add(const Picture& picture) {
    const std::size_t bytes =
        3 * static_cast<std::size_t>(picture.width()) * static_cast<std::size_t>(picture.height());
    if (!write_all(pictures_, picture.data(), bytes)) finish(false);
  }
  void finish() { finish(true); }

 private:
  Encoder(Pipe pipe, Descriptor log, const Picture& first, const fs::path& target, const fs::path& name, double rate,
          const std::stop_token& stop)
      : name_(name),
        log_(std::move(log)),
        pictures_(std::move(pipe.write)),
        stop_(stop),
        program_(find_program("ffmpeg"), arguments_for(first, target, name.extension() == ".gif", rate),
                 {.in = pipe.read.number(), .out = log_.number(), .error = log_.number()}),
        at_once_(stop, [this] { program_.kill(); }) {}

  /// Waits until ffmpeg has ended. @param complete  whether it was given all pictures
  void finish(bool complete) {
    pictures_.close();
    const std::optional<int> status = program_.wait();
    if (stop_.stop_requested()) throw Cancelled();
    const bool good = status && WIFEXITED(*status) && WEXITSTATUS(*status) == 0;
    if (good && complete) return;
    std::string why = last_line(log_);
    if (status && WIFSIGNALED(*status))
      why = std::string("it was ended by a signal, ") + ::strsignal(WTERMSIG(*status));
    if (why.empty()) why = good ? "it ends before it has all pictures" : "it says nothing";
    throw Error("ffmpeg failed, " + name_.string() + ": " + why);
  }

  fs::path name_;
  Descriptor log_, pictures_;
  std::stop_token stop_;
  ChildProcess program_;
  std::stop_callback<std::function<void()>> at_once_;
};

}  // namespace

bool is_movie(const fs::path& output) { return output.extension() == ".mp4" || output.extension() == ".gif"; }

void require_movie_encoder(const fs::path& output) {
  if (find_program("ffmpeg").empty()) {
    throw Error("ffmpeg, which makes films, is not on PATH, " + output.string() +
                "; install it (package ffmpeg), or name the output .png for numbered pictures");
  }
}

void write_movie(const fs::path& target, const fs::path& name, std::size_t pictures, double rate,
                 const std::function<Picture(std::size_t)>& picture, const std::stop_token& stop) {
  const Picture first = picture(0);
  Encoder encoder(first, target, name, rate, stop);
  encoder.add(first);
  for (std::size_t n = 1; n < pictures; ++n) encoder.add(picture(n));
  encoder.finish();
  std::error_code error;
  if (const auto bytes = fs::file_size(target, error); error || bytes == 0)
    throw Error("ffmpeg failed, " + name.string() + ": it wrote no film");
}

}  // namespace tetwarp::apps
