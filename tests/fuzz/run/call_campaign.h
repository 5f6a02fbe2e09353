// Tries sequences of calls of the public interface.
#pragma once

#include "tests/fuzz/judge/call_check.h"
#include "tests/fuzz/run/campaign.h"

namespace mray::fuzz {

/// Those of the worker's backend, in groups; made when they are first asked for.
const std::vector<std::vector<CallDevices>>& call_devices(const Worker& worker);

/// Plays a worker's part of make_calls(), each on a group of devices. Returns as run_campaign().
int run_calls(const CampaignConfig& config, const Worker& worker, WorkerState& state,
              std::atomic<std::uint64_t>& failures);

}  // namespace mray::fuzz
