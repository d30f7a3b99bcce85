// SPDX-License-Identifier: Apache-2.0
#include "player/image/oiio_image.h"

#include "format/error.h"

namespace gsc {

std::vector<std::string> oiioExtensions()
{
    return {};
}

void loadOiio() {} // every extension but .pfm is refused before

std::vector<unsigned char> encodeOiioImage(const std::string& path, const std::string& extension, const Image&,
                                           PixelDepth)
{
    throw Error(ErrorCode::Unsupported,
                formatString("%s: this build cannot write %s, expected .pfm; use a build with GSC_WITH_OIIO",
                             path.c_str(), extension.c_str()));
}

Image readOiioImage(const std::string& path)
{
    throw Error(ErrorCode::Unsupported,
                path + ": this build cannot read this kind of image, expected .pfm; use a build with GSC_WITH_OIIO");
}

} // namespace gsc
