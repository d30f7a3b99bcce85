// SPDX-License-Identifier: Apache-2.0
// The error that something ends with.
#pragma once

#include <gsc/error.h>

#include <functional>
#include <string>

namespace gsc::test {

// Code and message of an Error; Ok and "" where none was thrown.
struct Outcome {
    ErrorCode code = ErrorCode::Ok;
    std::string message;
    [[nodiscard]] bool says(const std::string& text) const { return message.find(text) != std::string::npos; }
};

inline Outcome outcomeOf(const std::function<void()>& action)
{
    try {
        action();
    } catch (const Error& error) {
        return {error.code(), error.what()};
    }
    return {};
}

} // namespace gsc::test
