// SPDX-License-Identifier: Apache-2.0
#include <gsc/gsc_file.h>

#include "format/archive/archive.h"
#include <gsc/error.h>
#include "format/file/stand_in.h"
#include "format/machine/machine.h"

#include <cstdint>

#include <sys/mman.h>
#include <unistd.h>

namespace gsc {

namespace {

// Maps `bytes` of zeros, of which about `taken` will be written; a page takes memory only once it is written.
std::span<std::byte> zeroPages(const std::string& path, uint64_t bytes, uint64_t taken)
{
    if (const uint64_t memory = usableMemory(); memory > 0 && taken > memory)
        throw Error(
            ErrorCode::OutOfMemory, path, formatString("an archive that takes %.3g GB to read", double(taken) * 1e-9),
            formatString("one that fits the %.3g GB that this machine or container allows", double(memory) * 1e-9),
            "unpack it on a larger one, its file is read in place")
            .with({Setting::Unpacking});
    // a limit of the process's memory (boundMemory) counts private pages whole, even those never written; so shared
    // ones are used if not all are written
    const int kind = taken < bytes ? MAP_SHARED : MAP_PRIVATE;
    void* const data =
        ::mmap(nullptr, size_t(bytes), PROT_READ | PROT_WRITE, kind | MAP_ANONYMOUS | MAP_NORESERVE, -1, 0);
    if (data == MAP_FAILED)
        throw Error(ErrorCode::OutOfMemory, path,
                    formatString("there is no address space for the %.1f GB of this archive", double(bytes) * 1e-9),
                    "as much", "raise the limit of this process");
#if defined(__linux__)
    (void)::madvise(data, size_t(bytes), MADV_HUGEPAGE); // a hint, so a failure does not matter
#endif
    return {static_cast<std::byte*>(data), size_t(bytes)};
}

} // namespace

GscFile::GscFile(const std::string& path, const IssueSink& sink, Read read, int threads)
    : m_file(path), m_bytes(m_file.bytes()), m_stored_bytes(m_file.bytes().size())
{
    refuseStandIn(m_bytes, m_bytes.size(), path);
    m_is_archive = gsc::isArchive(m_file.bytes());
    if (!m_is_archive)
        return;
    const Archive archive(m_file.bytes(), sink);
    m_sound = archive.isSound();
    m_bytes = {};
    if (!m_sound)
        return;
    const Archive::Scope scope = read == Read::All ? Archive::Scope::All : Archive::Scope::Summary;
    m_decoded = zeroPages(path, archive.rawBytes(), archive.decodedBytes(scope));
    try {
        m_sound = archive.decode(m_decoded, scope, threads, sink);
    } catch (...) {
        ::munmap(m_decoded.data(), m_decoded.size());
        throw;
    }
    m_bytes = m_decoded;
}

void GscFile::letGo(std::span<const std::byte> part) const noexcept
{
    if (m_is_archive || part.empty())
        return;
#if defined(__linux__)
    // note: madvise(), since glibc's posix_madvise() ignores this advice
    const uintptr_t page = uintptr_t(sysconf(_SC_PAGESIZE)), at = reinterpret_cast<uintptr_t>(part.data());
    const uintptr_t first = at / page * page;
    (void)::madvise(reinterpret_cast<void*>(first), at + part.size() - first, MADV_DONTNEED);
#endif
}

GscFile::~GscFile()
{
    if (!m_decoded.empty())
        ::munmap(m_decoded.data(), m_decoded.size());
}

} // namespace gsc
