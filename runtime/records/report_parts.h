// SPDX-License-Identifier: Apache-2.0
// Parts that several reports share: statistics, and facts of the tool, the file, the device and reuse.
#pragma once

#include "runtime/records/record.h"
#include <gsc/renderer.h>

#include <string>
#include <vector>

namespace gsc {

// Order statistics by nearest rank.
struct Spread {
    double mean = 0, median = 0, p95 = 0, p99 = 0, max = 0;
};

// Zeros for no values.
Spread spreadOf(std::vector<double> values);

// The q-quantile by nearest rank, q in (0, 1]. Precondition: at least one value, ascending.
double nearestRank(const std::vector<double>& sorted, double q);

// Program that wrote a report.
struct ToolFacts {
    std::string name, version, commit; // commit: empty if not known

    bool operator==(const ToolFacts&) const = default;
};
ToolFacts thisTool();

struct FileFacts {
    std::string path;
    uint64_t bytes = 0, anchors = 0;
};

// Options of reuse. -1, an empty text and 0: the policy takes no such option, or none was given.
struct ReuseFacts {
    std::string policy;
    int64_t max_depth = -1;
    std::string guidance;
    double bound = -1;                            // in units of 1/255
    uint64_t decode_budget = 0, cache_budget = 0; // anchors per frame and eye, bytes
};
ReuseFacts reuseFacts(const ReuseOptions& reuse);

// Write or read the part, as `at` does.
void describe(const Record& at, Spread& spread);
void describe(const Record& at, ToolFacts& tool);
void describe(const Record& at, FileFacts& file);
void describe(const Record& at, DeviceFacts& device);
void describe(const Record& at, ReuseFacts& reuse);

template <typename Facts>
OrderedJson toJson(Facts facts)
{
    OrderedJson json;
    describe(Record(json), facts);
    return json;
}

OrderedJson unknownIfZero(double value);                  // null if it is 0
std::string decibels(double psnr, const char* unit = ""); // four digits; "identical" for +infinity

} // namespace gsc
