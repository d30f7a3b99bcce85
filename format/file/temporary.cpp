// SPDX-License-Identifier: Apache-2.0
#include "format/file/temporary.h"

#include <gsc/checksum.h>
#include <gsc/error.h>
#include <gsc/file/output_paths.h>

#include <atomic>
#include <cerrno>
#include <climits>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <random>
#include <set>
#include <span>
#include <string_view>

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

namespace gsc {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kSuffix = ".gsc-tmp";
constexpr size_t kDigits = 16;
// longest part of the target's name that is used, in bytes: with dots, digits and suffix the whole stays below NAME_MAX
constexpr size_t kMaxName = 200;

// Name of one temporary file, for the signal handler that removes it. `version` is odd while the owner writes the name.
struct Slot {
    std::atomic<bool> taken{false};
    std::atomic<uint32_t> version{0};
    char path[PATH_MAX] = {};
};
// one per temporary file: a command writes only a few at once; a file without a slot is removed by the next run
Slot g_slots[32];

int takeSlot(const std::string& path)
{
    if (path.size() >= sizeof(Slot::path))
        return -1;
    for (Slot& slot : g_slots)
        if (!slot.taken.exchange(true)) {
            ++slot.version;
            std::memcpy(slot.path, path.c_str(), path.size() + 1);
            ++slot.version;
            return int(&slot - g_slots);
        }
    return -1;
}

void freeSlot(int index)
{
    if (index < 0)
        return;
    Slot& slot = g_slots[index];
    ++slot.version;
    slot.path[0] = '\0';
    ++slot.version;
    slot.taken = false;
}

std::string temporaryName(const std::string& target)
{
    static std::mutex mutex;
    static std::random_device device;
    std::string name = fs::path(target).filename().string();
    if (name.size() > kMaxName)
        name = formatString("%016llx", static_cast<unsigned long long>(checksum64(std::as_bytes(std::span(name)))));
    const std::lock_guard lock(mutex);
    return formatString(".%s.%08x%08x%s", name.c_str(), device(), device(), kSuffix.data());
}

bool isTemporaryName(std::string_view name)
{
    if (name.size() < kDigits + kSuffix.size() + 3 || name.front() != '.' || !name.ends_with(kSuffix))
        return false;
    name.remove_suffix(kSuffix.size());
    const std::string_view digits = name.substr(name.size() - kDigits);
    return digits.find_first_not_of("0123456789abcdef") == std::string_view::npos &&
           name[name.size() - kDigits - 1] == '.';
}

// Returns true if `path` still names the file that is open as `fd`.
bool isNamed(int fd, const std::string& path, struct stat& info)
{
    struct stat named {};
    return ::fstat(fd, &info) == 0 && ::lstat(path.c_str(), &named) == 0 && info.st_dev == named.st_dev &&
           info.st_ino == named.st_ino;
}

void removeIfOwnerless(const std::string& path)
{
    constexpr int kFlags = O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC;
    int fd = ::open(path.c_str(), O_RDWR | kFlags); // open for writing, because NFS locks no other files
    if (fd < 0 && errno == EISDIR)
        fd = ::open(path.c_str(), O_RDONLY | O_DIRECTORY | kFlags);
    if (fd < 0)
        return;
    // checks the name again now that the lock is held: the owner may have renamed the file meanwhile
    struct stat info {};
    std::error_code ignored;
    if (::flock(fd, LOCK_EX | LOCK_NB) == 0 && isNamed(fd, path, info) && info.st_uid == ::geteuid()) {
        if (S_ISDIR(info.st_mode))
            fs::remove_all(path, ignored);
        else if (S_ISREG(info.st_mode))
            ::unlink(path.c_str());
    }
    ::close(fd);
}

// Removes temporaries of killed programs from `folder`, once per folder and process: a player writes thousands of
// images into one.
void removeLeftovers(const std::string& folder)
{
    static std::mutex mutex;
    static std::set<std::string> seen;
    const std::lock_guard lock(mutex);
    if (!seen.insert(folder).second)
        return;
    std::error_code code;
    for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code))
        if (isTemporaryName(entry->path().filename().native()))
            removeIfOwnerless(entry->path().native());
}

} // namespace

Temporary::Temporary(const std::string& target, TemporaryKind kind, uint32_t mode) : m_kind(kind)
{
    const std::string folder = folderOf(target);
    removeLeftovers(folder);
    for (int attempt = 0; attempt < 100; ++attempt) {
        m_path = (folder == "/" ? "" : folder) + "/" + temporaryName(target);
        if (create(mode)) {
            m_slot = kind == TemporaryKind::File ? takeSlot(m_path) : -1;
            return;
        }
        if (errno != EEXIST)
            break;
    }
    failOutput(target, "cannot create a temporary beside it", errno);
}

// Creates and locks the file or folder. Returns false with errno; after EEXIST another name may work.
bool Temporary::create(uint32_t mode)
{
    if (m_kind == TemporaryKind::File) {
        m_fd = ::open(m_path.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, mode);
        if (m_fd < 0)
            return false;
    } else {
        if (::mkdir(m_path.c_str(), mode) != 0)
            return false;
        m_fd = ::open(m_path.c_str(), O_RDONLY | O_DIRECTORY | O_NOFOLLOW | O_CLOEXEC);
        if (m_fd < 0) {
            const int reason = errno;
            ::rmdir(m_path.c_str());
            errno = reason == ENOENT ? EEXIST : reason;
            return false;
        }
    }
    // True if another program took the new, not yet locked temporary for a leftover: it holds the lock, and has removed
    // the temporary or is about to. Any other failure means that this file system has no locks; then no program removes
    // leftovers here.
    const bool lost = ::flock(m_fd, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK;
    struct stat ignored {};
    if (!lost && isNamed(m_fd, m_path, ignored))
        return true;
    ::close(m_fd);
    m_fd = -1;
    errno = EEXIST;
    return false;
}

Temporary::~Temporary()
{
    if (m_slot >= 0 || !m_path.empty()) {
        std::error_code ignored;
        if (!m_path.empty() && m_kind == TemporaryKind::File)
            ::unlink(m_path.c_str());
        else if (!m_path.empty())
            fs::remove_all(m_path, ignored);
        freeSlot(m_slot);
    }
    if (m_fd >= 0)
        ::close(m_fd);
}

void Temporary::release() noexcept
{
    freeSlot(m_slot);
    m_slot = -1;
    m_path.clear();
}

std::string temporaryFolder()
{
    std::error_code none;
    const fs::path folder = fs::temp_directory_path(none);
    if (none)
        throw Error(ErrorCode::Io, "TMPDIR", "names no folder", "one for temporary files",
                    "set it to one that may be written");
    return fs::canonical(folder).string();
}

void removeTemporaryFiles() noexcept
{
    for (const Slot& slot : g_slots) {
        const uint32_t version = slot.version;
        if (!slot.taken || version % 2 != 0)
            continue;
        char path[PATH_MAX];
        // the owner is writing the name at this moment, so the slot is skipped
        std::memcpy(path, slot.path, sizeof(path));
        if (slot.version == version && path[0] != '\0')
            ::unlink(path);
    }
}

} // namespace gsc
