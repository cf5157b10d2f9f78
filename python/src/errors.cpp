// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include <exception>
#include <filesystem>
#include <new>

#include "deform/errors.h"
#include "io/opened_file.h"
#include "io/shown_text.h"
#include "python/src/module.h"

namespace tetwarp::python {

namespace nb = nanobind;

namespace {

/// Raises the class of this name of tetwarp.errors, which is written in Python.
void raise(const char* name, const char* text) {
  try {
    const nb::object errors = nb::module_::import_("tetwarp.errors");
    PyErr_SetString(errors.attr(name).ptr(), shown_lines(text).c_str());
  } catch (nb::python_error& error) {
    error.restore();
  }
}

}  // namespace

void add_errors(nb::module_&) {
  nb::register_exception_translator([](const std::exception_ptr& thrown, void*) {
    try {
      std::rethrow_exception(thrown);
    } catch (const InputError& error) {
      raise("InputError", error.what());
    } catch (const NotCompiled& error) {
      raise("NotCompiled", error.what());
    } catch (const DeviceError& error) {
      raise("DeviceError", error.what());
    } catch (const Cancelled& error) {
      raise("Cancelled", error.what());
    } catch (const Error& error) {
      raise("Error", error.what());
    } catch (const std::filesystem::filesystem_error& error) {
      raise("InputError", message_of(error).c_str());
    } catch (const std::bad_alloc&) {
      PyErr_NoMemory();
    }
  });
}

}  // namespace tetwarp::python
