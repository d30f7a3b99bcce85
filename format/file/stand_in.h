// SPDX-License-Identifier: Apache-2.0
// Recognises files that hold only a stand-in for the wanted file, such as a pointer or an error page, under its name.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>

namespace gsc {

constexpr size_t kStandInBytes = 1024; // bytes from the start of a file that refuseStandIn() needs

// Refuses a Git LFS pointer, a symbolic link that Git stored as text, a web page or a server's "404: Not Found" saved
// instead of a download, and a file that was compressed as a whole. `start` holds the first kStandInBytes of the file,
// or all if it is shorter; `bytes` is the size of the file. Every reader of other programs' files calls it before
// looking at the format. Throws Error: InvalidFile; Unsupported for a compressed file.
void refuseStandIn(std::span<const std::byte> start, uint64_t bytes, const std::string& path);
void refuseStandIn(std::string_view whole, const std::string& path);

} // namespace gsc
