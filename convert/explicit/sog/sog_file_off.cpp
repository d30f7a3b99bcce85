// SPDX-License-Identifier: Apache-2.0
#include "convert/explicit/gaussian_files.h"

#include "format/error.h"

namespace gsc {

void requireSog()
{
    throw Error(ErrorCode::Unsupported,
                "sog: this build lacks libwebp, expected it; install libwebp-dev and build again, or choose --to spz");
}

void writeGaussianSog(const GaussianSet&, const PieceSink&, int)
{
    requireSog();
}

GaussianSet readGaussianSog(std::span<const std::byte>, const std::string&)
{
    requireSog();
    return {};
}

} // namespace gsc
