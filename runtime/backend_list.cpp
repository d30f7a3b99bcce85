// SPDX-License-Identifier: Apache-2.0
#include "runtime/backend.h"

#include "format/error.h"
#if defined(GSC_HAVE_CUDA)
#include "runtime/cuda/backend_cuda.h"
#endif

namespace gsc {

namespace {

struct Availability {
    bool usable = true;
    ErrorCode code = ErrorCode::Ok; // why not
    std::string text;               // usable: what renders; otherwise what is wrong and what to do
};

struct Entry {
    const char* name;
    Availability (*look)();
    std::unique_ptr<Backend> (*make)(int threads);
};

// Best first. A device's backend joins here, under the macro that says it was built.
constexpr Entry kEntries[] = {
#if defined(GSC_HAVE_CUDA)
    {"cuda",
     [] {
         const CudaStatus status = cudaStatus();
         return Availability{status.usable, status.code, status.text};
     },
     [](int) { return makeCudaBackend(); }},
#endif
    {"cpu",
     [] {
         return Availability{true, ErrorCode::Ok, "all cores, SIMD chosen at run time"};
     },
     [](int threads) { return makeCpuBackend(CpuPath::Fast, threads); }},
    {"cpu-reference",
     [] {
         return Availability{true, ErrorCode::Ok, "scalar, one thread; slow, for comparison"};
     },
     [](int threads) { return makeCpuBackend(CpuPath::Reference, threads); }},
};

} // namespace

std::vector<BackendInfo> availableBackends()
{
    std::vector<BackendInfo> backends;
    for (const Entry& entry : kEntries)
        if (Availability found = entry.look(); found.usable)
            backends.push_back({entry.name, std::move(found.text)});
    return backends;
}

std::unique_ptr<Backend> makeBackend(const std::string& name, int threads, std::string* warning)
{
    std::string names = "auto";
    for (const Entry& entry : kEntries) {
        names += std::string(", ") + entry.name;
        if (name != entry.name && name != "auto")
            continue;
        const Availability found = entry.look();
        if (found.usable)
            return entry.make(threads);
        if (name != "auto")
            throw Error(found.code, formatString("backend %s: %s", entry.name, found.text.c_str()));
        if (warning != nullptr)
            *warning = formatString("backend %s is passed over: %s", entry.name, found.text.c_str());
    }
    throw Error(ErrorCode::Usage, formatString("backend %s: not part of this build, expected one of %s; choose one of "
                                               "those",
                                               name.c_str(), names.c_str()));
}

} // namespace gsc
