// SPDX-License-Identifier: Apache-2.0
#include "runtime/image/oiio_image.h"

#include <gsc/error.h>
#include "runtime/module/load_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <memory>

namespace gsc {

namespace {

constexpr int kMaxSide = 32768; // largest width and height of an image, pixels

template <typename T>
Image readAs(OIIO::ImageInput& input, const std::string& path, OIIO::TypeDesc type, float max)
{
    const OIIO::ImageSpec& spec = input.spec();
    Image image;
    image.width = uint32_t(spec.width);
    image.height = uint32_t(spec.height);
    std::vector<T> raw(size_t(image.width) * image.height * 3);
    if (!input.read_image(0, 0, 0, 3, type, raw.data()))
        throw Error(ErrorCode::InvalidFile, path, "cannot be decoded (" + input.geterror() + ")", "a whole image",
                    "copy or write it again");
    image.pixels.resize(raw.size());
    for (size_t i = 0; i < raw.size(); ++i)
        image.pixels[i] = float(raw[i]) / max;
    return image;
}

std::vector<unsigned char> encodeExr(const std::string& path, const Image& image)
{
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create("exr");
    if (!output)
        throw Error(ErrorCode::Unsupported, path, "OpenImageIO cannot write .exr (" + OIIO::geterror() + ")", "it to",
                    "choose another kind of image, such as .pfm");
    OIIO::ImageSpec spec(int(image.width), int(image.height), 3, OIIO::TypeDesc::FLOAT);
    spec.attribute("compression", "zip");
    // OpenImageIO would put the time in, and the same picture would not be the same bytes
    spec.attribute("DateTime", "1970:01:01 00:00:00");
    OIIO::Filesystem::IOVecOutput encoded;
    if (!output->set_ioproxy(&encoded) || !output->open(path, spec) ||
        !output->write_image(OIIO::TypeDesc::FLOAT, image.pixels.data()) || !output->close())
        throw internalError(path, "OpenImageIO cannot encode the image (" + output->geterror() + ")", "it to");
    return encoded.buffer();
}

Image readOiioImage(const std::string& path)
{
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1); // colours as stored
    const std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path, &config);
    if (!input)
        throw Error(ErrorCode::InvalidFile, path, "no image that can be read (" + OIIO::geterror() + ")",
                    "one that OpenImageIO knows", "check the path and the file");
    const OIIO::ImageSpec& spec = input->spec();
    if (spec.width < 1 || spec.height < 1 || spec.width > kMaxSide || spec.height > kMaxSide || spec.depth > 1)
        throw Error(ErrorCode::InvalidFile, path, formatString("is %d x %d pixels", spec.width, spec.height),
                    formatString("1 to %d each", kMaxSide), "pass another image");
    if (spec.nchannels < 3)
        throw Error(ErrorCode::Unsupported, path,
                    formatString("has %d channel%s", spec.nchannels, spec.nchannels == 1 ? "" : "s"),
                    "red, green and blue", "convert it to a colour image");
    // whole numbers are divided here, because OpenImageIO multiplies by a rounded reciprocal
    if (spec.format == OIIO::TypeDesc::UINT8)
        return readAs<uint8_t>(*input, path, OIIO::TypeDesc::UINT8, 255);
    if (spec.format == OIIO::TypeDesc::UINT16)
        return readAs<uint16_t>(*input, path, OIIO::TypeDesc::UINT16, 65535);
    return readAs<float>(*input, path, OIIO::TypeDesc::FLOAT, 1);
}

// Switches off the pool of threads of OpenEXR. OpenImageIO's own pool is switched off by the environment, because a
// call would start it.
void startNoOiioThreads()
{
    OIIO::attribute("exr_threads", -1);
}

constexpr OiioImageFunctions kFunctions{startNoOiioThreads, encodeExr, readOiioImage};

} // namespace

} // namespace gsc

GSC_EXPORT_MODULE(gsc::kFunctions)
