// SPDX-License-Identifier: Apache-2.0
// Codec Steps (archive_layout.h), for floats that are small whole multiples of a power of two.
#pragma once

#include "format/archive/codec.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

namespace gsc {

// Appends the encoded records to `out`: `columns` floats each, of which every `span` neighbours share a step. `masks`:
// three neighbours may all be kMaskedOffset. Returns false and leaves `out` as it was if a value is no multiple of a
// step, or takes more than kMostStepPlanes bytes. Precondition: `span` divides `columns`, and so does 3 with `masks`;
// `raw` is whole records.
bool encodeSteps(std::span<const std::byte> raw, uint32_t columns, uint32_t span, bool masks, Coder& coder,
                 std::vector<std::byte>& out);

// Decodes `stored` into `out`. Returns false if `stored` is no result of encodeSteps() for as many bytes as `out` has.
// Takes memory in proportion to `out`.
bool decodeSteps(std::span<const std::byte> stored, uint32_t columns, Coder& coder, std::span<std::byte> out);

} // namespace gsc
