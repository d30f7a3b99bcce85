// SPDX-License-Identifier: Apache-2.0
// Files of explicit Gaussians.
//
//   ply   what 3DGS' own code writes, little-endian floats; axes as they are
//   spz   versions 3 (gzip) and 4 (Zstandard) of Niantic's format (github.com/nianticlabs/spz), the same values in both;
//         right, up, back: y and z change their signs
//   glb   glTF 2.0 with KHR_gaussian_splatting as its release candidate of February 2026 has it (sizes and opacities as
//         they are, drafts before took logarithms of sizes); y is up there, so its node turns the Gaussians about z by
//         180 degrees
//   sog   version 2 of PlayCanvas' format (developer.playcanvas.com, "The SOG format"), a zip of lossless WebP images;
//         axes as they are, Gaussians in Morton order
#pragma once

#include "convert/export/gaussian_set.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>

namespace gsc {

enum class GaussianFileFormat { Ply, Spz, Glb, Sog };

// Takes pieces of a file in their order. May throw.
using PieceSink = std::function<void(std::span<const std::byte>)>;

// Precondition of all: there is a Gaussian.
void writeGaussianPly(const GaussianSet& set, const PieceSink& write);
// Parts of that PLY: the header, whose length does not depend on the number of Gaussians, and the rows.
std::string gaussianPlyHeader(int degree, uint64_t count);
void writeGaussianPlyRows(const GaussianSet& set, const PieceSink& write);
// Throws Error(Unsupported) if the Gaussians take more than 4 GiB.
void writeGaussianGlb(const GaussianSet& set, const PieceSink& write);
// `version`: 3 or 4. Throws Error(Unsupported) where a place lies further from the origin than 24 bits say, for 2^31
// Gaussians, and for version 4 where this build has no Zstandard; requireSpz4() tells before any work.
void writeGaussianSpz(const GaussianSet& set, const PieceSink& write, int version);
void requireSpz4();
// Niantic's own reader took no more Gaussians, and readers made after it still do not.
constexpr uint64_t kSpzReadersTake = 10'000'000;
// Throws Error(Unsupported) where a side of an image or the file grows too large, and where this build has no libwebp;
// requireSog() tells before any work. The bytes do not depend on the number of threads.
void writeGaussianSog(const GaussianSet& set, const PieceSink& write, int threads);
void requireSog();

// Gaussians as a viewer reads them from an SPZ file of either version, without their scores. `name` is used in
// messages. Throws Error(InvalidFile).
GaussianSet readGaussianSpz(std::span<const std::byte> file, const std::string& name);
// Gaussians as a viewer reads them from a SOG file, without their scores. `name` and errors as above.
GaussianSet readGaussianSog(std::span<const std::byte> file, const std::string& name);

} // namespace gsc
