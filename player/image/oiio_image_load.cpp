// SPDX-License-Identifier: Apache-2.0
#include "player/image/oiio_image.h"
#include "player/module/load_module.h"

namespace gsc {

namespace {

const OiioImageFunctions& oiioModule()
{
    return loadModule<OiioImageFunctions>("gsc_image_oiio");
}

} // namespace

std::vector<std::string> oiioExtensions()
{
    return {".png", ".exr"};
}

void loadOiio()
{
    (void)oiioModule();
}

std::vector<unsigned char> encodeOiioImage(const std::string& path, const std::string& extension, const Image& image,
                                           PixelDepth depth)
{
    return oiioModule().encode(path, extension, image, depth);
}

Image readOiioImage(const std::string& path)
{
    return oiioModule().read(path);
}

} // namespace gsc
