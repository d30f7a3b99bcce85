// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include <gsc/utf8.h>

#include <cassert>
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

Error::Error(ErrorCode code, const std::string& subject, const std::string& found, const std::string& expected,
             const std::string& remedy)
    : std::runtime_error(validUtf8(subject + ": " + found + ", expected " + expected + "; " + remedy)), m_code(code),
      m_subject(validUtf8(subject)), m_found(validUtf8(found)), m_expected(validUtf8(expected)),
      m_remedy(validUtf8(remedy))
{
    assert(!found.empty() && !expected.empty() && !remedy.empty());
}

Error Error::about(const std::string& subject) const
{
    return Error(m_code, subject, m_found, m_expected, m_remedy).with(m_settings);
}

std::string Error::withoutSubject() const
{
    return m_found + ", expected " + m_expected + "; " + m_remedy;
}

Error internalError(const std::string& subject, const std::string& found, const std::string& expected)
{
    return {ErrorCode::Internal, subject, found, expected, "this is a bug, please report it"};
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
