// SPDX-License-Identifier: Apache-2.0
#include "runtime/module/find_program.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <string_view>

#include <dlfcn.h>
#include <sys/auxv.h>
#include <unistd.h>

namespace gsc {

namespace fs = std::filesystem;

// note: without /proc (in a chroot or a sandbox) two names tell: the one by which the program was started, and the one
// that the loader has, which differs if the loader was called with the program as its argument.
std::vector<fs::path> programFolders()
{
    std::error_code none;
    std::vector<fs::path> programs = {fs::read_symlink("/proc/self/exe", none)};
    const auto add = [&](const char* name) {
        // a name without a folder was found through PATH; here it would mean a file of the current folder
        if (name != nullptr && std::strchr(name, '/') != nullptr)
            programs.push_back(fs::canonical(name, none)); // canonical() returns an empty path if there is no such file
    };
    add(reinterpret_cast<const char*>(::getauxval(AT_EXECFN)));
    Dl_info info{};
    if (dladdr(reinterpret_cast<const void*>(&programFolders), &info) != 0)
        add(info.dli_fname);
    std::vector<fs::path> folders;
    for (const fs::path& program : programs)
        if (const fs::path folder = program.parent_path();
            folder.is_absolute() && std::ranges::find(folders, folder) == folders.end())
            folders.push_back(folder);
    return folders;
}

std::string programInPath(const std::string& name)
{
    const char* const path = std::getenv("PATH");
    std::string_view rest = path != nullptr ? path : "/usr/local/bin:/usr/bin:/bin";
    while (!rest.empty()) {
        const size_t colon = rest.find(':');
        const std::string folder(rest.substr(0, colon)), program = folder + "/" + name;
        if (!folder.empty() && ::access(program.c_str(), X_OK) == 0)
            return program;
        rest = colon == std::string_view::npos ? std::string_view() : rest.substr(colon + 1);
    }
    return {};
}

std::string ownProgram(const std::string& name)
{
    for (const fs::path& folder : programFolders())
        for (const fs::path& program : {folder / name, folder.parent_path() / "bin" / name})
            if (::access(program.c_str(), X_OK) == 0 && !fs::is_directory(program))
                return program.string();
    return programInPath(name);
}

} // namespace gsc
