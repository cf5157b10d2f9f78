// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "backend/backend.h"

#include <thread>

#include "backend/devices.h"
#include "deform/errors.h"

namespace tetwarp {

namespace {

struct Named {
  const char* word;
  BackendChoice choice;
};
constexpr Named kChoices[] = {
    {"auto", BackendChoice::automatic}, {"cuda", BackendChoice::cuda}, {"cpu", BackendChoice::cpu}};

}  // namespace

BackendChoice backend_choice(std::string_view word) {
  for (const Named& named : kChoices) {
    if (named.word == word) return named.choice;
  }
  throw InputError("unknown backend \"" + std::string(word) + "\"; expected auto, cpu or cuda");
}

const char* name_of(BackendChoice choice) {
  for (const Named& named : kChoices) {
    if (named.choice == choice) return named.word;
  }
  return "";
}

const char* name_of(BackendKind kind) { return kind == BackendKind::cuda ? "cuda" : "cpu"; }

std::vector<std::string> backend_words() {
  std::vector<std::string> words;
  for (const Named& named : kChoices) words.emplace_back(named.word);
  return words;
}

BackendKind chosen(BackendChoice choice) {
  const bool device = demands_device(choice) || (leaves_open(choice) && device_count() > 0);
  return device ? BackendKind::cuda : BackendKind::cpu;
}

bool runs_on_device(BackendKind kind) { return kind == BackendKind::cuda; }

bool leaves_open(BackendChoice choice) { return choice == BackendChoice::automatic; }

bool may_use_device(BackendChoice choice) { return choice != BackendChoice::cpu; }

bool demands_device(BackendChoice choice) { return choice == BackendChoice::cuda; }

std::vector<std::string> describe_backends() {
  std::vector<std::string> lines = {"cpu: usable, " + std::to_string(std::thread::hardware_concurrency()) + " threads"};
  if (!has_cuda()) lines.emplace_back("cuda: not in this build");
  if (has_cuda() && device_count() == 0) lines.emplace_back("cuda: built in, no device on this machine");
  for (int device = 0; device < device_count(); ++device) {
    lines.push_back("cuda: usable, device " + std::to_string(device) + " " + describe_device(device));
  }
  return lines;
}

}  // namespace tetwarp
