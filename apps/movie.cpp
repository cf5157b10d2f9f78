#include "apps/movie.h"

#include <fcntl.h>
#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "deform/errors.h"

namespace tetwarp::apps {

namespace {

namespace fs = std::filesystem;

/// A folder of our own that is gone when this object is.
class TemporaryFolder {
 public:
  TemporaryFolder() {
    std::error_code error;
    const fs::path parent = fs::temp_directory_path(error);
    std::string name = ((error ? fs::path("/tmp") : parent) / "tetwarp-film-XXXXXX").string();
    if (!::mkdtemp(name.data())) throw Error("no temporary folder, " + name + ": " + std::strerror(errno));
    path_ = name;
  }
  ~TemporaryFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

/// The program on PATH; empty: not there.
fs::path find_program(const std::string& name) {
  const char* const path = std::getenv("PATH");
  std::istringstream folders(path ? path : "");
  for (std::string folder; std::getline(folders, folder, ':');) {
    const fs::path program = fs::path(folder.empty() ? "." : folder) / name;
    if (::access(program.c_str(), X_OK) == 0 && fs::is_regular_file(program)) return program;
  }
  return {};
}

/// Runs a program, what it says into a file. @return its exit status; -1 where it could not be begun or was killed
int run(const fs::path& program, std::vector<std::string> arguments, const fs::path& log) {
  arguments.insert(arguments.begin(), program.string());
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_addopen(&actions, STDIN_FILENO, "/dev/null", O_RDONLY, 0);
  posix_spawn_file_actions_addopen(&actions, STDOUT_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
  posix_spawn_file_actions_adddup2(&actions, STDOUT_FILENO, STDERR_FILENO);
  pid_t child = 0;
  const int error = ::posix_spawn(&child, program.c_str(), &actions, nullptr, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  int status = 0;
  if (error != 0 || ::waitpid(child, &status, 0) != child || !WIFEXITED(status)) return -1;
  return WEXITSTATUS(status);
}

std::string last_line(const fs::path& path) {
  std::ifstream file(path);
  std::string last;
  for (std::string line; std::getline(file, line);) {
    if (!line.empty()) last = line;
  }
  return last;
}

/// The same pictures give the same bytes: one thread, no times, no name of the encoder.
std::vector<std::string> arguments_for(const fs::path& pictures, const fs::path& target, bool gif, double rate) {
  char frames[32];
  std::snprintf(frames, sizeof frames, "%.6g", rate);
  std::vector<std::string> arguments = {"-y",         "-nostdin", "-loglevel", "error",
                                        "-framerate", frames,     "-i",        (pictures / "%06d.png").string()};
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
  arguments.push_back(target.string());
  return arguments;
}

}  // namespace

bool is_movie(const fs::path& output) { return output.extension() == ".mp4" || output.extension() == ".gif"; }

void require_movie_encoder(const fs::path& output) {
  if (find_program("ffmpeg").empty()) {
    throw Error("ffmpeg, which makes films, is not on PATH, " + output.string() +
                "; install it (package ffmpeg), or name the output .png for numbered pictures");
  }
}

void write_movie(const fs::path& target, const fs::path& name, std::size_t pictures, double rate,
                 const std::function<Picture(std::size_t)>& picture) {
  const TemporaryFolder folder;
  for (std::size_t n = 0; n < pictures; ++n) {
    char number[32];
    std::snprintf(number, sizeof number, "%06zu.png", n);
    write_png(folder.path() / number, picture(n));
  }
  const fs::path log = folder.path() / "log", made = folder.path() / "film";
  const int status =
      run(find_program("ffmpeg"), arguments_for(folder.path(), made, name.extension() == ".gif", rate), log);
  if (status != 0) throw Error("ffmpeg failed, " + name.string() + ": " + last_line(log));
  std::error_code error;
  fs::copy_file(made, target, fs::copy_options::overwrite_existing, error);
  if (error) throw Error("cannot be written, " + name.string() + ": " + error.message());
}

}  // namespace tetwarp::apps
