// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace gsc {

// Position of the first byte that is not part of well-formed UTF-8, or text.size().
size_t utf8Prefix(std::string_view text);

// `text` with what is not UTF-8 in it replaced by U+FFFD, and control characters but tabs and line ends by "?": names of files
// may hold anything.
std::string validUtf8(std::string_view text);

// A text file's bytes without their byte order mark, in UTF-8 where that says UTF-16 (PowerShell writes it). Other bytes,
// those of binary files among them, come back as they are.
std::string decodedText(std::string bytes);

} // namespace gsc
