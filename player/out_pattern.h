// SPDX-License-Identifier: Apache-2.0
// File names of rendered images from a pattern: {name}, {frame}, {frame:04}, {eye}; {{ and }} are literal braces.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

enum class Eye { Mono, Left, Right }; // what {eye} becomes: mono, left, right

class OutPattern {
public:
    // Throws Error(Usage) for an unknown placeholder or an unpaired brace.
    explicit OutPattern(std::string_view pattern);

    [[nodiscard]] std::string expand(std::string_view name, uint64_t frame, Eye eye) const;
    [[nodiscard]] bool hasEye() const { return has(Kind::Eye); }
    [[nodiscard]] bool hasFrame() const { return has(Kind::Frame); }

private:
    enum class Kind { Text, Name, Frame, Eye };
    struct Part {
        Kind kind;
        std::string text; // of Kind::Text
        int digits = 0;   // of Kind::Frame: at least so many, zero-filled
    };

    [[nodiscard]] bool has(Kind kind) const;

    std::vector<Part> m_parts;
};

// A camera's name as part of a file name: separators and control characters become _, so does a leading dot; an
// empty name becomes _.
std::string safeFileName(std::string_view name);

struct OutputFrame {
    std::string name;
    uint64_t frame = 0; // index in the camera file
};

// One path per frame and eye, frame-major, left eye first. Throws Error(Usage) if two of them are the same file,
// naming the placeholder that is missing.
std::vector<std::string> outputPaths(const OutPattern& pattern, const std::vector<OutputFrame>& frames, int eyes);

} // namespace gsc
