// SPDX-License-Identifier: Apache-2.0
// Something done in a process of its own, whose signals and limits do not outlive it.
#pragma once

#include <doctest/doctest.h>

#include <cstdio>
#include <functional>
#include <string>

#include <sys/wait.h>
#include <unistd.h>

namespace gsc::test {

// Exit code of `action` in a child, or minus the signal that ended it. Appends the child's output on `stream` to
// `printed`, if given.
inline int inChild(const std::function<int()>& action, std::string* printed = nullptr, int stream = STDERR_FILENO)
{
    int ends[2];
    REQUIRE(::pipe(ends) == 0);
    std::fflush(stdout);
    const pid_t child = ::fork();
    REQUIRE(child >= 0);
    if (child == 0) {
        if (printed)
            ::dup2(ends[1], stream);
        int status = 99;
        try {
            status = action();
        } catch (...) {
        }
        ::_exit(status);
    }
    ::close(ends[1]);
    char buffer[4096];
    for (ssize_t got; printed && (got = ::read(ends[0], buffer, sizeof(buffer))) > 0;)
        printed->append(buffer, size_t(got));
    ::close(ends[0]);
    int status = 0;
    REQUIRE(::waitpid(child, &status, 0) == child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
}

} // namespace gsc::test
