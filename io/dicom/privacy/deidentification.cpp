// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/deidentification.h"

#include <algorithm>
#include <cctype>
#include <fstream>
#include <iterator>

#include "deform/errors.h"
#include "io/opened_file.h"
#include "io/shown_text.h"

namespace tetwarp {

namespace {

ConfidentialityOption option_named(std::string_view name) {
  std::string all = "basic";
  for (const ConfidentialityOption option : kConfidentialityOptions) {
    if (name == name_of(option)) return option;
    all.append(", ").append(name_of(option));
  }
  if (name.starts_with("clean-")) {
    throw InputError("the option " + shown(std::string(name)) +
                     " of de-identification needs somebody who looks at texts and pictures; leave it out");
  }
  if (name == "retain-safe-private")
    throw InputError("private attributes are never carried into a derived series; leave retain-safe-private out");
  throw InputError("unknown option " + shown(std::string(name)) + " of de-identification; use " + all);
}

}  // namespace

const char kConfidentialityEdition[] = "PS3.15 2026d";

const char* name_of(ConfidentialityOption option) {
  constexpr const char* kNames[] = {"retain-dates",       "shift-dates",    "retain-device",
                                    "retain-institution", "retain-patient", "retain-uids"};
  return kNames[static_cast<int>(option)];
}

std::set<ConfidentialityOption> confidentiality_options(std::string_view text) {
  std::set<ConfidentialityOption> options;
  for (bool more = true; more;) {
    const std::size_t comma = text.find(',');
    const std::string_view name = text.substr(0, comma);
    if (name != "basic") options.insert(option_named(name));
    more = comma != std::string_view::npos;
    if (more) text.remove_prefix(comma + 1);
  }
  require(
      !options.contains(ConfidentialityOption::retain_dates) || !options.contains(ConfidentialityOption::shift_dates),
      "de-identification cannot both retain dates and shift them; choose retain-dates or shift-dates");
  return options;
}

std::vector<std::byte> read_deidentification_key(const std::filesystem::path& path) {
  constexpr std::size_t kShortest = 16, kLongest = 4096;
  require(is_file(path), "no file with a key of de-identification, " + shown(path.string()) +
                             "; make one with `openssl rand -hex 32`");
  std::ifstream file = opened(path);
  std::string text(kLongest + 2, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  require(file.eof() && !file.bad(), "the key of de-identification cannot be read, or has more than " +
                                         std::to_string(kLongest) + " bytes, " + shown(path.string()) +
                                         "; give a file with a secret, as of `openssl rand -hex 32`");
  text.resize(static_cast<std::size_t>(file.gcount()));
  while (!text.empty() && std::isspace(static_cast<unsigned char>(text.back()))) text.pop_back();
  require(text.size() >= kShortest && text.size() <= kLongest,
          "the key of de-identification has " + std::to_string(text.size()) + " bytes, expected " +
              std::to_string(kShortest) + " to " + std::to_string(kLongest) + ", " + shown(path.string()) +
              "; make one with `openssl rand -hex 32`");
  std::vector<std::byte> key;
  std::transform(text.begin(), text.end(), std::back_inserter(key), [](char c) { return static_cast<std::byte>(c); });
  return key;
}

}  // namespace tetwarp
