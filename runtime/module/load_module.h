// SPDX-License-Identifier: Apache-2.0
// Modules: parts of the programs that are loaded when they are first used, because every start would pay for the
// libraries behind them: OpenImageIO alone brings 250. A module is of one build with the program, so its functions take
// and return our own types, and an Error passes. It has no state of ours: an interrupt, for example, it must be told of.
#pragma once

#include <cstddef>

namespace gsc {

// Symbol `gsc_module` that a module exports.
struct ModuleEntry {
    const char* version; // version of the program it belongs to
    const void* functions;
};

// Raised with every change of the data that passes between a program and its modules; with the compiler it tells builds
// of one version apart.
#define GSC_MODULE_VERSION GSC_VERSION ", interface 5, compiler " __VERSION__

// In one source of the module; `functions` is a struct of function pointers that both sides know.
#define GSC_EXPORT_MODULE(functions)                                                                                   \
    extern "C" __attribute__((visibility("default"))) const gsc::ModuleEntry gsc_module;                               \
    const gsc::ModuleEntry gsc_module = {GSC_MODULE_VERSION, &(functions)};

// The functions of NAME.so, which stays loaded. It lies beside the program, as in a bundle, or in ../lib/gsc from there;
// no other folder is looked at. Throws Error(Unsupported): it or one of its libraries is missing, or it is of another
// version. `threads` is how many the libraries behind it start when they are loaded: they end the process where they get
// fewer, so that Error(OutOfMemory) is thrown before.
const void* moduleFunctions(const char* name, size_t threads);

template <class Functions>
const Functions& loadModule(const char* name, size_t threads = 0)
{
    return *static_cast<const Functions*>(moduleFunctions(name, threads));
}

} // namespace gsc
