// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace gsc {

// Position of the first byte of `text` that is not part of well-formed UTF-8, or text.size().
size_t utf8Prefix(std::string_view text);

// Copy of `text` with U+FFFD for what is not UTF-8, and "?" for control characters other than tabs and line ends: names
// of files may hold any bytes.
std::string validUtf8(std::string_view text);

// Returns the bytes of a text file as UTF-8 without a byte order mark; UTF-16 with such a mark (as PowerShell writes
// it) is converted. Other bytes, also those of binary files, are returned unchanged.
std::string decodedText(std::string bytes);

} // namespace gsc
