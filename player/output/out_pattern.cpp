// SPDX-License-Identifier: Apache-2.0
#include "player/output/out_pattern.h"

#include <gsc/error.h>

#include <algorithm>
#include <unordered_map>

namespace gsc {

namespace {

// Returns the N of {frame:0N} or {frame:N}; -1 if the format is neither.
int digitsOf(std::string_view format)
{
    if (format.empty() || format.size() > 2 ||
        !std::all_of(format.begin(), format.end(), [](char c) { return c >= '0' && c <= '9'; }))
        return -1;
    int digits = 0;
    for (const char c : format)
        digits = 10 * digits + (c - '0');
    return digits <= 20 ? digits : -1;
}

} // namespace

std::string expandPattern(const std::string& pattern, std::string_view name, uint64_t frame, Eye eye)
{
    std::string path;
    for (size_t i = 0; i < pattern.size(); ++i) {
        const char c = pattern[i];
        if ((c == '{' || c == '}') && i + 1 < pattern.size() && pattern[i + 1] == c) {
            path += c;
            ++i;
            continue;
        }
        if (c == '}')
            throw Error(ErrorCode::Usage, "--out " + pattern, "} without {", "}} for a literal brace", "double it");
        if (c != '{') {
            path += c;
            continue;
        }
        const size_t end = pattern.find('}', i);
        if (end == std::string::npos)
            throw Error(ErrorCode::Usage, "--out " + pattern, "{ without }", "{{ for a literal brace",
                        "close it or double it");
        const std::string placeholder = pattern.substr(i + 1, end - i - 1);
        const int digits = placeholder == "frame"              ? 0
                           : placeholder.starts_with("frame:") ? digitsOf(placeholder.substr(6))
                                                               : -1;
        if (placeholder == "name")
            path += safeFileName(name);
        else if (placeholder == "eye")
            path += eye == Eye::Left ? "left" : eye == Eye::Right ? "right" : "mono";
        else if (digits >= 0)
            path += formatString("%0*llu", digits, static_cast<unsigned long long>(frame));
        else
            throw Error(ErrorCode::Usage, "--out " + pattern, "unknown placeholder {" + placeholder + "}",
                        "{name}, {frame}, {frame:04} or {eye}", "correct it");
        i = end;
    }
    return path;
}

std::string literalPattern(std::string_view text)
{
    std::string pattern;
    for (const char c : text)
        pattern.append(c == '{' || c == '}' ? 2 : 1, c);
    return pattern;
}

std::string safeFileName(std::string_view name)
{
    std::string safe(name);
    for (char& c : safe)
        if (c == '/' || c == '\\' || c == ':' || static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
            c = '_';
    if (safe.empty())
        return "_";
    if (safe[0] == '.') // no leading dot: the name must be neither hidden nor ".."
        safe[0] = '_';
    return safe;
}

std::vector<std::string> outputPaths(const std::string& pattern, const std::vector<OutputFrame>& frames, int eyes)
{
    std::vector<std::string> paths;
    std::unordered_map<std::string, const OutputFrame*> seen;
    for (const OutputFrame& frame : frames)
        for (int eye = 0; eye < eyes; ++eye) {
            const Eye which = eyes == 1 ? Eye::Mono : eye == 0 ? Eye::Left : Eye::Right;
            std::string path = expandPattern(pattern, frame.name, frame.frame, which);
            const auto [other, is_new] = seen.try_emplace(path, &frame);
            if (!is_new) {
                const bool same_frame = other->second == &frame;
                throw Error(ErrorCode::Usage, path,
                            formatString("frames %llu (%s) and %llu (%s) would both be written to it",
                                         static_cast<unsigned long long>(other->second->frame),
                                         other->second->name.c_str(), static_cast<unsigned long long>(frame.frame),
                                         frame.name.c_str()),
                            "one file each", formatString("add %s to --out", same_frame ? "{eye}" : "{frame}"));
            }
            paths.push_back(std::move(path));
        }
    return paths;
}

} // namespace gsc
