// SPDX-License-Identifier: Apache-2.0
// Parses numbers with a unit, as the command line takes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace gsc {

// Parses a number of bytes: "8G", "512M", "1.5 GiB", "4096"; K = 1024. Returns none if the text is not such a number
// or the number does not fit.
std::optional<uint64_t> parseByteSize(std::string_view text);
// Parses a count: "18.5M", "20k", "1300000"; K = 1000. Returns none if the text is not such a number, or the number is
// not whole or does not fit.
std::optional<uint64_t> parseCount(std::string_view text);

struct ImageSize {
    uint32_t width = 0, height = 0; // width and height, each 1 to 32768 pixels; height 0 = only the width was given
};
// Parses "1920x1080", a width such as "1280", or rows such as "1080p" (1920x1080). Returns none for any other text.
std::optional<ImageSize> parseImageSize(std::string_view text);

} // namespace gsc
