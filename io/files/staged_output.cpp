// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/staged_output.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <climits>
#include <cstdio>
#include <exception>
#include <fstream>
#include <mutex>
#include <set>
#include <system_error>
#include <thread>
#include <vector>

#include "deform/errors.h"
#include "io/parallel.h"

namespace fs = std::filesystem;

namespace tetwarp {

namespace {

std::string reason(int error) { return std::generic_category().message(error); }
std::string reason(const std::error_code& error) { return error.message(); }

/// The path without slashes and "." at its end, so that it has a last component. A ".." within it is left to the
/// system, which follows links first: resolved in the text it may name another folder.
fs::path named(const fs::path& target) {
  fs::path path = target;
  while (path.has_relative_path() && (!path.has_filename() || path.filename() == ".")) path = path.parent_path();
  if (!path.has_filename() || path.filename() == "." || path.filename() == "..") {
    throw Error("'" + target.string() + "' names no file or folder to create; give the output a name");
  }
  return path;
}

fs::path folder_of(const fs::path& path);

[[noreturn]] void refuse_irregular(const fs::path& path) {
  throw Error(path.string() + " is no regular file; choose another name");
}

/// The path itself, or what a link of this name leads to, over any number of links. Links are kept and their targets
/// are written; a target need not exist yet.
fs::path followed(const fs::path& target) {
  constexpr int kMostLinks = 40;  // as many as Linux follows
  std::error_code error;
  // A pipe or terminal to which a link in /proc leads has no path of its own that could be named.
  if (const fs::file_status status = fs::status(target, error); fs::is_other(status)) refuse_irregular(target);
  fs::path path = target;
  for (int links = 0; fs::is_symlink(fs::symlink_status(path, error)); ++links) {
    const fs::path next = fs::read_symlink(path, error);
    if (!error && links == kMostLinks) error = std::make_error_code(std::errc::too_many_symbolic_link_levels);
    if (error)
      throw Error("cannot follow the link " + target.string() + ": " + reason(error) + "; choose another name");
    path = folder_of(path) / next;  // the same as `next` if that is absolute
  }
  return path;
}

fs::path folder_of(const fs::path& path) { return path.has_parent_path() ? path.parent_path() : fs::path("."); }

/// Whether something has this name that would be lost. @throws Error where it may not be replaced at all
bool occupied(const fs::path& path, StagedOutput::Kind kind) {
  std::error_code error;
  const fs::file_status status = fs::status(path, error);
  if (status.type() == fs::file_type::not_found) return false;
  if (status.type() == fs::file_type::none) throw Error("cannot look at " + path.string() + ": " + reason(error));
  if (kind == StagedOutput::Kind::file) {
    if (fs::is_directory(status))
      throw Error(path.string() + " is a folder, a file is to be written; choose another name");
    if (!fs::is_regular_file(status)) refuse_irregular(path);
    return true;
  }
  if (!fs::is_directory(status)) {
    throw Error(path.string() + " is a file, a folder is to be written; choose another name");
  }
  const bool empty = fs::is_empty(path, error);
  if (error) throw Error("cannot list " + path.string() + ": " + reason(error));
  return !empty;
}

/// Everything in a folder and below it, sorted by path.
std::vector<fs::path> entries_of(const fs::path& folder) {
  std::vector<fs::path> entries;
  std::error_code error;
  fs::recursive_directory_iterator entry(folder, error);
  for (; !error && entry != fs::recursive_directory_iterator(); entry.increment(error))
    entries.push_back(entry->path());
  if (error) throw Error("cannot list " + folder.string() + ": " + reason(error));
  std::sort(entries.begin(), entries.end());
  return entries;
}

/// Throws unless all regular files in the folder were written by Tetwarp and nothing but folders lies beside them;
/// names the first file that was not.
void require_ours(const fs::path& folder, bool (*is_ours)(const fs::path&)) {
  const std::vector<fs::path> entries = entries_of(folder);
  for_each_index(entries.size(), 0, {}, [&](std::size_t n) {
    std::error_code error;
    const fs::file_status status = fs::symlink_status(entries[n], error);
    if (error) throw Error("cannot look at " + entries[n].string() + ": " + reason(error));
    if (fs::is_directory(status)) return;
    if (!is_ours || !fs::is_regular_file(status) || !is_ours(entries[n])) {
      throw Error(entries[n].string() +
                  " was not written by Tetwarp, so its folder is not replaced; choose another name");
    }
  });
}

/// Creates an empty file or folder beside `target` under a hidden name that nothing has. A leftover of a killed run
/// with the same process id (or of another machine on a shared disk) is left alone. A name that would be too long is
/// cut at its front.
fs::path create_sibling(const fs::path& target, StagedOutput::Kind kind, const std::string& word) {
  const std::string process = ".tetwarp-" + word + "-" + std::to_string(::getpid());
  for (int attempt = 0;; ++attempt) {
    std::string name = process;
    if (attempt > 0) name += '-' + std::to_string(attempt);
    name += '-';
    const std::string own = target.filename().string();
    name += own.substr(own.size() - std::min(own.size(), NAME_MAX - name.size()));
    const fs::path path = folder_of(target) / name;
    int result;
    if (kind == StagedOutput::Kind::folder) {
      result = ::mkdir(path.c_str(), 0777);
    } else {
      result = ::open(path.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0666);
      if (result >= 0) ::close(result);
    }
    if (result >= 0) return path;
    if (errno != EEXIST || attempt == 1000) {
      throw Error("cannot write " + target.string() + ": " + reason(errno) + "; choose a place that can be written to");
    }
  }
}

/// Flushes one file or folder to disk; that a file system cannot flush folders (EINVAL) is no error.
void flush(const fs::path& path, const fs::path& target) {
  const int file = ::open(path.c_str(), O_RDONLY | O_CLOEXEC);
  const bool good = file >= 0 && (::fsync(file) == 0 || errno == EINVAL);
  const int error = errno;
  if (file >= 0) ::close(file);
  if (!good) throw Error("cannot write " + target.string() + " to disk: " + reason(error) + "; free some space");
}

/// Flushes many files at the same time: a file system then writes its journal once for several of them. Threads that
/// wait for the disk take no time of a processor, so --threads does not limit their number. If several fail, the first
/// file's error is thrown.
void flush_each(const std::vector<fs::path>& files, const fs::path& target) {
  constexpr std::size_t kMostThreads = 16;
  std::vector<std::exception_ptr> failures(files.size());
  std::atomic<std::size_t> next = 0;
  const auto work = [&] {
    for (std::size_t n = next++; n < files.size(); n = next++) {
      try {
        flush(files[n], target);
      } catch (...) {
        failures[n] = std::current_exception();
      }
    }
  };
  {
    std::vector<std::jthread> threads;
    try {
      while (threads.size() + 1 < std::min(kMostThreads, files.size())) threads.emplace_back(work);
    } catch (const std::system_error&) {  // the threads that could be started suffice
    }
    work();
  }
  for (const std::exception_ptr& failure : failures) {
    if (failure) std::rethrow_exception(failure);
  }
}

void flush_all(const fs::path& staged, StagedOutput::Kind kind, const fs::path& target) {
  if (kind == StagedOutput::Kind::folder) flush_each(entries_of(staged), target);
  flush(staged, target);
}

int move(const fs::path& from, const fs::path& to) { return ::rename(from.c_str(), to.c_str()) == 0 ? 0 : errno; }

/// Renames a file or folder if nothing, or an empty folder, has the new name. What gets that name meanwhile is not
/// lost.
/// @return 0 or errno
int move_to_free(const fs::path& from, const fs::path& to, StagedOutput::Kind kind) {
  // rename(2) refuses to replace a folder that is not empty
  if (kind == StagedOutput::Kind::folder) return move(from, to);
  if (::renameat2(AT_FDCWD, from.c_str(), AT_FDCWD, to.c_str(), RENAME_NOREPLACE) == 0) return 0;
  // The file system cannot do both in one step, so look first and then rename.
  if (errno != EINVAL && errno != ENOSYS) return errno;
  std::error_code ignored;
  return fs::exists(to, ignored) ? EEXIST : move(from, to);
}

/// Moves the old folder aside, then the new one to its place, and removes the old one last: for file systems that
/// cannot exchange two names in one step. @return 0 or errno
int replace_in_steps(const fs::path& staged, const fs::path& target) {
  const fs::path aside = create_sibling(target, StagedOutput::Kind::folder, "replaced");
  std::error_code ignored;
  if (const int error = move(target, aside)) {
    fs::remove(aside, ignored);
    return error;
  }
  if (const int error = move(staged, target)) {
    if (move(aside, target) == 0) return error;
    throw Error("cannot replace " + target.string() + ": " + reason(error) + "; what it held is now " + aside.string());
  }
  fs::remove_all(aside, ignored);
  return 0;
}

/// Exchanges the old folder and the new one in one step and then removes the old one. The name is never free, and runs
/// that replace the same folder at the same time replace it whole. @return 0 or errno
int replace_folder(const fs::path& staged, const fs::path& target) {
  if (::renameat2(AT_FDCWD, staged.c_str(), AT_FDCWD, target.c_str(), RENAME_EXCHANGE) != 0)
    return errno == EINVAL || errno == ENOSYS ? replace_in_steps(staged, target) : errno;
  std::error_code ignored;
  fs::remove_all(staged, ignored);
  return 0;
}

/// The hidden files and folders of this process that do not have their final name yet. They are removed if it ends
/// early.
class Unfinished {
 public:
  static Unfinished& all() {
    static Unfinished one;
    return one;
  }

  fs::path create(const fs::path& target, StagedOutput::Kind kind) {
    const std::lock_guard lock(mutex_);
    return *paths_.insert(create_sibling(target, kind, "partial")).first;
  }
  void forget(const fs::path& path) {
    const std::lock_guard lock(mutex_);
    paths_.erase(path);
  }
  /// Removes all of them, several times, since other threads may still write into a folder while it is removed.
  void remove() noexcept {
    mutex_.lock();  // never unlocked, so that nothing is created any more
    constexpr int kRounds = 3;
    std::error_code ignored;
    for (int round = 0; round < kRounds; ++round) {
      for (const fs::path& path : paths_) fs::remove_all(path, ignored);
    }
  }

 private:
  std::mutex mutex_;
  std::set<fs::path> paths_;
};

}  // namespace

void write_new_file(const std::filesystem::path& path, std::string_view bytes) {
  StagedOutput staged(path, StagedOutput::Kind::file, false);
  std::ofstream file(staged.path(), std::ios::binary);
  file.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  file.close();
  if (!file) throw Error("cannot write " + path.string() + "; check the free space");
  staged.commit();
}

void remove_unfinished_outputs() noexcept { Unfinished::all().remove(); }

StagedOutput::StagedOutput(fs::path target, Kind kind, bool overwrite, bool (*is_ours)(const fs::path&))
    : target_(named(target)), kind_(kind), overwrite_(overwrite), is_ours_(is_ours) {
  if (const fs::path named_by_link = followed(target_); named_by_link != target_) target_ = named(named_by_link);
  std::error_code error;
  const fs::path parent = folder_of(target_);
  const fs::file_status of_parent = fs::status(parent, error);
  if (of_parent.type() == fs::file_type::none)
    throw Error("cannot look at the folder " + parent.string() + ": " + reason(error) + "; choose another place");
  if (!fs::exists(of_parent)) {
    throw Error("folder " + parent.string() + " does not exist, so " + target_.filename().string() +
                " cannot be written into it; create it first");
  }
  if (!fs::is_directory(of_parent)) {
    throw Error(parent.string() + " is not a folder, so " + target_.filename().string() +
                " cannot be written into it; choose another name");
  }
  check_target();
  staged_ = Unfinished::all().create(target_, kind_);
}

StagedOutput::~StagedOutput() {
  std::error_code ignored;
  if (!done_) fs::remove_all(staged_, ignored);
  Unfinished::all().forget(staged_);
}

bool StagedOutput::check_target() const {
  const bool replaces = occupied(target_, kind_);
  if (replaces && !overwrite_) throw Error(target_.string() + " exists; choose another name or add --overwrite");
  if (replaces && kind_ == Kind::folder) require_ours(target_, is_ours_);
  return replaces;
}

void StagedOutput::commit() {
  flush_content();
  give_name();
  flush(folder_of(target_), target_);
}

void StagedOutput::flush_content() const { flush_all(staged_, kind_, target_); }

void StagedOutput::give_name() {
  bool replaces = false;
  int error = 0;
  constexpr int kMostTries = 100;
  for (int tries = 0; tries < kMostTries; ++tries) {
    replaces = check_target();  // looked at again, for hours may have passed
    if (!replaces)
      error = move_to_free(staged_, target_, kind_);
    else if (kind_ == Kind::file)
      error = move(staged_, target_);
    else
      error = replace_folder(staged_, target_);
    // A folder that another run replaced while it was looked at may have looked empty.
    const bool was_taken_for_free = !replaces && (error == ENOTEMPTY || error == EEXIST);
    if (!was_taken_for_free || !overwrite_) break;
  }
  if (error != 0)
    throw Error("cannot give " + target_.string() + " its name: " + reason(error) + "; nothing was replaced");
  done_ = true;
  replaced_ = replaces;
}

void StagedOutput::take_name_back() {
  if (!done_ || replaced_) return;
  std::error_code ignored;
  fs::remove_all(target_, ignored);
}

void commit_together(std::span<const std::unique_ptr<StagedOutput>> outputs) {
  for (const auto& output : outputs) output->flush_content();
  std::size_t count = 0;
  try {
    for (; count < outputs.size(); ++count) outputs[count]->give_name();
  } catch (...) {
    for (const auto& output : outputs.first(count)) output->take_name_back();
    throw;
  }
  std::set<fs::path> folders;
  for (const auto& output : outputs) {
    if (folders.insert(folder_of(output->target())).second) flush(folder_of(output->target()), output->target());
  }
}

}  // namespace tetwarp
