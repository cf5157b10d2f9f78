// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/division_lock.h"

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <nlohmann/json.hpp>
#include <system_error>
#include <thread>

#include "apps/cli/console.h"
#include "deform/errors.h"
#include "deform/resampler.h"
#include "io/hash.h"

namespace tetwarp::apps {

namespace {

using namespace std::chrono_literals;
using nlohmann::json;

/// How long to retry: a lock may be refused for a moment while other processes begin or end.
constexpr auto kPatience = 1500ms;

/// Takes a lock of flock. @return false where another process holds a lock that excludes it; true on a file system
/// without locks
bool lock(int file, int kind) {
  while (::flock(file, kind | LOCK_NB) != 0) {
    if (errno == EWOULDBLOCK) return false;
    if (errno != EINTR) break;
  }
  return true;
}

void write(int file, const Division& division, const std::filesystem::path& path) {
  const json document = {{"shards", division.shards}, {"cases_sha256", division.cases_sha256}};
  const std::string text = document.dump() + "\n";
  if (::ftruncate(file, 0) != 0 || ::pwrite(file, text.data(), text.size(), 0) != static_cast<ssize_t>(text.size()))
    throw Error("cannot write " + path.string() + ": " + std::generic_category().message(errno));
}

Division read(int file) {
  std::array<char, 256> text{};
  const ssize_t bytes = ::pread(file, text.data(), text.size(), 0);
  const json document = json::parse(text.data(), text.data() + std::max<ssize_t>(bytes, 0), nullptr, false);
  Division division{0, ""};
  if (!document.is_object()) return division;
  if (const auto shards = document.find("shards"); shards != document.end() && shards->is_number_unsigned())
    division.shards = *shards;
  if (const auto cases = document.find("cases_sha256"); cases != document.end() && cases->is_string())
    division.cases_sha256 = *cases;
  return division;
}

std::string described(std::size_t shards) {
  return shards <= 1 ? "undivided" : "divided into " + std::to_string(shards) + " shards";
}

}  // namespace

Division division_of(std::size_t shards, const std::vector<std::string>& ids) {
  Sha256 hash;
  for (const std::string& id : ids) hash.add(id);
  return {shards, hash.hex()};
}

/// Takes the lock if the division that the file states is this one. A process that holds the file alone may write its
/// own.
bool DivisionLock::try_to_take(const Division& division) {
  if (lock(file_, LOCK_EX)) {
    // The shared lock that follows releases this one before it is taken, so another process may come between.
    write(file_, division, path_);
  }
  if (!lock(file_, LOCK_SH)) return false;
  found_ = read(file_);
  if (found_ == division) return true;
  ::flock(file_, LOCK_UN);
  return false;
}

DivisionLock::DivisionLock(const std::filesystem::path& folder, const Division& division)
    : path_(folder / kDivisionLockName) {
  file_ = ::open(path_.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) throw Error("cannot write " + path_.string() + ": " + std::generic_category().message(errno));
  try {
    for (const auto latest = std::chrono::steady_clock::now() + kPatience; !try_to_take(division);) {
      if (interrupt_token().stop_requested()) throw Cancelled();
      if (std::chrono::steady_clock::now() < latest) {
        std::this_thread::sleep_for(10ms);
        continue;
      }
      const std::string what = found_.shards == division.shards
                                   ? "another process works here on other cases, or on these in another order"
                                   : "another process works on this batch " + described(found_.shards) + ", not " +
                                         described(division.shards);
      throw Error(what + ", and may make the same cases, " + folder.string() + "; wait until it has ended");
    }
  } catch (...) {
    ::close(file_);
    throw;
  }
}

DivisionLock::~DivisionLock() { ::close(file_); }

}  // namespace tetwarp::apps
