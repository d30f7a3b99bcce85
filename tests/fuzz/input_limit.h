// SPDX-License-Identifier: Apache-2.0
// libFuzzer's own limit of 4 KiB keeps every .gsc file out, which has a page per section.
#pragma once

#include <algorithm>
#include <cstring>
#include <string>
#include <vector>

namespace gsc::test {

// -max_len where the command line has none. From LLVMFuzzerInitialize().
inline void limitInputs(int* argc, char*** argv, int bytes)
{
    static std::string limit = "-max_len=" + std::to_string(bytes);
    static std::vector<char*> arguments(*argv, *argv + *argc);
    const bool given =
        std::any_of(arguments.begin(), arguments.end(), [](const char* a) { return !std::strncmp(a, "-max_len=", 9); });
    if (!given)
        arguments.insert(arguments.begin() + 1, limit.data());
    *argc = int(arguments.size());
    arguments.push_back(nullptr);
    *argv = arguments.data();
}

} // namespace gsc::test
