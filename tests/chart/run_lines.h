// SPDX-License-Identifier: Apache-2.0
// Lines of gsc.run/2 for tests, as short as they may be. make_runs.py makes long ones.
#pragma once

#include "convert/chart/rows/run_set.h"

#include <nlohmann/json.hpp>

#include <string>
#include <vector>

namespace gsc {

// Policy none, tier fast, two frames of equal images at 4 ms, trajectory walk.
nlohmann::json plainRun();
// plainRun() with another policy, another median, and PSNR `psnr` in all three forms of accuracy; null = equal.
nlohmann::json runOf(const std::string& policy, double ms, const nlohmann::json& psnr);
ChartRun parsed(const nlohmann::json& line); // throws as addRuns()
std::vector<ChartRun> hostileRuns();         // two of one trajectory, with names that try to be markup

} // namespace gsc
