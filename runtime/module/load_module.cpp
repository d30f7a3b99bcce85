// SPDX-License-Identifier: Apache-2.0
#include "runtime/module/load_module.h"

#include <gsc/error.h>
#include "format/machine/threads.h"
#include "runtime/module/find_program.h"

#include <cstring>
#include <filesystem>
#include <string_view>
#include <vector>

#include <dlfcn.h>

namespace gsc {

namespace fs = std::filesystem;

namespace {

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
