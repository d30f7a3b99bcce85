// SPDX-License-Identifier: Apache-2.0
// Errors that come from the environment or from input files. A mistake of the caller is an assertion, never an Error.
#pragma once

#include <cstdint>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Kinds of errors. The numbers are the exit codes of every program, as documented.
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

// Name of a code in reports, such as "InvalidFile".
const char* errorName(ErrorCode code);

// Settings and tools that the remedy of an Error speaks of. The program that prints the error adds its own words for
// them, such as the name of an option.
enum class Setting {
    DeviceMemory,    // budget of device memory
    CacheMemory,     // budget of the reuse cache
    ImageSize,       // width and height of a camera or frame
    FieldOfView,     // angle of view of a camera
    Detail,          // smallest detail drawn by itself
    Appearance,      // row of the appearance embedding
    CpuBackend,      // drawing with the backend cpu
    InjectedFault,   // fault that a test asks for
    DeviceList,      // list of the devices of this machine
    LensDistortion,  // cameras whose lens distorts are drawn as pinholes
    CameraTransform, // coordinates of cameras that were moved
    Overwrite,       // permission to replace an output
    ReportFormat,    // format of standard output
    Validation,      // list of all that is wrong with a file
    Conversion,      // making a file from a checkpoint
    Unpacking,       // making the file of an archive
};

// An error in four parts: subject, found, expected, remedy. All are in lower case, without a full stop and not empty;
// only the subject may be. what() is `<subject>: <found>, expected <expected>; <remedy>`.
class Error : public std::runtime_error {
public:
    // `subject`: the file or object that the error is about; `found`: the fault, with values; `expected`: what would be
    // right; `remedy`: what the user can do.
    Error(ErrorCode code, const std::string& subject, const std::string& found, const std::string& expected,
          const std::string& remedy);

    [[nodiscard]] ErrorCode code() const noexcept { return m_code; }
    [[nodiscard]] const std::string& subject() const noexcept { return m_subject; }
    [[nodiscard]] const std::string& found() const noexcept { return m_found; }
    [[nodiscard]] const std::string& expected() const noexcept { return m_expected; }
    [[nodiscard]] const std::string& remedy() const noexcept { return m_remedy; }

    // Settings that the remedy speaks of, the one that helps most first.
    [[nodiscard]] const std::vector<Setting>& settings() const noexcept { return m_settings; }
    Error&& with(std::vector<Setting> settings) &&
    {
        m_settings = std::move(settings);
        return std::move(*this);
    }

    [[nodiscard]] Error about(const std::string& subject) const; // copy of this error with another subject
    [[nodiscard]] std::string withoutSubject() const; // text of what() without the subject and the colon behind it

private:
    ErrorCode m_code;
    std::string m_subject, m_found, m_expected, m_remedy;
    std::vector<Setting> m_settings;
};

// Error(Internal) for a mistake in this program; its remedy asks the user to report it.
Error internalError(const std::string& subject, const std::string& found, const std::string& expected);

#if defined(__GNUC__)
__attribute__((format(printf, 1, 2)))
#endif
// Formats like printf, into a std::string (libstdc++ 12 has no std::format).
std::string
formatString(const char* format, ...);

} // namespace gsc
