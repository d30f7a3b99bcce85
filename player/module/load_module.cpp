// SPDX-License-Identifier: Apache-2.0
#include "player/module/load_module.h"

#include "format/error.h"

#include <cstring>
#include <filesystem>

#include <dlfcn.h>

namespace gsc {

namespace {

std::string findModule(const std::string& file)
{
    std::error_code none; // without /proc: an empty path
    const std::filesystem::path program = std::filesystem::read_symlink("/proc/self/exe", none);
    const std::filesystem::path folder = program.parent_path();
    if (folder.is_absolute())
        for (const auto& path : {folder / file, folder.parent_path() / "lib/gsc" / file})
            if (std::filesystem::exists(path, none))
                return path.string();
    throw Error(ErrorCode::Unsupported,
                formatString("%s: not found, expected it in %s or in %s; install gsc again, with all of its files",
                             file.c_str(), folder.c_str(), (folder.parent_path() / "lib/gsc").c_str()));
}

} // namespace

const void* moduleFunctions(const char* name)
{
    const std::string path = findModule(std::string(name) + ".so");
    // not all symbols at once: of 250 libraries few functions are called
    void* const library = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL);
    if (!library)
        throw Error(ErrorCode::Unsupported,
                    formatString("%s: cannot be loaded (%s), expected it and its libraries to be whole and of this "
                                 "machine; install gsc again, with what it needs",
                                 path.c_str(), dlerror()));
    const auto* const entry = static_cast<const ModuleEntry*>(dlsym(library, "gsc_module"));
    const char* const version = entry ? entry->version : "none";
    if (std::strcmp(version, GSC_MODULE_VERSION) != 0)
        throw Error(
            ErrorCode::Unsupported,
            formatString("%s: is of version %s, expected the program's, %s; install gsc again, with all of its files",
                         path.c_str(), version, GSC_MODULE_VERSION));
    return entry->functions;
}

} // namespace gsc
