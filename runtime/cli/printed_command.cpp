// SPDX-License-Identifier: Apache-2.0
#include "runtime/cli/printed_command.h"

#include <algorithm>
#include <string_view>

namespace gsc {

std::string shellWord(const std::string& word)
{
    constexpr std::string_view kPlain = "%+,-./:=@_";
    const auto is_plain = [&](char c) {
        return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || (c & 0x80) != 0 ||
               kPlain.find(c) != std::string_view::npos;
    };
    if (!word.empty() && std::ranges::all_of(word, is_plain))
        return word;
    std::string quoted = "'";
    for (const char c : word)
        quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
    return quoted + "'";
}

std::string convertAdvice(const std::string& text)
{
    for (const char* option : {"--scene-dir", "--iteration", "--dist2level", "--add-level", "--fork", "--drop-invalid",
                               "--memory-budget", "--chunk-anchors"})
        if (text.find(option) != std::string::npos)
            return text + " (to gsc convert)";
    return text;
}

} // namespace gsc
