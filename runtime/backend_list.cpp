// SPDX-License-Identifier: Apache-2.0
#include "runtime/backend.h"

#include "format/error.h"

namespace gsc {

namespace {

struct Entry {
    const char* name;
    const char* description;
    std::unique_ptr<Backend> (*make)(int threads);
};

// Best first. A device's backend joins here, under the macro that says it was built.
constexpr Entry kEntries[] = {
    {"cpu", "all cores, SIMD chosen at run time", [](int threads) { return makeCpuBackend(CpuPath::Fast, threads); }},
    {"cpu-reference", "scalar, one thread; slow, for comparison",
     [](int threads) { return makeCpuBackend(CpuPath::Reference, threads); }},
};

} // namespace

std::vector<BackendInfo> availableBackends()
{
    std::vector<BackendInfo> backends;
    for (const Entry& entry : kEntries)
        backends.push_back({entry.name, entry.description});
    return backends;
}

std::unique_ptr<Backend> makeBackend(const std::string& name, int threads)
{
    std::string names = "auto";
    for (const Entry& entry : kEntries) {
        if (name == entry.name || name == "auto")
            return entry.make(threads);
        names += std::string(", ") + entry.name;
    }
    throw Error(ErrorCode::Usage, formatString("backend %s: not available here, expected one of %s; choose one of "
                                               "those",
                                               name.c_str(), names.c_str()));
}

} // namespace gsc
