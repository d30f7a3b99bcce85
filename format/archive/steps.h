// SPDX-License-Identifier: Apache-2.0
// Codec Steps (archive_layout.h): floats that are small multiples of powers of two.
#pragma once

#include "format/archive/codec.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Appends records of `columns` floats, of which `span` share a step. `masks`: three together may be kMaskedOffset. False,
// with `out` as it was, where a value has no such form or takes more than kMostStepPlanes bytes. Precondition: `span`
// divides `columns`, and with `masks` three does; `raw` is whole records.
bool encodeSteps(std::span<const std::byte> raw, uint32_t columns, uint32_t span, bool masks, Coder& coder,
                 std::vector<std::byte>& out);

// Returns false if `stored` is no result of encodeSteps() for as many bytes as `out` has. Takes memory in proportion to
// `out`.
bool decodeSteps(std::span<const std::byte> stored, uint32_t columns, Coder& coder, std::span<std::byte> out);

} // namespace gsc
