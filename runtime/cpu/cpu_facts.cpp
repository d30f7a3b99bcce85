// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/renderer_cpu.h"

#include <fstream>

#include <unistd.h>

namespace gsc {

DeviceFacts cpuFacts(uint32_t threads)
{
    DeviceFacts facts;
    facts.processors = threads;
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    if (pages > 0 && page > 0)
        facts.memory_bytes = uint64_t(pages) * uint64_t(page);
    std::ifstream info("/proc/cpuinfo"); // not there outside Linux: the name stays unknown
    for (std::string line; std::getline(info, line) && facts.name.empty();)
        if (const size_t colon = line.find(": "); line.starts_with("model name") && colon != std::string::npos)
            facts.name = line.substr(colon + 2);
    return facts;
}

} // namespace gsc
