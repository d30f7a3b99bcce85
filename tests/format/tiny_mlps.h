// SPDX-License-Identifier: Apache-2.0
// The weight sections of a tiny file. Every weight is a multiple of 1/64 in [-1, 1], so that its half is exact.
#pragma once

#include "tests/format/tiny_gsc.h"

#include <random>

namespace gsc::test {

struct TinyMlps {
    std::vector<std::byte> canonical; // MLPW
    std::vector<std::byte> packed;    // MLPP
};

TinyMlps tinyMlps(const TinyGscOptions& options, std::mt19937_64& random);

} // namespace gsc::test
