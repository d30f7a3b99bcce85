// SPDX-License-Identifier: Apache-2.0
// Is the build one for AddressSanitizer? Then GSC_POISONS is defined.
#pragma once

#if defined(__SANITIZE_ADDRESS__)
#define GSC_POISONS
#elif defined(__has_feature)
#if __has_feature(address_sanitizer)
#define GSC_POISONS
#endif
#endif

#ifdef GSC_POISONS
#include <sanitizer/asan_interface.h>
#include <sanitizer/common_interface_defs.h>
#else
#define ASAN_POISON_MEMORY_REGION(at, bytes) (void)0
#define ASAN_UNPOISON_MEMORY_REGION(at, bytes) (void)0
#endif
