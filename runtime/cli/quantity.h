// SPDX-License-Identifier: Apache-2.0
// Numbers with a unit, as the command line takes them.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace gsc {

// "8G", "512M", "1.5 GiB", "4096": bytes, K = 1024. Nothing if it is not such a number or does not fit.
std::optional<uint64_t> parseByteSize(std::string_view text);
// "18.5M", "20k", "1300000": a count, K = 1000. Nothing if it is not such a number, not whole, or does not fit.
std::optional<uint64_t> parseCount(std::string_view text);

struct ImageSize {
    uint32_t width = 0, height = 0; // 1 to 32768 pixels each
};
// "1920x1080". Nothing if it is no such size.
std::optional<ImageSize> parseImageSize(std::string_view text);

} // namespace gsc
