// SPDX-License-Identifier: Apache-2.0
// Container of an SPZ file, around the six streams of bytes that hold its values.
//
//   version 3   one gzip frame: a header of 16 bytes, then the streams
//   version 4   a header of 32 bytes as it is, then two 64-bit numbers per stream (its bytes in the file and unpacked), then
//               one Zstandard frame per stream; a stream without bytes is left out of both
#pragma once

#include "convert/export/gaussian_files.h"

#include <array>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <vector>

namespace gsc {

constexpr size_t kSpzStreams = 6; // positions, opacities, colours, sizes, orientations, harmonics
constexpr uint32_t kSpzMagic = 0x5053474e;

struct SpzHeader {
    uint32_t count = 0;               // Gaussians
    uint8_t degree = 0, fraction = 0; // degree of colours; bits behind the binary point of positions
};

std::array<uint64_t, kSpzStreams> spzStreamBytes(const SpzHeader& header);

using ByteSink = std::function<void(std::span<const uint8_t>)>;
// Gives the bytes of one of the streams in pieces.
using SpzPacker = std::function<void(size_t stream, const ByteSink& add)>;

// Throw Error(OutOfMemory); of version 4 also Error(Unsupported) where this build has no Zstandard.
void writeSpz3(const SpzHeader& header, const SpzPacker& pack, const PieceSink& write);
void writeSpz4(const SpzHeader& header, const SpzPacker& pack, const PieceSink& write);

struct SpzContent {
    SpzHeader header;
    std::vector<uint8_t> bytes; // the streams, one after the other, as long as the header says
};

// `name` is used in messages. Throw Error(InvalidFile), and as above.
SpzContent readSpz3(std::span<const std::byte> file, const std::string& name);
SpzContent readSpz4(std::span<const std::byte> file, const std::string& name);

} // namespace gsc
