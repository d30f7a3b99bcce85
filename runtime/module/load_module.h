// SPDX-License-Identifier: Apache-2.0
// Modules: parts of the programs that are loaded when they are first used, because loading their libraries would slow
// down every start: OpenImageIO alone brings 250. Module and program are of one build, so functions of a module take
// and return our own types, and throw our Error. A module shares no state with the program: it must be told of an
// interrupt, for example.
#pragma once

#include <cstddef>

namespace gsc {

// Content of the symbol `gsc_module` that a module exports.
struct ModuleEntry {
    const char* version; // version of the program that the module belongs to
    const void* functions;
};

// Identifies the interface between a program and its modules. Raise the number with every change of data that passes
// between them; the compiler's version is part of it, too.
#define GSC_MODULE_VERSION GSC_VERSION ", interface 6, compiler " __VERSION__

// Exports a module's functions; stands in one source file of the module. `functions` is a struct of function pointers
// that program and module know.
#define GSC_EXPORT_MODULE(functions)                                                                                   \
    extern "C" __attribute__((visibility("default"))) const gsc::ModuleEntry gsc_module;                               \
    const gsc::ModuleEntry gsc_module = {GSC_MODULE_VERSION, &(functions)};

// Returns the functions of the module NAME.so, which then stays loaded. It is looked for beside the program, as in a
// bundle, and in ../lib/gsc from there, and nowhere else. Throws Error(Unsupported) if the module or one of its
// libraries is missing, or it is of another version. `threads` is the number of threads that its libraries start while
// loading. They end the process if they get fewer, so Error(OutOfMemory) is thrown first.
const void* moduleFunctions(const char* name, size_t threads);

template <class Functions>
const Functions& loadModule(const char* name, size_t threads = 0)
{
    return *static_cast<const Functions*>(moduleFunctions(name, threads));
}

} // namespace gsc
