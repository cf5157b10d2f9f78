// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/case_run.h"

#include <optional>

#include "apps/batch/case_record.h"
#include "apps/cli/reads.h"
#include "cuda/devices.h"
#include "io/opened_file.h"

namespace tetwarp::apps {

namespace {

using nlohmann::json;

/// Device memory that a case may take once there was not enough of it.
constexpr std::uint64_t kScarceDeviceBytes = 512'000'000;

class Clock {
 public:
  double lap() {
    const auto now = std::chrono::steady_clock::now();
    const double seconds = std::chrono::duration<double>(now - last_).count();
    last_ = now;
    return seconds;
  }

 private:
  std::chrono::steady_clock::time_point last_ = std::chrono::steady_clock::now();
};

/// How often a case was begun again, and what it may use from then on.
struct Retry {
  bool alone = false;  ///< it has its device for itself
  std::optional<std::uint64_t> device_bytes;
  bool on_cpu = false;
  std::vector<std::string> reasons;
};

bool is_simulated_on_device(const DeformOptions& options) { return !options.scenario.empty(); }

Record attempt(const BatchCase& of, const Retry& retry, const Resources& resources, const std::stop_token& stop,
               std::optional<int>& device, json& timing) {
  DeformOptions options = of.options;
  options.memory_bytes = retry.device_bytes;
  if (retry.on_cpu) options.backend = "cpu";
  Clock clock;
  Deformation deformation(options, resources.inputs.get(options.input));
  const std::vector<std::string> further = further_reads_of(options).digests(options.common.threads);
  const double hashed = clock.lap();
  deformation.open();
  timing["open"] = clock.lap();
  const MemoryBudget::Grant grant = resources.memory.wait_for(deformation.record().plan.bytes, stop);
  timing["wait_memory"] = clock.lap();
  deformation.read();
  timing["read"] = clock.lap();
  if (!is_simulated_on_device(options)) {
    deformation.make_field({"cpu", 0});
    timing["field"] = clock.lap();
  }
  {
    const auto share = retry.alone ? Devices::Share::alone : Devices::Share::with_others;
    const Devices::Lease lease = resources.devices.wait_for(options.backend, share, stop);
    timing["wait_device"] = clock.lap();
    Clock held;
    Worker worker = lease.worker();
    timing["worker"] = worker.backend;
    std::optional<DeviceStream> stream;  // a stream of its own, so that cases on a device do not wait for each other
    if (worker.backend == "cuda") {
      device = worker.device;
      timing["device"] = *device;
      worker.stream = stream.emplace(*device).get();
    }
    if (is_simulated_on_device(options)) {
      deformation.make_field(worker);
      timing["field"] = clock.lap();
    }
    deformation.resample(worker);
    timing["resample"] = clock.lap();
    timing["on_device"] = held.lap();
  }
  deformation.write();
  timing["write"] = clock.lap();
  Record line = record_case(of, deformation, further);
  timing["hash"] = hashed + clock.lap();
  deformation.commit();
  timing["commit"] = clock.lap();
  timing["planned_bytes"] = deformation.record().plan.bytes;
  return line;
}

/// Makes the outcome of a case that gave no output.
void end(CaseOutcome& outcome, const BatchCase& of, CaseStatus status, FixedReason kind, const std::string& reason) {
  outcome.status = status;
  outcome.reason = reason;
  outcome.line = failed_line(of, status == CaseStatus::refused ? "refused" : "failed", kind, reason);
}

/// Chooses the next measure that may help after a device failed. @return whether there is one
bool try_again(const BatchCase& of, const DeviceError& error, std::optional<int> device, const Resources& resources,
               Retry& retry) {
  const bool is_memory = dynamic_cast<const DeviceMemoryError*>(&error) != nullptr;
  retry.reasons.emplace_back(error.what());
  if (!device) return false;
  if (!is_memory) {
    resources.devices.lose(*device);
  } else if (!retry.alone) {
    retry.alone = true;  // other cases may have held the memory that it needed
  } else if (!retry.device_bytes) {
    retry.device_bytes = kScarceDeviceBytes;
  } else if (resources.devices.may_fall_back(of.options.backend)) {
    retry.on_cpu = true;
  } else {
    return false;
  }
  return true;
}

}  // namespace

CaseOutcome run_case(const BatchCase& of, const Resources& resources, const std::stop_token& stop) {
  Retry retry;
  CaseOutcome outcome;
  json timing;
  for (bool again = true; again;) {
    again = false;
    std::optional<int> device;
    timing = {{"case", of.id}};
    try {
      outcome.line = attempt(of, retry, resources, stop, device, timing);
      if (!retry.reasons.empty()) timing["made_again"] = outcome.made_again = retry.reasons;
    } catch (const Cancelled&) {
      throw;
    } catch (const DeviceError& error) {
      again = try_again(of, error, device, resources, retry);
      if (!again) end(outcome, of, CaseStatus::failed, FixedReason::device, error.what());
    } catch (const InputError& error) {
      end(outcome, of, CaseStatus::refused, FixedReason::input, error.what());
    } catch (const UsageError& error) {
      end(outcome, of, CaseStatus::refused, FixedReason::options, error.what());
    } catch (const std::filesystem::filesystem_error& error) {
      end(outcome, of, CaseStatus::refused, FixedReason::input, message_of(error));
    } catch (const std::bad_alloc&) {
      end(outcome, of, CaseStatus::failed, FixedReason::memory,
          "not enough memory; give the batch less with --memory, or fewer --jobs");
    } catch (const std::exception& error) {
      end(outcome, of, CaseStatus::failed, FixedReason::other, error.what());
    }
  }
  outcome.timing = Record::of(hides(of), timing);
  return outcome;
}

}  // namespace tetwarp::apps
