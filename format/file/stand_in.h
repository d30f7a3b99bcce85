// SPDX-License-Identifier: Apache-2.0
// Files that stand for another file and hold nothing of it, under its name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace gsc {

constexpr size_t kStandInBytes = 1024; // bytes of a file's start that refuseStandIn() needs

// Refuses a Git LFS pointer, a symbolic link that Git left as text, a web page or a server's "404: Not Found" saved
// instead of a download, and a file that was compressed as a whole. `start` holds the first bytes of the file, kStandInBytes or all, `bytes` is its size.
// To be called by whatever opens a file of others, before its format is looked for. Throws Error: InvalidFile;
// Unsupported for a compressed file.
void refuseStandIn(std::span<const std::byte> start, uint64_t bytes, const std::string& path);
void refuseStandIn(std::string_view whole, const std::string& path);

} // namespace gsc
