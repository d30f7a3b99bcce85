// SPDX-License-Identifier: Apache-2.0
// Makes file names of rendered images from a pattern with {name}, {frame}, {frame:04} and {eye}; {{ and }} are literal
// braces.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

enum class Eye { Mono, Left, Right }; // written as "mono", "left" or "right" for {eye}

// Replaces the placeholders of a pattern. Throws Error(Usage) for an unknown placeholder or an unpaired brace.
std::string expandPattern(const std::string& pattern, std::string_view name, uint64_t frame, Eye eye);

// Returns a pattern that stands for `text` itself, with its braces doubled.
std::string literalPattern(std::string_view text);

// Makes a camera's name fit for a file name: separators, control characters and a leading dot become _, and so does an
// empty name.
std::string safeFileName(std::string_view name);

struct OutputFrame {
    std::string name;
    uint64_t frame = 0; // index of the camera in the camera file
};

// Returns one path for each frame and eye: frame by frame, left eye first. Throws Error(Usage) as expandPattern()
// does, and if two paths are equal, naming the placeholder that the pattern lacks.
std::vector<std::string> outputPaths(const std::string& pattern, const std::vector<OutputFrame>& frames, int eyes);

} // namespace gsc
