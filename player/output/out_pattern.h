// SPDX-License-Identifier: Apache-2.0
// File names of rendered images from a pattern: {name}, {frame}, {frame:04}, {eye}; {{ and }} are literal braces.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

enum class Eye { Mono, Left, Right }; // {eye} becomes "mono", "left" or "right"

// Throws Error(Usage) for an unknown placeholder or an unpaired brace.
std::string expandPattern(const std::string& pattern, std::string_view name, uint64_t frame, Eye eye);

// A camera's name as part of a file name: separators and control characters become _, so does a leading dot; an
// empty name becomes _.
std::string safeFileName(std::string_view name);

struct OutputFrame {
    std::string name;
    uint64_t frame = 0; // index in the camera file
};

// One path per frame and eye, frame-major, left eye first. Throws Error(Usage) as expandPattern(), and if two of them are
// the same file, naming the placeholder that is missing.
std::vector<std::string> outputPaths(const std::string& pattern, const std::vector<OutputFrame>& frames, int eyes);

} // namespace gsc
