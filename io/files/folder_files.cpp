// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/files/folder_files.h"

#include <algorithm>
#include <set>
#include <system_error>

#include "deform/errors.h"
#include "deform/resampler.h"
#include "io/shown_text.h"

namespace tetwarp {
namespace {

namespace fs = std::filesystem;

/// The folder without links. @throws InputError in the system's words
fs::path real(const fs::path& folder) {
  std::error_code error;
  const fs::path path = fs::canonical(folder, error);
  require(!error, "the folder cannot be read, " + shown(folder) + ": " + error.message() + "; check its permissions");
  return path;
}

class Listing {
 public:
  Listing(const fs::path& root, bool with_sub_folders, const std::stop_token& stop)
      : root_(real(root)), with_sub_folders_(with_sub_folders), stop_(stop) {}

  void add_folder(const fs::path& folder) {
    if (stop_.stop_requested()) throw Cancelled();
    std::error_code error;
    const fs::path real = fs::canonical(folder, error);
    if (error) return leave_out(folder, "cannot be read: " + error.message());
    if (!folders_.insert(real).second) return;
    std::vector<fs::directory_entry> entries;
    for (fs::directory_iterator i(folder, error), end; !error && i != end; i.increment(error)) entries.push_back(*i);
    if (error) leave_out(folder, "cannot be read: " + error.message());
    std::sort(entries.begin(), entries.end());
    for (const fs::directory_entry& entry : entries) add_entry(entry);
  }

  /// Adds files behind links and returns the list. A link does not count if it leads into a folder that was listed, for
  /// then the file itself is listed.
  FolderFiles finish() {
    std::set<fs::path> targets;
    for (const auto& [link, target] : links_) {
      if (!folders_.contains(target.parent_path()) && targets.insert(target).second) found_.files.push_back(link);
    }
    return std::move(found_);
  }

 private:
  void leave_out(const fs::path& path, const std::string& reason) { found_.left_out.push_back({path, reason}); }

  void add_entry(const fs::directory_entry& entry) {
    std::error_code error, unknown;
    const bool link = entry.is_symlink(unknown);
    const fs::file_status status = entry.status(error);
    if (fs::is_directory(status)) {
      if (!with_sub_folders_) return;
      if (link && leads_outwards(entry))
        leave_out(entry, "a link to a folder that holds the input, not followed");
      else
        add_folder(entry);
    } else if (fs::is_regular_file(status)) {
      if (!link) return found_.files.push_back(entry);
      const fs::path target = fs::canonical(entry, error);
      if (!error) links_.emplace_back(entry, target);
    } else if (status.type() == fs::file_type::none) {
      leave_out(entry, "cannot be read: " + error.message());
    } else {
      leave_out(entry, fs::exists(status) ? "not a regular file" : "a link that leads nowhere");
    }
  }

  bool leads_outwards(const fs::path& link) const {
    std::error_code error;
    const fs::path real = fs::canonical(link, error);
    const auto [end, ignored] = std::mismatch(real.begin(), real.end(), root_.begin(), root_.end());
    return !error && end == real.end() && real != root_;
  }

  fs::path root_;
  bool with_sub_folders_;
  const std::stop_token& stop_;
  std::set<fs::path> folders_;                        ///< folders that were listed, without links
  std::vector<std::pair<fs::path, fs::path>> links_;  ///< links to files, and the files that they lead to
  FolderFiles found_;
};

}  // namespace

FolderFiles list_files(const fs::path& folder, bool with_sub_folders, const std::stop_token& stop) {
  Listing listing(folder, with_sub_folders, stop);
  listing.add_folder(folder);
  return listing.finish();
}

}  // namespace tetwarp
