// SPDX-License-Identifier: Apache-2.0
#include "format/mapped_file.h"

#include "format/error.h"

#include <cerrno>
#include <cstring>
#include <limits>
#include <utility>

#include <fcntl.h>
#include <sys/mman.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gsc {

namespace {

struct Descriptor {
    int fd;
    ~Descriptor()
    {
        if (fd >= 0)
            ::close(fd);
    }
};

[[noreturn]] void throwErrno(const std::string& path, const char* what, int code)
{
    throw Error(ErrorCode::Io, formatString("%s: %s (%s), expected a file that can be read; check its path and rights",
                                            path.c_str(), what, std::strerror(code)));
}

} // namespace

MappedFile::MappedFile(const std::string& path)
{
    // O_NONBLOCK: opening a named pipe must fail below instead of waiting for a writer
    const Descriptor file{::open(path.c_str(), O_RDONLY | O_CLOEXEC | O_NONBLOCK)};
    if (file.fd < 0)
        throwErrno(path, "cannot open", errno);
    struct stat info {};
    if (::fstat(file.fd, &info) != 0)
        throwErrno(path, "cannot read its size", errno);
    if (!S_ISREG(info.st_mode))
        throw Error(ErrorCode::Io, formatString("%s: not a regular file, expected one that can be mapped; pass the "
                                                "path of a file",
                                                path.c_str()));
    if (uint64_t(info.st_size) > uint64_t(std::numeric_limits<ptrdiff_t>::max()))
        throwErrno(path, "cannot map", EFBIG);
    if (info.st_size == 0)
        return; // mmap refuses zero bytes
    void* const address = ::mmap(nullptr, size_t(info.st_size), PROT_READ, MAP_PRIVATE, file.fd, 0);
    if (address == MAP_FAILED)
        throwErrno(path, "cannot map", errno);
    m_data = static_cast<const std::byte*>(address);
    m_size = size_t(info.st_size);
}

MappedFile::~MappedFile()
{
    if (m_data)
        ::munmap(const_cast<std::byte*>(m_data), m_size);
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : m_data(std::exchange(other.m_data, nullptr)), m_size(std::exchange(other.m_size, 0))
{
}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept
{
    std::swap(m_data, other.m_data);
    std::swap(m_size, other.m_size);
    return *this;
}

} // namespace gsc
