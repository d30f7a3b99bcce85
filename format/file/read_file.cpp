// SPDX-License-Identifier: Apache-2.0
#include <gsc/file/read_file.h>

#include <gsc/error.h>
#include "format/file/stand_in.h"
#include <gsc/interrupt.h>
#include <gsc/utf8.h>

#include <cerrno>
#include <cstring>
#include <utility>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

namespace gsc {

namespace {

struct Descriptor {
    int fd;
    ~Descriptor()
    {
        if (fd > STDERR_FILENO)
            ::close(fd);
    }
};

[[noreturn]] void throwIo(const std::string& path, const char* what, const char* expected)
{
    throw Error(ErrorCode::Io, path, formatString("%s (%s)", what, std::strerror(errno)), expected,
                "check its path and rights");
}

} // namespace

std::string readInputText(const std::string& path, uint64_t most, const char* expected)
{
    // O_NONBLOCK: without it, opening a pipe waits for a writer, and no signal ends that wait
    const Descriptor file{path == "-" ? STDIN_FILENO : ::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    if (file.fd < 0)
        throwIo(path, "cannot be opened", expected);
    std::string text;
    char buffer[65536];
    while (true) {
        throwIfInterrupted();
        pollfd waited{file.fd, POLLIN, 0};
        constexpr int kMilliseconds = 100;
        // standard input waits until there is something to read; a pipe that nobody has opened for writing never gets
        // ready, so it is read at once, which returns no bytes
        if (::poll(&waited, 1, kMilliseconds) == 0 && file.fd == STDIN_FILENO)
            continue;
        const ssize_t count = ::read(file.fd, buffer, sizeof(buffer));
        if (count == 0) {
            refuseStandIn(text, path);
            return decodedText(std::move(text));
        }
        if (count < 0) {
            if (errno == EINTR || errno == EAGAIN)
                continue;
            throwIo(path, "cannot be read", expected);
        }
        text.append(buffer, size_t(count));
        if (text.size() > most)
            throw Error(ErrorCode::InvalidFile, path,
                        formatString("has more than %llu MiB", static_cast<unsigned long long>(most >> 20)), expected,
                        "check its path");
    }
}

} // namespace gsc
