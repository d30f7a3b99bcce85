// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/thread_guard.h"

#include "format/file/temporary.h"
#include <gsc/interrupt.h>
#include "format/machine/threads.h"
#include "runtime/cli/tool.h"

#include <atomic>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <thread>

#include <dlfcn.h>
#include <pthread.h>
#include <unistd.h>

namespace gsc {

namespace {

// time during which threads of other programs may end
[[maybe_unused]] constexpr auto kPatience = std::chrono::seconds(1);

std::atomic<bool> g_installed{false}, g_json{false}, g_json_events{false}, g_ending{false};

[[maybe_unused, noreturn]] void endWithoutThread()
{
    if (g_ending.exchange(true)) // another thread prints the message
        for (;;)
            ::pause();
    const Error error = tooFewThreads("a library");
    removeTemporaryFiles();
    Reporter report({g_json ? ReportFormat::Json : ReportFormat::Text,
                     g_json_events ? ProgressMode::Json : ProgressMode::None, true, false, true});
    report.error(error.what());
    if (g_json)
        report.object(errorJson(error));
    std::fflush(nullptr);
    ::_exit(int(error.code()));
}

} // namespace

void installThreadGuard(bool json, bool json_events)
{
    g_json = json;
    g_json_events = json_events;
    g_installed = true;
}

} // namespace gsc

// a sanitizer replaces the same function
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define GSC_SANITIZED
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer) || __has_feature(memory_sanitizer)
#define GSC_SANITIZED
#endif
#endif

#ifndef GSC_SANITIZED
// Replaces the C library's function for this program and all of its libraries.
extern "C" __attribute__((visibility("default"))) int
pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*), void* argument) noexcept
{
    using Create = int (*)(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*);
    static const auto create = reinterpret_cast<Create>(dlsym(RTLD_NEXT, "pthread_create"));
    int code = create(thread, attributes, start, argument);
    if (code != EAGAIN || !gsc::g_installed || gsc::ThreadAttempt::isOn())
        return code;
    const auto end = std::chrono::steady_clock::now() + gsc::kPatience;
    while (code == EAGAIN && !gsc::interrupted() && std::chrono::steady_clock::now() < end) {
        std::this_thread::sleep_for(std::chrono::milliseconds(1));
        code = create(thread, attributes, start, argument);
    }
    if (code == EAGAIN)
        gsc::endWithoutThread();
    return code;
}
#endif
