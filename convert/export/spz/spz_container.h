// SPDX-License-Identifier: Apache-2.0
// Container of an SPZ file. It holds the values of the Gaussians as six streams of bytes.
//
//   version 3   one gzip frame: a header of 16 bytes, then the streams
//   version 4   an uncompressed header of 32 bytes, then for each stream two 64-bit numbers (its bytes in the file and
//               unpacked), then one Zstandard frame for each stream; an empty stream has neither numbers nor frame
#pragma once

#include "convert/export/gaussian_files.h"

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

constexpr size_t kSpzStreams = 6; // in this order: positions, opacities, colours, sizes, orientations, harmonics
constexpr uint32_t kSpzMagic = 0x5053474e;

struct SpzHeader {
    uint32_t count = 0; // number of Gaussians
    // degree of the colours' harmonics; bits behind the binary point of the positions
    uint8_t degree = 0, fraction = 0;
};

std::array<uint64_t, kSpzStreams> spzStreamBytes(const SpzHeader& header);

using ByteSink = std::function<void(std::span<const uint8_t>)>;
// Passes the bytes of stream number `stream` to `add`, piece by piece.
using SpzPacker = std::function<void(size_t stream, const ByteSink& add)>;

// Write a file of version 3 or 4. Both throw Error(OutOfMemory); writeSpz4() also Error(Unsupported) if this build has
// no Zstandard.
void writeSpz3(const SpzHeader& header, const SpzPacker& pack, const PieceSink& write);
void writeSpz4(const SpzHeader& header, const SpzPacker& pack, const PieceSink& write);

struct SpzContent {
    SpzHeader header;
    std::vector<uint8_t> bytes; // the streams, one after the other; their lengths follow from the header
};

// Read a file of version 3 or 4. `name` is used in messages. Both throw Error(InvalidFile, OutOfMemory); readSpz4()
// also Error(Unsupported) if this build has no Zstandard.
SpzContent readSpz3(std::span<const std::byte> file, const std::string& name);
SpzContent readSpz4(std::span<const std::byte> file, const std::string& name);

} // namespace gsc
