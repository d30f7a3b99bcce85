// SPDX-License-Identifier: Apache-2.0
#include "convert/input/input_file.h"

#include <gsc/error.h>
#include "format/file/stand_in.h"
#include <gsc/utf8.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gsc {

// note: O_NONBLOCK changes nothing for a regular file, but without it opening a pipe would wait for a program that
// writes to it, perhaps for ever
InputFile::InputFile(const std::string& path)
    : m_path(path), m_fd(::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK))
{
    if (m_fd < 0)
        throw Error(ErrorCode::Io, path, std::string("cannot be opened (") + std::strerror(errno) + ")",
                    "a readable file", "check the path and its permissions");
    struct stat info = {};
    if (::fstat(m_fd, &info) != 0 || !S_ISREG(info.st_mode)) {
        ::close(m_fd);
        throw Error(ErrorCode::Io, path, "is no regular file", "one", "check the path");
    }
    m_bytes = uint64_t(info.st_size);
    (void)::posix_fadvise(m_fd, 0, 0, POSIX_FADV_SEQUENTIAL); // doubles the amount that the kernel reads ahead
    try {
        refuseStandIn();
    } catch (...) {
        ::close(m_fd); // the destructor does not run when the constructor throws
        throw;
    }
}

void InputFile::refuseStandIn() const
{
    std::byte start[kStandInBytes];
    const std::span<std::byte> part(start, size_t(std::min<uint64_t>(m_bytes, sizeof(start))));
    read(0, part);
    gsc::refuseStandIn(part, m_bytes, m_path);
}

InputFile::~InputFile()
{
    ::close(m_fd);
}

void InputFile::read(uint64_t offset, std::span<std::byte> out) const
{
    size_t done = 0;
    while (done < out.size()) {
        const ssize_t got = ::pread(m_fd, out.data() + done, out.size() - done, off_t(offset + done));
        if (got > 0) {
            done += size_t(got);
        } else if (got == 0) {
            throw Error(ErrorCode::Io, m_path,
                        formatString("ends at byte %llu", static_cast<unsigned long long>(offset + done)),
                        formatString("%llu more", static_cast<unsigned long long>(out.size() - done)),
                        "it became shorter while it was read");
        } else if (errno != EINTR) {
            throw Error(ErrorCode::Io, m_path,
                        formatString("cannot be read at byte %llu (%s)", static_cast<unsigned long long>(offset + done),
                                     std::strerror(errno)),
                        "a readable file", "check the disk");
        }
    }
}

void InputFile::prefetch(uint64_t offset, uint64_t bytes) const noexcept
{
    (void)::posix_fadvise(m_fd, off_t(offset), off_t(bytes), POSIX_FADV_WILLNEED);
}

std::vector<std::byte> readWholeFile(const std::string& path, uint64_t max_bytes, const char* what)
{
    const InputFile file(path);
    if (file.bytes() > max_bytes)
        throw Error(ErrorCode::InvalidFile, path,
                    formatString("has %llu bytes", static_cast<unsigned long long>(file.bytes())),
                    formatString("%s of at most %llu", what, static_cast<unsigned long long>(max_bytes)),
                    "pass the file the trainer wrote");
    std::vector<std::byte> bytes(file.bytes());
    file.read(0, bytes);
    return bytes;
}

std::string readTextFile(const std::string& path, uint64_t max_bytes, const char* what)
{
    const std::vector<std::byte> bytes = readWholeFile(path, max_bytes, what);
    return decodedText({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
}

} // namespace gsc
