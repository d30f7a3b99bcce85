// SPDX-License-Identifier: Apache-2.0
// File or folder that is written before it gets its name: `.NAME.<16 hex digits>.gsc-tmp` beside its target, locked
// (flock) as long as its owner lives. One that can be locked belongs to nobody: a killed program left it.
// note: an NFS mount with local locks (nolock, local_lock=flock) does not see owners on other machines
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

enum class TemporaryKind { File, Folder };

class Temporary {
public:
    // Creates it in the folder of `target`, which has no links left in it. `mode`: permission bits, less the umask. The
    // first one in a folder removes what killed programs of this user left there; where the file system has no locks
    // nothing is removed. Throws Error(Io), which names `target`.
    Temporary(const std::string& target, TemporaryKind kind, uint32_t mode);
    ~Temporary(); // removes it unless it has become something else
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

    [[nodiscard]] const std::string& path() const { return m_path; }
    // descriptor of a file, to read and write; or of a folder's lock
    [[nodiscard]] int descriptor() const { return m_fd; }
    // Call when it has been renamed: nothing is left to remove.
    void release() noexcept;

private:
    bool create(uint32_t mode);

    std::string m_path;
    TemporaryKind m_kind;
    int m_fd = -1, m_slot = -1;
};

// Removes the temporary files of this process, not its folders. Async-signal-safe, for a handler that ends the process.
void removeTemporaryFiles() noexcept;

} // namespace gsc
