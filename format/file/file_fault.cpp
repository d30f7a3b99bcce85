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

// Signal handler, so only async-signal-safe calls. The thread that faulted still holds its mapping, so the texts of
// that mapping are alive.
extern "C" void onFileFault(int number, siginfo_t* info, void*)
{
    const FaultTexts* const texts = info->si_code > 0 ? faultTextsOf(info->si_addr) : nullptr;
    if (!texts) {
        // restores the action from before; when this handler returns the access is made again and meets that action
        ::sigaction(number, &g_before, nullptr);
        if (info->si_code <= 0) // the signal was sent by a process and is no failed access
            ::raise(number);
        return;
    }
    if (g_ending.exchange(true)) // another thread already writes the message
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
