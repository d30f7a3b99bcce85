// SPDX-License-Identifier: Apache-2.0
#include <gsc/file/mapped_file.h>

#include <gsc/error.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
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
    if (code == ENOMEM)
        throw Error(ErrorCode::OutOfMemory, path, formatString("%s (%s)", what, std::strerror(code)),
                    "address space for the whole file", "raise the limit (ulimit -v) or close other programs");
    throw Error(ErrorCode::Io, path, formatString("%s (%s)", what, std::strerror(code)), "a file that can be read",
                "check its path and rights");
}

// One mapping in the table that a signal handler searches. A mapping for which the table had no free slot is not named
// in the message when it faults.
struct Slot {
    std::atomic<bool> taken{false};
    std::atomic<uintptr_t> begin{0}, end{0};
    std::atomic<const FaultTexts*> texts{nullptr};
};
Slot g_slots[64];
static_assert(std::atomic<uintptr_t>::is_always_lock_free && std::atomic<const FaultTexts*>::is_always_lock_free);

int takeSlot(std::span<const std::byte> bytes, const FaultTexts* texts)
{
    for (Slot& slot : g_slots)
        if (!slot.taken.exchange(true)) {
            slot.texts = texts;
            slot.begin = reinterpret_cast<uintptr_t>(bytes.data());
            slot.end = reinterpret_cast<uintptr_t>(bytes.data()) + bytes.size();
            return int(&slot - g_slots);
        }
    return -1;
}

void freeSlot(int index)
{
    if (index < 0)
        return;
    Slot& slot = g_slots[index];
    slot.end = 0;
    slot.begin = 0;
    slot.texts = nullptr;
    slot.taken = false;
}

std::string jsonQuoted(const std::string& text)
{
    std::string quoted = "\"";
    for (const char c : text)
        if (c == '"' || c == '\\')
            quoted += std::string("\\") + c;
        else if (static_cast<unsigned char>(c) < 0x20)
            quoted += formatString("\\u%04x", unsigned(c));
        else
            quoted += c;
    return quoted + "\"";
}

std::unique_ptr<const FaultTexts> faultTexts(const std::string& path)
{
    const Error error(ErrorCode::Io, path, "became shorter while it was read, or its disk failed",
                      "a file that stays as it is", "write new versions under another name and rename them");
    const std::string message = error.what(), quoted = jsonQuoted(message);
    // texts made in advance, because a signal handler cannot run errorJson(); they equal that function's JSON
    return std::make_unique<const FaultTexts>(FaultTexts{
        "error: " + message + "\n", R"({"event":"error","message":)" + quoted + "}\n",
        formatString(
            "{\"schema\": \"gsc.error/1\", \"code\": \"Io\", \"exit_code\": %d, \"message\": %s, \"subject\": %s, "
            "\"found\": %s, \"expected\": %s, \"remedy\": %s}\n",
            int(ErrorCode::Io), quoted.c_str(), jsonQuoted(error.subject()).c_str(), jsonQuoted(error.found()).c_str(),
            jsonQuoted(error.expected()).c_str(), jsonQuoted(error.remedy()).c_str())});
}

} // namespace

const FaultTexts* faultTextsOf(const void* address) noexcept
{
    const auto at = reinterpret_cast<uintptr_t>(address);
    for (const Slot& slot : g_slots)
        if (at >= slot.begin && at < slot.end)
            return slot.texts;
    return nullptr;
}

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
        throw Error(ErrorCode::Io, path, "not a regular file", "one that can be mapped", "pass the path of a file");
    if (uint64_t(info.st_size) > uint64_t(std::numeric_limits<ptrdiff_t>::max()))
        throwErrno(path, "cannot map", EFBIG);
    if (info.st_size == 0)
        return; // mmap() refuses to map zero bytes
    void* const address = ::mmap(nullptr, size_t(info.st_size), PROT_READ, MAP_PRIVATE, file.fd, 0);
    if (address == MAP_FAILED)
        throwErrno(path, "cannot map", errno);
    m_data = static_cast<const std::byte*>(address);
    m_size = size_t(info.st_size);
    m_texts = faultTexts(path);
    m_slot = takeSlot(bytes(), m_texts.get());
}

MappedFile::~MappedFile()
{
    freeSlot(m_slot);
    if (m_data)
        ::munmap(const_cast<std::byte*>(m_data), m_size);
}

MappedFile::MappedFile(MappedFile&& other) noexcept
    : m_data(std::exchange(other.m_data, nullptr)), m_size(std::exchange(other.m_size, 0)),
      m_slot(std::exchange(other.m_slot, -1)), m_texts(std::move(other.m_texts))
{
}

MappedFile& MappedFile::operator=(MappedFile&& other) noexcept
{
    std::swap(m_data, other.m_data);
    std::swap(m_size, other.m_size);
    std::swap(m_slot, other.m_slot);
    std::swap(m_texts, other.m_texts);
    return *this;
}

} // namespace gsc
