// SPDX-License-Identifier: Apache-2.0
// Errors of the environment and of input files. A caller bug is an assertion, never an Error.
#pragma once

#include <gsc/utf8.h>

#include <cstdint>
#include <stdexcept>
#include <string>

namespace gsc {

// The numbers are the documented exit codes of every command line (design section 8).
enum class ErrorCode : int {
    Ok = 0,
    Usage = 1,
    Io = 2,
    InvalidFile = 3,
    Internal = 4,
    Unsupported = 5,
    OutOfMemory = 6,
    Device = 7,
    Difference = 8,
    Interrupted = 130,
};

// As reports name it, such as "InvalidFile".
const char* errorName(ErrorCode code);

// Message form: `<file or object>: <what is wrong, with values>, expected <what>; <what to do>`,
// lower case, no full stop.
class Error : public std::runtime_error {
public:
    Error(ErrorCode code, const std::string& message) : std::runtime_error(validUtf8(message)), m_code(code) {}

    [[nodiscard]] ErrorCode code() const noexcept { return m_code; }

private:
    ErrorCode m_code;
};

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
// printf into a std::string (libstdc++ 12 has no std::format).
std::string
formatString(const char* format, ...);

} // namespace gsc
