// SPDX-License-Identifier: Apache-2.0
// Puts files into the program: GSC_ASSET(name, file) defines std::string_view gsc::name() with the bytes of the file.
// CMake must set GSC_ASSET_FOLDER for the source file that uses it, and OBJECT_DEPENDS, so that it is compiled again
// when the file changes.
#pragma once

#include <string_view>

// The assembler copies the file unchanged, so no source has to be generated and no literal can be too long.
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
