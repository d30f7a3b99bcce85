// SPDX-License-Identifier: Apache-2.0
#include "runtime/image/oiio_image.h"

#include <gsc/error.h>
#include "runtime/module/load_module.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <iterator>
#include <memory>

namespace gsc {

namespace {

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

// Sets how the values of a file are kept. Returns the type in which they are given.
OIIO::TypeDesc setCoding(const std::string& kind, OIIO::ImageSpec& spec)
{
    if (kind == "exr") {
        spec.attribute("compression", "zip");
        // OpenImageIO would put the time in, and the same picture would not be the same bytes
        spec.attribute("DateTime", "1970:01:01 00:00:00");
        return OIIO::TypeDesc::FLOAT;
    }
    const std::string coding = kind == "webp" ? "webp" : "jpeg";
    spec.attribute("compression", formatString("%s:%d", coding.c_str(), kLossyQuality));
    spec.attribute("jpeg:subsampling", "4:4:4");
    return OIIO::TypeDesc::UINT8;
}

std::vector<unsigned char> encodeOiioImage(const std::string& path, const std::string& kind, const Image& image)
{
    constexpr uint32_t kMaxWebpSide = 16383;
    if (kind == "webp" && std::max(image.width, image.height) > kMaxWebpSide)
        throw Error(ErrorCode::Unsupported, path,
                    formatString("would be a WebP of %u x %u pixels", image.width, image.height),
                    formatString("%u each at most", kMaxWebpSide), "choose .png or .jpg");
    const std::unique_ptr<OIIO::ImageOutput> output = OIIO::ImageOutput::create(kind);
    if (!output)
        throw Error(ErrorCode::Unsupported, path,
                    formatString("OpenImageIO cannot write .%s (%s)", kind.c_str(), OIIO::geterror().c_str()), "it to",
                    "choose another kind of image, such as .png");
    OIIO::ImageSpec spec(int(image.width), int(image.height), 3);
    const OIIO::TypeDesc type = setCoding(kind, spec);
    spec.set_format(type);
    std::vector<uint8_t> bytes;
    if (type == OIIO::TypeDesc::UINT8)
        std::ranges::transform(image.pixels, std::back_inserter(bytes), wholeValue<uint8_t>);
    OIIO::Filesystem::IOVecOutput encoded;
    if (!output->set_ioproxy(&encoded) || !output->open(path, spec) ||
        !output->write_image(type, bytes.empty() ? static_cast<const void*>(image.pixels.data()) : bytes.data()) ||
        !output->close())
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
    if (spec.width < 1 || spec.height < 1 || spec.width > int(kMostImageSide) || spec.height > int(kMostImageSide) ||
        spec.depth > 1)
        throw Error(ErrorCode::InvalidFile, path, formatString("is %d x %d pixels", spec.width, spec.height),
                    formatString("1 to %u each", kMostImageSide), "pass another image");
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

constexpr OiioImageFunctions kFunctions{startNoOiioThreads, encodeOiioImage, readOiioImage};

} // namespace

} // namespace gsc

GSC_EXPORT_MODULE(gsc::kFunctions)
