// SPDX-License-Identifier: Apache-2.0
// Seeds for the input fuzz targets, made when a target starts, so that no binary files lie in the repository.
#pragma once

#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

namespace gsc::test {

// Writes `seeds` into the corpus folder on the command line, if it is empty; where no folder was given, into a new
// temporary one that is put on the command line. Call from LLVMFuzzerInitialize.
inline void addSeeds(int* argc, char*** argv, const std::vector<std::string>& seeds)
{
    namespace fs = std::filesystem;
    std::string folder;
    for (int i = 1; i < *argc; ++i) {
        if ((*argv)[i][0] == '-')
            continue;
        if (!fs::is_directory((*argv)[i]))
            return; // single inputs to be run again: nothing to seed
        folder = (*argv)[i];
        break;
    }
    if (folder.empty()) {
        std::string pattern = (fs::temp_directory_path() / "gsc_fuzz_XXXXXX").string();
        if (!::mkdtemp(pattern.data()))
            return;
        folder = pattern;
        static std::string owned; // both must outlive main
        static std::vector<char*> arguments;
        owned = folder;
        arguments.assign(*argv, *argv + *argc);
        arguments.push_back(owned.data());
        arguments.push_back(nullptr);
        *argv = arguments.data();
        ++*argc;
    }
    if (!fs::is_empty(folder))
        return;
    for (size_t i = 0; i < seeds.size(); ++i)
        std::ofstream(fs::path(folder) / ("seed_" + std::to_string(i)), std::ios::binary) << seeds[i];
}

} // namespace gsc::test
