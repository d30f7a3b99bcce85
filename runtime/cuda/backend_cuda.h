// SPDX-License-Identifier: Apache-2.0
// The CUDA backend: every stage on one GPU. Nothing here names a CUDA header.
#pragma once

#include "format/error.h"
#include "runtime/backend.h"

namespace gsc {

struct CudaStatus {
    bool usable = false;
    ErrorCode code = ErrorCode::Ok; // Device: no device or driver; Unsupported: none this build has code for
    std::string text;               // usable: name, memory and driver of the device; otherwise what is wrong
};

// Looks at the first device. Starts the driver, which takes some tenths of a second.
CudaStatus cudaStatus();

// Throws Error as cudaStatus() says, or OutOfMemory.
std::unique_ptr<Backend> makeCudaBackend();

} // namespace gsc
