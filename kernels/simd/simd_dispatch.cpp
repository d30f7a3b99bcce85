// SPDX-License-Identifier: Apache-2.0
// Functions of Highway's library that its headers call (choice of an instruction set, and Abort in debug builds). They
// are for programs that shall be one file, since distributions have that library only as a shared one.
#include "kernels/simd/simd_support.h"

#include <atomic>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>

#include <hwy/targets.h>

namespace hwy {

namespace {

std::atomic<int64_t> s_for_test{0};
std::atomic<int64_t> s_disabled{0};
ChosenTarget s_chosen;

} // namespace

int64_t SupportedTargets()
{
    const int64_t for_test = s_for_test;
    const int64_t targets = (for_test != 0 ? for_test : gsc::supportedSimdTargets()) & ~s_disabled;
    return targets != 0 ? targets : HWY_STATIC_TARGET;
}

void DisableTargets(int64_t disabled_targets)
{
    s_disabled = disabled_targets;
    s_chosen.DeInit();
}

void SetSupportedTargetsForTest(int64_t targets)
{
    s_for_test = targets;
    s_chosen.DeInit();
}

ChosenTarget& GetChosenTarget()
{
    return s_chosen;
}

void Abort(const char* file, int line, const char* format, ...)
{
    std::fprintf(stderr, "%s:%d: ", file, line);
    va_list list;
    va_start(list, format);
    std::vfprintf(stderr, format, list);
    va_end(list);
    std::fputc('\n', stderr);
    std::abort();
}

} // namespace hwy
