// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_files.h"

#include "convert/export/sog/sog_images.h"
#include <gsc/error.h>

namespace gsc {

void requireSog()
{
    throw Error(ErrorCode::Unsupported, "sog", "this build lacks libwebp", "it",
                "install libwebp-dev and build again, or choose --to spz");
}

void writeGaussianSog(const GaussianSet&, const PieceSink&, int)
{
    requireSog();
}

SogMembers makeSogMembers(const GaussianSet&, std::span<const size_t>, size_t, int)
{
    requireSog();
    return {};
}

GaussianSet readSogMembers(const std::function<std::vector<std::byte>(const std::string&)>&, const std::string&)
{
    requireSog();
    return {};
}

GaussianSet readGaussianSog(std::span<const std::byte>, const std::string&)
{
    requireSog();
    return {};
}

} // namespace gsc
