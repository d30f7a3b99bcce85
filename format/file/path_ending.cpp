// SPDX-License-Identifier: Apache-2.0
#include "format/file/path_ending.h"

#include <algorithm>
#include <filesystem>

namespace gsc {

std::string endingOf(const std::string& path)
{
    std::string ending = std::filesystem::path(path).extension().string();
    std::ranges::transform(ending, ending.begin(), [](char c) { return c >= 'A' && c <= 'Z' ? char(c + 32) : c; });
    return ending;
}

} // namespace gsc
