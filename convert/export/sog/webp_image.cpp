// SPDX-License-Identifier: Apache-2.0
#include "convert/export/sog/webp_image.h"

#include <gsc/error.h>
#include <gsc/interrupt.h>

#include <webp/decode.h>
#include <webp/encode.h>

#include <memory>

namespace gsc {

namespace {

// libwebp's effort, 0 to 9; higher takes twice the time to save 1 % of the bytes
constexpr int kEffort = 6;

} // namespace

ByteImage::ByteImage(uint32_t width_, uint32_t height_)
    : width(width_), height(height_), rgba(size_t(4) * width_ * height_)
{
    for (size_t i = 3; i < rgba.size(); i += 4)
        rgba[i] = 255;
}

std::vector<std::byte> encodeWebp(const ByteImage& image)
{
    WebPConfig config;
    WebPPicture picture;
    WebPMemoryWriter writer;
    WebPMemoryWriterInit(&writer);
    const std::unique_ptr<WebPMemoryWriter, void (*)(WebPMemoryWriter*)> free_writer(&writer, WebPMemoryWriterClear);
    bool good = WebPConfigInit(&config) != 0 && WebPConfigLosslessPreset(&config, kEffort) != 0 &&
                WebPPictureInit(&picture) != 0;
    if (!good) // fails if the library has another major version than its header
        throw Error(ErrorCode::Unsupported, "libwebp", "another version than this program was built with", "the same",
                    "build it again");
    const std::unique_ptr<WebPPicture, void (*)(WebPPicture*)> free_picture(&picture, WebPPictureFree);
    config.exact = 1; // keeps the colours of transparent pixels
    picture.use_argb = 1;
    picture.width = int(image.width);
    picture.height = int(image.height);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
    picture.progress_hook = [](int, const WebPPicture*) { return interrupted() ? 0 : 1; };
    good = WebPPictureImportRGBA(&picture, image.rgba.data(), int(4 * image.width)) != 0 &&
           WebPEncode(&config, &picture) != 0;
    throwIfInterrupted();
    if (!good)
        throw Error(ErrorCode::OutOfMemory, formatString("WebP image of %u x %u", image.width, image.height),
                    formatString("not written (libwebp's error %d)", int(picture.error_code)), "memory for it",
                    "close other programs, or choose --max-gaussians");
    const auto* first = reinterpret_cast<const std::byte*>(writer.mem);
    return {first, first + writer.size};
}

ByteImage decodeWebp(std::span<const std::byte> file, const std::string& name)
{
    const auto* bytes = reinterpret_cast<const uint8_t*>(file.data());
    int width = 0, height = 0;
    ByteImage image;
    if (WebPGetInfo(bytes, file.size(), &width, &height) != 0) {
        image = ByteImage(uint32_t(width), uint32_t(height));
        if (WebPDecodeRGBAInto(bytes, file.size(), image.rgba.data(), image.rgba.size(), 4 * width) != nullptr)
            return image;
    }
    throw Error(ErrorCode::InvalidFile, name, "no WebP image", "one", "export it again");
}

} // namespace gsc
