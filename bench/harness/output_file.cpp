// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "bench/harness/output_file.h"

#include <fstream>

#include "bench/harness/options.h"
#include "deform/errors.h"
#include "io/read_places.h"
#include "io/staged_output.h"

namespace tetwarp::bench {

void require_writable(const std::filesystem::path& path, const std::vector<std::filesystem::path>& reads) {
  if (path.empty()) return;
  ReadPlaces places;
  for (const std::filesystem::path& read : reads) {
    if (!read.empty()) places.add(read);
  }
  if (const auto input = places.touched_by(path))
    throw UsageError("the output " + path.string() + " is, is inside, or is around the input " + input->string() +
                     "; choose another place");
  StagedOutput(path, StagedOutput::Kind::file, true);
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
