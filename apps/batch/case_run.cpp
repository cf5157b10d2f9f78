// SPDX-FileCopyrightText: The Tetwarp authors
// SPDX-License-Identifier: Apache-2.0

#include "apps/batch/case_run.h"

#include <optional>

#include "apps/batch/case_record.h"
#include "apps/deform/deform_write.h"
#include "backend/devices.h"
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

/// What a case needs to be resampled, as far as it needs no device.
struct Prepared {
  const DeformRequest& request;
  const DeformPlan& plan;
  const DeformHeaders& headers;
  const DeformInputs& inputs;
  std::optional<DeformField>& field;  ///< none yet where it is simulated
};

/// Waits for a device, and resamples there. @param device  gets its number, where it is one of CUDA
std::pair<DeformSinks, DeformResult> resample_on_device(const Prepared& of, DeformOutputs& outputs,
                                                        Devices::Share share, const Resources& resources,
                                                        const std::stop_token& stop, std::optional<int>& device,
                                                        json& timing) {
  Clock clock;
  const Devices::Lease lease = resources.devices.wait_for(of.request.options.backend, share, stop);
  timing["wait_device"] = clock.lap();
  Clock held;
  Worker worker = lease.worker();
  timing["worker"] = name_of(worker.backend);
  std::optional<DeviceStream> stream;  // a stream of its own, so that cases on a device do not wait for each other
  if (demands_device(worker.backend)) {
    device = worker.device;
    timing["device"] = *device;
    worker.stream = stream.emplace(*device).get();
  }
  if (!of.field) {
    of.field = make_field(of.request, of.plan, of.inputs, worker);
    timing["field"] = clock.lap();
  }
  DeformSinks sinks = open_sinks(of.request, of.inputs, *of.field, outputs);
  DeformResult result =
      resample(of.request, of.headers, of.inputs, *of.field, std::move(of.field->room), sinks, worker);
  timing["resample"] = clock.lap();
  timing["on_device"] = held.lap();
  return {std::move(sinks), std::move(result)};
}

Record attempt(const BatchCase& of, const Retry& retry, const Resources& resources, const std::stop_token& stop,
               std::optional<int>& device, json& timing) {
  DeformOptions options = of.options;
  options.memory_bytes = retry.device_bytes;
  if (retry.on_cpu) options.backend = BackendChoice::cpu;
  Clock clock;
  const DeformRequest request = request_of(options);
  DeformOutputs outputs = begin_outputs(request);
  std::shared_ptr<SharedInput> input = resources.inputs.get(options.input);
  const std::vector<std::string> others = request.others.digests(options.common.threads);
  const double hashed = clock.lap();
  const DeformHeaders headers = open_headers(request, *input, outputs.set);
  const DeformPlan plan = plan_deformation(request, headers);
  timing["open"] = clock.lap();
  const MemoryBudget::Grant grant = resources.memory.wait_for(plan.bytes, stop);
  timing["wait_memory"] = clock.lap();
  DeformInputs inputs = read_inputs(request, headers, input);
  timing["read"] = clock.lap();
  std::optional<DeformField> field;
  if (!is_simulated(request)) {
    field = make_field(request, plan, inputs, {BackendChoice::cpu, 0});
    timing["field"] = clock.lap();
  }
  const auto share = retry.alone ? Devices::Share::alone : Devices::Share::with_others;
  auto [sinks, result] =
      resample_on_device({request, plan, headers, inputs, field}, outputs, share, resources, stop, device, timing);
  clock.lap();
  const DeformRun run{request, plan, headers, inputs, *field, result};
  const DeformWritten written = write_outputs(run, std::move(sinks), outputs, input->sha256());
  timing["write"] = clock.lap();
  Record line = record_case(of, outputs, run, written, others);
  timing["hash"] = hashed + clock.lap();
  input.reset();
  commit_outputs(outputs, std::move(inputs), *std::move(field), std::move(result));
  timing["commit"] = clock.lap();
  timing["planned_bytes"] = plan.bytes;
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
