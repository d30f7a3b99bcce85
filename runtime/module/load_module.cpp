// SPDX-License-Identifier: Apache-2.0
#include "runtime/module/load_module.h"

#include <gsc/error.h>
#include "format/machine/threads.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <string_view>
#include <vector>

#include <dlfcn.h>
#include <sys/auxv.h>
#include <unistd.h>

namespace gsc {

namespace fs = std::filesystem;

namespace {

// Returns folders that the program may lie in, the most certain first. Without /proc (in a chroot or a sandbox) two
// names tell: the one by which the program was started, and the one that the loader has, which differs if the loader
// was called with the program as its argument.
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
    if (dladdr(reinterpret_cast<const void*>(&moduleFunctions), &info) != 0)
        add(info.dli_fname);
    std::vector<fs::path> folders;
    for (const fs::path& program : programs)
        if (const fs::path folder = program.parent_path();
            folder.is_absolute() && std::ranges::find(folders, folder) == folders.end())
            folders.push_back(folder);
    return folders;
}

std::string findModule(const std::string& file)
{
    std::string looked_in;
    for (const fs::path& folder : programFolders())
        for (const fs::path& place : {folder, folder.parent_path() / "lib/gsc"}) {
            std::error_code none;
            if (fs::exists(place / file, none))
                return (place / file).string();
            looked_in += (looked_in.empty() ? "" : " or in ") + place.string();
        }
    if (looked_in.empty())
        throw Error(ErrorCode::Unsupported, file, "not found, because nothing tells where the program lies",
                    "/proc to, or the path that it is started by", "start it by its whole path");
    throw Error(ErrorCode::Unsupported, file, "not found", "it in " + looked_in,
                "install gsc again, with all of its files");
}

// Returns true if the dynamic linker's message is about memory; it states the kind of a fault only in words.
bool isOfMemory(std::string_view why)
{
    return why.find("failed to map segment") != why.npos || why.find("cannot map zero-fill") != why.npos ||
           why.find("allocate memory") != why.npos || why.find("cannot create") != why.npos;
}

} // namespace

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

const void* moduleFunctions(const char* name, size_t threads)
{
    const std::string path = findModule(std::string(name) + ".so");
    if (threads > 0 && dlopen(path.c_str(), RTLD_LAZY | RTLD_NOLOAD) == nullptr)
        requireThreads(name, threads);
    // symbols are looked up when they are first used, because only few functions of 250 libraries are called
    void* const library = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (const char* const why = library ? "" : dlerror(); isOfMemory(why))
        throw Error(ErrorCode::OutOfMemory, path, formatString("cannot be loaded (%s)", why),
                    "memory for it and its libraries", "close other programs, or raise the limit of this process");
    else if (!library)
        throw Error(ErrorCode::Unsupported, path, formatString("cannot be loaded (%s)", why),
                    "it and its libraries to be whole and of this machine", "install gsc again, with what it needs");
    const auto* const entry = static_cast<const ModuleEntry*>(dlsym(library, "gsc_module"));
    const char* const version = entry ? entry->version : "none";
    if (std::strcmp(version, GSC_MODULE_VERSION) != 0)
        throw Error(ErrorCode::Unsupported, path, formatString("is of version %s", version),
                    formatString("the program's, %s", GSC_MODULE_VERSION), "install gsc again, with all of its files");
    return entry->functions;
}

} // namespace gsc
