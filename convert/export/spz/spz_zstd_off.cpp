// SPDX-License-Identifier: Apache-2.0
#include "convert/export/spz/spz_container.h"

#include <gsc/error.h>

namespace gsc {

void requireSpz4()
{
    throw Error(ErrorCode::Unsupported, "spz", "this build lacks Zstandard", "it for version 4",
                "install libzstd-dev and build again, or choose --spz-version 3");
}

void writeSpz4(const SpzHeader&, const SpzPacker&, const PieceSink&)
{
    requireSpz4();
}

SpzContent readSpz4(std::span<const std::byte>, const std::string&)
{
    requireSpz4();
    return {};
}

} // namespace gsc
