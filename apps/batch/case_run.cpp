#include "apps/batch/case_run.h"

#include <optional>

#include "apps/batch/case_record.h"
#include "apps/reads.h"
#include "cuda/devices.h"

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

/// How often a case was begun anew, and what it may use from then on.
struct Retry {
  bool alone = false;  ///< on its device
  std::optional<std::uint64_t> device_bytes;
  bool on_cpu = false;
  json reasons = json::array();
};

bool is_simulated_on_device(const DeformOptions& options) { return !options.scenario.empty(); }

json attempt(const BatchCase& of, const Retry& retry, const Resources& resources, const std::stop_token& stop,
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
    std::optional<DeviceStream> stream;  // cases on a device do not wait for each other
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
  json line = record_case(of, deformation, further);
  timing["hash"] = hashed + clock.lap();
  deformation.commit();
  timing["commit"] = clock.lap();
  timing["planned_bytes"] = deformation.record().plan.bytes;
  return line;
}

}  // namespace

CaseOutcome run_case(const BatchCase& of, const Resources& resources, const std::stop_token& stop) {
  Retry retry;
  CaseOutcome outcome;
  for (;;) {
    std::optional<int> device;
    outcome.timing = {{"case", of.id}};
    try {
      outcome.line = attempt(of, retry, resources, stop, device, outcome.timing);
      if (!retry.reasons.empty()) outcome.timing["made_again"] = retry.reasons;
      return outcome;
    } catch (const Cancelled&) {
      throw;
    } catch (const DeviceError& error) {
      const bool is_memory = dynamic_cast<const DeviceMemoryError*>(&error) != nullptr;
      retry.reasons.push_back(error.what());
      if (device && is_memory && !retry.alone) {
        retry.alone = true;  // others may have held what it needed
        continue;
      }
      if (device && is_memory && !retry.device_bytes) {
        retry.device_bytes = kScarceDeviceBytes;
        continue;
      }
      if (device && !is_memory) {
        resources.devices.lose(*device);
        continue;
      }
      if (device && is_memory && resources.devices.may_fall_back(of.options.backend)) {
        retry.on_cpu = true;
        continue;
      }
      outcome.status = CaseStatus::failed;
      outcome.line = failed_line(of, "failed", error.what());
    } catch (const InputError& error) {
      outcome.status = CaseStatus::refused;
      outcome.line = failed_line(of, "refused", error.what());
    } catch (const UsageError& error) {
      outcome.status = CaseStatus::refused;
      outcome.line = failed_line(of, "refused", error.what());
    } catch (const std::bad_alloc&) {
      outcome.status = CaseStatus::failed;
      outcome.line = failed_line(of, "failed", "not enough memory; give the batch less with --memory, or fewer --jobs");
    } catch (const std::exception& error) {
      outcome.status = CaseStatus::failed;
      outcome.line = failed_line(of, "failed", error.what());
    }
    return outcome;
  }
}

}  // namespace tetwarp::apps
