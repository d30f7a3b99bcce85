// SPDX-License-Identifier: Apache-2.0
// File or folder that is written before it gets its name: it is called `.NAME.<16 hex digits>.gsc-tmp`, lies beside its
// target and is locked (flock) while its owner lives. One that can be locked was left by a killed program. note: an NFS
// mount with local locks (nolock, local_lock=flock) does not see owners on other machines
#pragma once

#include <cstdint>
#include <string>

namespace gsc {

enum class TemporaryKind { File, Folder };

class Temporary {
public:
    // Creates the temporary in the folder of `target`, whose symbolic links are already resolved. `mode`: permission
    // bits, from which the umask is taken off. The first one in a folder removes what killed programs of this user left
    // there; where the file system has no locks nothing is removed. Throws Error(Io), which names `target`.
    Temporary(const std::string& target, TemporaryKind kind, uint32_t mode);
    ~Temporary(); // removes the temporary, unless its name now belongs to another file
    Temporary(const Temporary&) = delete;
    Temporary& operator=(const Temporary&) = delete;

    [[nodiscard]] const std::string& path() const { return m_path; }
    // descriptor of the file, open to read and write; for a folder, the descriptor that holds its lock
    [[nodiscard]] int descriptor() const { return m_fd; }
    // To be called after the temporary was renamed: the destructor then removes nothing.
    void release() noexcept;

private:
    bool create(uint32_t mode);

    std::string m_path;
    TemporaryKind m_kind;
    int m_fd = -1, m_slot = -1;
};

// Returns the folder for temporary files, with symbolic links resolved: TMPDIR, or /tmp without it. Throws Error(Io).
std::string temporaryFolder();

// Removes all temporary files of this process, but not its temporary folders. Async-signal-safe, for a signal handler
// that ends the process.
void removeTemporaryFiles() noexcept;

} // namespace gsc
