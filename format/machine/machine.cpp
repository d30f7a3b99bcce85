// SPDX-License-Identifier: Apache-2.0
#include "format/machine/machine.h"

#include "format/machine/cgroup.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <limits>
#include <optional>
#include <thread>

#include <unistd.h>
#ifdef __linux__
#include <pthread.h>
#include <sched.h>
#include <sys/resource.h>
#endif

namespace gsc {

namespace {

constexpr uint64_t kStack = 2 << 20; // bytes of a thread's stack
// a sixteenth (1 / 16) of the memory is left for the system's own records of a process, and for pages of files
constexpr uint64_t kReserve = 16;

const CgroupLimits& limitsAtStart()
{
    static const CgroupLimits limits = cgroupLimits();
    return limits;
}

uint64_t machineMemory()
{
    const long pages = sysconf(_SC_PHYS_PAGES), page = sysconf(_SC_PAGESIZE);
    return pages > 0 && page > 0 ? uint64_t(pages) * uint64_t(page) : 0;
}

// Bytes of this process that RLIMIT_DATA counts; under a sanitizer these are terabytes.
uint64_t dataBytes()
{
    std::ifstream file("/proc/self/statm"); // six numbers of pages: size, resident, shared, text, library, data
    uint64_t pages = 0;
    for (int i = 0; i < 6; ++i)
        file >> pages;
    return pages * uint64_t(sysconf(_SC_PAGESIZE));
}

#ifdef __linux__
// Limit of data memory that this process was started with, empty unless boundMemory() changed it.
std::optional<rlimit>& startedWith()
{
    static std::optional<rlimit> limit;
    return limit;
}
#endif

// Returns true if an NVIDIA driver is there, that of Linux or that of Windows under WSL.
bool gpuDriver()
{
    return ::access("/dev/nvidiactl", F_OK) == 0 || ::access("/dev/dxg", F_OK) == 0;
}

int runnableProcessors()
{
#ifdef __linux__
    cpu_set_t set;
    if (sched_getaffinity(0, sizeof set, &set) == 0)
        return std::max(1, CPU_COUNT(&set));
#endif
    return std::max(1, int(std::thread::hardware_concurrency()));
}

} // namespace

uint64_t usableMemory()
{
    const uint64_t limit = limitsAtStart().memory, memory = machineMemory();
    if (memory == 0)
        return limit == std::numeric_limits<uint64_t>::max() ? 0 : limit;
    return std::min(limit, memory);
}

void boundMemory()
{
#ifdef __linux__
    const uint64_t memory_free = limitsAtStart().memory_free;
    if (memory_free >= machineMemory() || dataBytes() > memory_free || gpuDriver())
        return;
    // makes stacks smaller, since a limit counts a stack whole, though little of it is touched
    pthread_attr_t attributes;
    if (pthread_attr_init(&attributes) == 0) {
        pthread_attr_setstacksize(&attributes, kStack);
        pthread_setattr_default_np(&attributes);
        pthread_attr_destroy(&attributes);
    }
    const uint64_t stacks = uint64_t(usableProcessors()) * kStack;
    rlimit limit{};
    if (getrlimit(RLIMIT_DATA, &limit) != 0)
        return;
    startedWith() = limit;
    limit.rlim_cur = std::min<rlim_t>(limit.rlim_cur, memory_free - memory_free / kReserve + stacks);
    setrlimit(RLIMIT_DATA, &limit);
#endif
}

void restoreLimits([[maybe_unused]] int process)
{
#ifdef __linux__
    if (startedWith())
        (void)::prlimit(process, RLIMIT_DATA, &*startedWith(), nullptr);
#endif
}

int usableProcessors()
{
    return int(std::clamp(std::ceil(limitsAtStart().processors), 1.0, double(runnableProcessors())));
}

} // namespace gsc
