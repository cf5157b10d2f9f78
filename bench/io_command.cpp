#include <tbb/global_control.h>
#include <tbb/info.h>
#include <unistd.h>

#include <cstdio>
#include <optional>

#include "bench/conclude.h"
#include "bench/io_bench.h"
#include "bench/io_report.h"
#include "bench/machine.h"
#include "bench/output_file.h"
#include "deform/errors.h"

namespace tetwarp::bench {

namespace {

namespace fs = std::filesystem;

/// A folder of its own under another, removed with all that is in it.
class ScratchFolder {
 public:
  /// @throws Error naming the folder and the system's reason
  explicit ScratchFolder(const fs::path& parent) {
    std::string pattern = ((parent.empty() ? fs::temp_directory_path() : parent) / "tetwarp-bench-XXXXXX").string();
    if (!::mkdtemp(pattern.data())) {
      throw Error("no folder can be made, " + pattern + ": " + std::generic_category().message(errno) +
                  "; choose another --folder");
    }
    path_ = pattern;
  }
  ~ScratchFolder() {
    std::error_code ignored;
    fs::remove_all(path_, ignored);
  }
  ScratchFolder(const ScratchFolder&) = delete;
  ScratchFolder& operator=(const ScratchFolder&) = delete;

  const fs::path& path() const { return path_; }

 private:
  fs::path path_;
};

}  // namespace

int run_io(const IoOptions& options) {
  require_writable(options.json);
  const ScratchFolder folder(options.folder);
  std::optional<tbb::global_control> limit;
  if (options.threads > 0)
    limit.emplace(tbb::global_control::max_allowed_parallelism, static_cast<std::size_t>(options.threads));
  IoResults results = measure_io(options, folder.path(), [&](const std::string& line) {
    if (options.verbose) std::fprintf(stderr, "%s\n", line.c_str());
  });
  results.machine = describe_machine(-1, options.threads > 0 ? options.threads : tbb::info::default_concurrency());
  return conclude(results, options.json, options.check);
}

}  // namespace tetwarp::bench
