// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>

#include <cstdarg>
#include <cstdio>

namespace gsc {

const char* errorName(ErrorCode code)
{
    switch (code) {
    case ErrorCode::Ok:
        return "Ok";
    case ErrorCode::Usage:
        return "Usage";
    case ErrorCode::Io:
        return "Io";
    case ErrorCode::InvalidFile:
        return "InvalidFile";
    case ErrorCode::Internal:
        return "Internal";
    case ErrorCode::Unsupported:
        return "Unsupported";
    case ErrorCode::OutOfMemory:
        return "OutOfMemory";
    case ErrorCode::Device:
        return "Device";
    case ErrorCode::Difference:
        return "Difference";
    case ErrorCode::Interrupted:
        return "Interrupted";
    }
    return "Internal";
}

std::string formatString(const char* format, ...)
{
    va_list args;
    va_start(args, format);
    va_list again;
    va_copy(again, args);
    const int size = std::vsnprintf(nullptr, 0, format, args);
    va_end(args);
    std::string text(size > 0 ? size_t(size) : 0, '\0');
    if (size > 0)
        std::vsnprintf(text.data(), text.size() + 1, format, again);
    va_end(again);
    return text;
}

} // namespace gsc
