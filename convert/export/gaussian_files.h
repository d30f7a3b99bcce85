// SPDX-License-Identifier: Apache-2.0
// Writes and reads files of explicit Gaussians. The axes of a GaussianSet point right, down and forward.
//
//   ply   little-endian floats, as 3DGS' own code writes them; axes as in the set
//   spz   versions 3 (gzip) and 4 (Zstandard) of Niantic's format (github.com/nianticlabs/spz), with equal values;
//         axes point right, up and back, so y and z change their signs
//   glb   glTF 2.0 with KHR_gaussian_splatting as in its release candidate of February 2026 (sizes and opacities are
//         stored as they are; earlier drafts had logarithms of sizes); axes as in the set, and because y points up
//         in glTF, the node turns the Gaussians by 180 degrees about z
//   sog   version 2 of PlayCanvas' format (developer.playcanvas.com, "The SOG format"): a zip of lossless WebP images;
//         axes as in the set, Gaussians in Morton order
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

namespace gsc {

enum class GaussianFileFormat { Ply, Spz, Glb, Sog };

// Takes the pieces of a file in their order. May throw.
using PieceSink = std::function<void(std::span<const std::byte>)>;

// Precondition of all writing functions: there is at least one Gaussian.
void writeGaussianPly(const GaussianSet& set, const PieceSink& write);
// The two parts of such a PLY: the header, whose length does not depend on `count`, and the rows.
std::string gaussianPlyHeader(int degree, uint64_t count);
void writeGaussianPlyRows(const GaussianSet& set, const PieceSink& write);
// Writes a glb file. Throws Error(Unsupported) if the Gaussians take more than 4 GiB.
void writeGaussianGlb(const GaussianSet& set, const PieceSink& write);
// `version`: 3 or 4. Throws Error(Unsupported) if a coordinate is too large for 24 bits, if there are 2^31 Gaussians,
// and for version 4 if this build has no Zstandard; requireSpz4() throws that before any work is done.
void writeGaussianSpz(const GaussianSet& set, const PieceSink& write, int version);
void requireSpz4();
// Most Gaussians that Niantic's first reader took; readers that follow it take no more.
constexpr uint64_t kSpzReadersTake = 10'000'000;
// Throws Error(Unsupported) if an image gets too wide or the file too large, and if this build has no libwebp;
// requireSog() throws that before any work is done. The bytes do not depend on the number of threads.
void writeGaussianSog(const GaussianSet& set, const PieceSink& write, int threads);
void requireSog();

// Reads the Gaussians, rounded as they are stored and without scores, from an SPZ file of version 3 or 4. `name` is
// used in messages. Throws Error(InvalidFile).
GaussianSet readGaussianSpz(std::span<const std::byte> file, const std::string& name);
// Reads the Gaussians, rounded as they are stored and without scores, from a SOG file. `name` is used in messages.
// Throws Error(InvalidFile).
GaussianSet readGaussianSog(std::span<const std::byte> file, const std::string& name);

} // namespace gsc
