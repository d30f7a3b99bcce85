// SPDX-License-Identifier: Apache-2.0
// Files that lie in the program: GSC_ASSET(name, file) defines std::string_view gsc::name(), the bytes of the file. Its
// source is compiled with GSC_ASSET_FOLDER, and again when the file changes (OBJECT_DEPENDS).
#pragma once

#include <string_view>

// The assembler copies the file as it is: no generated source, no limit on the length of a literal.
#define GSC_ASSET(name, file)                                                                                          \
    __asm__(".pushsection .rodata\n"                                                                                   \
            ".global gsc_asset_" #name "\n.hidden gsc_asset_" #name "\n"                                               \
            ".global gsc_asset_" #name "_end\n.hidden gsc_asset_" #name "_end\n"                                       \
            "gsc_asset_" #name ":\n.incbin \"" GSC_ASSET_FOLDER "/" file "\"\n"                                        \
            "gsc_asset_" #name "_end:\n.byte 0\n"                                                                      \
            ".popsection\n");                                                                                          \
    extern "C" __attribute__((visibility("hidden"))) const char gsc_asset_##name[];                                    \
    extern "C" __attribute__((visibility("hidden"))) const char gsc_asset_##name##_end[];                              \
    std::string_view gsc::name()                                                                                       \
    {                                                                                                                  \
        return {gsc_asset_##name, gsc_asset_##name##_end};                                                             \
    }                                                                                                                  \
    static_assert(true)
