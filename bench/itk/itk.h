// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#pragma once

#include <filesystem>
#include <functional>

#include "bench/harness/results.h"
#include "bench/itk/itk_accuracy.h"

namespace tetwarp::bench {

/// A filter, or several one behind the other, and the name under which a process is asked to run it.
struct ItkContender {
  std::string method;   ///< "pull", "itk-warp"
  std::string filters;  ///< "WarpImageFilter"
  bool own = false;     ///< of this toolkit
};

/// What ITK's filters and ours are both asked for.
struct ItkTask {
  std::string key;                       ///< of the command line
  std::string question;                  ///< "the inverse field is given"
  std::string unit;                      ///< of errors: HU, voxels; empty: a ratio
  std::vector<ItkContender> contenders;  ///< ours first
};
/// All of them, in the order of the tables.
const std::vector<ItkTask>& itk_tasks();
/// @throws InputError for another key
const ItkTask& itk_task(const std::string& key);

/// The files of a measurement in a folder, all .mha and not compressed.
struct ItkFiles {
  std::filesystem::path folder;

  std::filesystem::path volume() const { return folder / "volume.mha"; }
  std::filesystem::path streamed() const { return folder / "streamed.mha"; }
  std::filesystem::path forward(const std::string& field, std::int64_t cell_size) const {
    return folder / (field + "-forward-" + std::to_string(cell_size) + ".mha");
  }
  std::filesystem::path inverse(const std::string& field, std::int64_t cell_size) const {
    return folder / (field + "-inverse-" + std::to_string(cell_size) + ".mha");
  }
};

/// What a process is asked to do, alone.
struct ItkRequest {
  std::string method;  ///< of an ItkContender
  std::string field;
  std::int64_t cell_size = 1;
  int threads = 1;
  int divisions = 1;        ///< of a stream
  bool is_compared = true;  ///< whether the result is held against the truth afterwards
};

/// Runs this program again, as `tetwarp-bench itk-alone`, and waits: no thread, cache or freed memory of this process
/// comes along. Request and answer are files in the folder. @throws Error where it fails
///
/// | of the answer | what it is |
/// | --- | --- |
/// | ms, cpu_ms | of Update(), all threads |
/// | input_bytes, output_bytes | pixels that were in memory before, and that were made |
/// | peak_bytes | largest resident set up to the end of Update(), less that just before; the output is included |
/// | error | the deviation from the truth; null where there is none |
Json ask_alone(const ItkRequest& request, const ItkFiles& files);

/// One filter, or several one behind the other, with their inputs in memory.
struct ItkWork {
  std::function<void()> run;                    ///< Update(), once
  std::uint64_t input_bytes = 0;                ///< pixels of the inputs
  std::function<std::uint64_t()> output_bytes;  ///< pixels of the output after `run`
  std::function<Deviation()> deviation = {};    ///< the output against the truth; empty where there is none
};

/// Reads what the request needs. @throws Error with ITK's words; InputError for a method that there is not
ItkWork make_itk_work(const ItkRequest& request, const ItkFiles& files);
// The two halves of it: images through fields, and fields alone. Without `run` for the other's methods.
ItkWork make_itk_image_work(const ItkRequest& request, const ItkFiles& files);
ItkWork make_itk_field_work(const ItkRequest& request, const ItkFiles& files);

/// Times and errors of ITK's filters over ours, and what streams may not do: write other bytes, or need as much memory.
Floors find_itk_floors(const Json& document);

}  // namespace tetwarp::bench
