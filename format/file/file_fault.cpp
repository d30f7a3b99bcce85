// SPDX-License-Identifier: Apache-2.0
#include <gsc/file/file_fault.h>

#include <gsc/error.h>
#include <gsc/file/mapped_file.h>
#include "format/file/temporary.h"

#include <atomic>
#include <cstring>

#include <signal.h>
#include <unistd.h>

namespace gsc {

namespace {

std::atomic<bool> g_json{false}, g_json_events{false}, g_ending{false};
struct sigaction g_before;

void print(int fd, const char* text)
{
    size_t left = std::strlen(text);
    while (left > 0) {
        const ssize_t done = ::write(fd, text, left);
        if (done <= 0)
            return;
        text += done;
        left -= size_t(done);
    }
}

// Async-signal-safe; the thread that faulted holds the mapping, so its texts are alive.
extern "C" void onFileFault(int number, siginfo_t* info, void*)
{
    const FaultTexts* const texts = info->si_code > 0 ? faultTextsOf(info->si_addr) : nullptr;
    if (!texts) {
        ::sigaction(number, &g_before, nullptr); // the access is made again when this returns
        if (info->si_code <= 0)                  // a signal that another process sent, not a failed access
            ::raise(number);
        return;
    }
    if (g_ending.exchange(true)) // another thread says it
        for (;;)
            ::pause();
    removeTemporaryFiles();
    print(STDERR_FILENO, (g_json_events ? texts->event : texts->text).c_str());
    if (g_json)
        print(STDOUT_FILENO, texts->json.c_str());
    ::_exit(int(ErrorCode::Io));
}

} // namespace

void installFileFaultHandler(bool json, bool json_events)
{
    g_json = json;
    g_json_events = json_events;
    static const bool installed = [] {
        struct sigaction action {};
        action.sa_sigaction = onFileFault;
        action.sa_flags = SA_SIGINFO;
        sigemptyset(&action.sa_mask);
        return ::sigaction(SIGBUS, &action, &g_before) == 0;
    }();
    (void)installed;
}

} // namespace gsc
