// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/renderer_cpu.h"

#include "format/machine/machine.h"

#include <fstream>

namespace gsc {

DeviceFacts cpuFacts(uint32_t threads)
{
    DeviceFacts facts;
    facts.processors = threads;
    facts.memory_bytes = usableMemory();
    std::ifstream info("/proc/cpuinfo"); // not there outside Linux: the name stays unknown
    for (std::string line; std::getline(info, line) && facts.name.empty();)
        if (const size_t colon = line.find(": "); line.starts_with("model name") && colon != std::string::npos)
            facts.name = line.substr(colon + 2);
    return facts;
}

} // namespace gsc
