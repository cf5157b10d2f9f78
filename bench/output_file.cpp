#include "bench/output_file.h"

#include <fstream>

#include "deform/errors.h"
#include "io/staged_output.h"

namespace tetwarp::bench {

void require_writable(const std::filesystem::path& path) {
  if (!path.empty()) StagedOutput(path, StagedOutput::Kind::file, true);
}

void write_text(const std::filesystem::path& path, const std::string& text) {
  if (path.empty()) return;
  StagedOutput output(path, StagedOutput::Kind::file, true);
  std::ofstream file(output.path(), std::ios::binary);
  file << text;
  file.close();
  if (!file) throw Error("cannot be written, " + path.string() + "; is the disk full?");
  output.commit();
}

}  // namespace tetwarp::bench
