// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "io/files/module.h"

#include <dlfcn.h>

#include "deform/errors.h"

namespace tetwarp {

void* find_in_module(const char* module, const char* function) {
  void* const loaded = ::dlopen(module, RTLD_NOW | RTLD_LOCAL);
  return loaded ? ::dlsym(loaded, function) : nullptr;
}

void refuse_without_module(const std::string& what, const std::string& module, const std::string& path,
                           const std::string& otherwise) {
  throw NotCompiled(what + " need " + module + ", which cannot be loaded, " + path +
                    "; put it into lib/tetwarp beside the program's folder" + otherwise);
}

}  // namespace tetwarp
