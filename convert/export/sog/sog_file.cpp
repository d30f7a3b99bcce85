// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_files.h"

#include "convert/export/sog/codebook.h"
#include "convert/export/sog/sog_images.h"
#include "convert/export/sog/webp_image.h"
#include "convert/export/sog/zip_bundle.h"
#include "convert/input/torch/zip_archive.h"
#include <gsc/error.h>
#include "format/numbers/morton.h"
#include "kernels/threads/parallel.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>

namespace gsc {

namespace {

using Json = nlohmann::ordered_json;

// centres in a row of their image; most centres, since their numbers have 16 bits
constexpr size_t kPaletteRow = 64, kMostPalette = 65536;
constexpr float kSteps = 65535;
// alpha is 252 + n if component n of the rotation is the largest, which is not stored
constexpr uint8_t kLargest = 252;

// Logarithm of a coordinate, with its sign, as SOG stores it: finer near the origin.
double packed(double place)
{
    return std::copysign(std::log1p(std::abs(place)), place);
}

double unpacked(double place)
{
    return std::copysign(std::expm1(std::abs(place)), place);
}

uint8_t byteOf(float part)
{
    return uint8_t(std::lround(255 * std::clamp(part, 0.0f, 1.0f)));
}

// For each component of w x y z that can be the largest, and so is not stored: the three that are stored.
constexpr size_t kOthers[4][3] = {{1, 2, 3}, {0, 2, 3}, {0, 1, 3}, {0, 1, 2}};

void packRotation(const float* q, uint8_t* pixel)
{
    size_t largest = 0;
    for (size_t i = 1; i < 4; ++i)
        if (std::abs(q[i]) > std::abs(q[largest]))
            largest = i;
    const float sign = q[largest] < 0 ? -1.0f : 1.0f;
    for (size_t i = 0; i < 3; ++i)
        pixel[i] = byteOf((sign * q[kOthers[largest][i]] * float(M_SQRT2) + 1) / 2);
    pixel[3] = uint8_t(kLargest + largest);
}

void unpackRotation(const uint8_t* pixel, float* q)
{
    const size_t largest = size_t(pixel[3] - kLargest) & 3;
    float rest = 1;
    for (size_t i = 0; i < 3; ++i) {
        const float value = (2 * float(pixel[i]) / 255 - 1) * float(M_SQRT1_2);
        q[kOthers[largest][i]] = value;
        rest -= value * value;
    }
    q[largest] = std::sqrt(std::max(rest, 0.0f));
}

// Positions as 16-bit steps between the least and the largest logarithm on each axis.
struct Places {
    float least[3], most[3];
    std::vector<uint16_t> steps; // n x 3 values

    explicit Places(const GaussianSet& set) : steps(set.position.size())
    {
        for (size_t c = 0; c < 3; ++c) {
            double low = packed(set.position[c]), high = low;
            for (size_t i = c; i < set.position.size(); i += 3) {
                low = std::min(low, packed(set.position[i]));
                high = std::max(high, packed(set.position[i]));
            }
            least[c] = float(low);
            most[c] = float(high);
            const double width = double(most[c]) - double(least[c]);
            for (size_t i = c; i < set.position.size(); i += 3)
                steps[i] =
                    width > 0
                        ? uint16_t(std::lround(std::clamp((packed(set.position[i]) - least[c]) / width, 0.0, 1.0) *
                                               double(kSteps)))
                        : uint16_t(0);
        }
    }
};

std::vector<uint32_t> mortonOrder(const Places& places, std::span<const size_t> ends)
{
    const uint16_t* steps = places.steps.data();
    std::vector<std::pair<uint64_t, uint32_t>> keys(places.steps.size() / 3);
    for (size_t i = 0; i < keys.size(); ++i)
        keys[i] = {mortonEncode(steps[3 * i], steps[3 * i + 1], steps[3 * i + 2]), uint32_t(i)};
    std::ptrdiff_t first = 0;
    for (const size_t end : ends) {
        std::sort(keys.begin() + first, keys.begin() + std::ptrdiff_t(end));
        first = std::ptrdiff_t(end);
    }
    std::vector<uint32_t> order(keys.size());
    std::ranges::transform(keys, order.begin(), [](const auto& key) { return key.second; });
    return order;
}

// Makes the images of a SOG, and the values in its meta.json.
class SogWriter {
public:
    SogWriter(const GaussianSet& set, std::span<const size_t> ends)
        : m_set(set), m_places(set), m_order(mortonOrder(m_places, ends))
    {
        // makes the image nearly square, with a width that is a multiple of 4
        m_width = uint32_t(std::ceil(std::sqrt(double(set.size())) / 4) * 4);
        m_height = uint32_t((set.size() + m_width - 1) / m_width);
        if (m_width > kMostWebpPixels)
            throw Error(ErrorCode::Unsupported, "sog", formatString("%zu Gaussians", set.size()),
                        formatString("at most %u squared", kMostWebpPixels), "choose --max-gaussians");
    }

    SogMembers make(size_t most_palette, int threads)
    {
        m_meta = {{"version", 2}, {"asset", {{"generator", "gsc"}}}, {"count", m_set.size()}};
        addPlaces();
        addSizes();
        addRotations();
        addColors();
        if (m_set.degree > 0)
            addHarmonics(most_palette);
        SogMembers members(m_images.size() + 1);
        const std::string meta = m_meta.dump();
        const auto bytes = std::as_bytes(std::span(meta));
        members[0] = {"meta.json", {bytes.begin(), bytes.end()}};
        Workers(threads).run(m_images.size(), 1, [&](size_t first, size_t end, int) {
            for (size_t i = first; i < end; ++i) {
                members[i + 1] = {m_images[i].first, encodeWebp(m_images[i].second)};
                m_images[i].second = {};
            }
        });
        return members;
    }

private:
    // Adds an image with a pixel for each Gaussian, in the order of the file. `fill` writes the pixel of a Gaussian.
    template <typename Fill>
    void addImage(const std::string& name, const Fill& fill)
    {
        ByteImage image(m_width, m_height);
        for (size_t i = 0; i < m_order.size(); ++i)
            fill(size_t(m_order[i]), image.pixel(i));
        m_images.emplace_back(name, std::move(image));
    }

    void addPlaces()
    {
        for (const int shift : {0, 8})
            addImage(shift == 0 ? "means_l.webp" : "means_u.webp", [&](size_t g, uint8_t* pixel) {
                for (size_t c = 0; c < 3; ++c)
                    pixel[c] = uint8_t(m_places.steps[3 * g + c] >> shift);
            });
        m_meta["means"] = {
            {"mins", m_places.least}, {"maxs", m_places.most}, {"files", {"means_l.webp", "means_u.webp"}}};
    }

    void addSizes()
    {
        const Codebook book = makeCodebook(m_set.log_scale);
        addImage("scales.webp", [&](size_t g, uint8_t* pixel) {
            for (size_t c = 0; c < 3; ++c)
                pixel[c] = book.nearest(m_set.log_scale[3 * g + c]);
        });
        m_meta["scales"] = {{"codebook", book.values}, {"files", {"scales.webp"}}};
    }

    void addRotations()
    {
        addImage("quats.webp", [&](size_t g, uint8_t* pixel) { packRotation(m_set.rotation.data() + 4 * g, pixel); });
        m_meta["quats"] = {{"files", {"quats.webp"}}};
    }

    void addColors()
    {
        const size_t values = m_set.colorValues();
        std::vector<float> all;
        for (size_t i = 0; i < m_set.color.size(); i += values)
            all.insert(all.end(), m_set.color.data() + i, m_set.color.data() + i + 3);
        const Codebook book = makeCodebook(std::move(all));
        addImage("sh0.webp", [&](size_t g, uint8_t* pixel) {
            for (size_t c = 0; c < 3; ++c)
                pixel[c] = book.nearest(m_set.color[g * values + c]);
            pixel[3] = byteOf(m_set.opacity[g]);
        });
        m_meta["sh0"] = {{"codebook", book.values}, {"files", {"sh0.webp"}}};
    }

    void addHarmonics(size_t most_palette)
    {
        const size_t values = m_set.colorValues(), rest = values - 3;
        std::vector<float> vectors;
        vectors.reserve(m_set.size() * rest);
        for (size_t i = 0; i < m_set.color.size(); i += values)
            vectors.insert(vectors.end(), m_set.color.data() + i + 3, m_set.color.data() + i + values);
        const Palette palette = makePalette(vectors, rest, std::min(most_palette, kMostPalette));
        const Codebook book = makeCodebook(palette.centers);
        const size_t centers = palette.centers.size() / rest;
        ByteImage image(uint32_t(kPaletteRow * rest / 3), uint32_t((centers + kPaletteRow - 1) / kPaletteRow));
        for (size_t i = 0; i < palette.centers.size(); ++i)
            image.pixel(i / 3)[i % 3] = book.nearest(palette.centers[i]);
        m_images.emplace_back("shN_centroids.webp", std::move(image));
        addImage("shN_labels.webp", [&](size_t g, uint8_t* pixel) {
            pixel[0] = uint8_t(palette.labels[g]);
            pixel[1] = uint8_t(palette.labels[g] >> 8);
        });
        m_meta["shN"] = {{"count", centers},
                         {"bands", m_set.degree},
                         {"codebook", book.values},
                         {"files", {"shN_centroids.webp", "shN_labels.webp"}}};
    }

    const GaussianSet& m_set;
    Places m_places;
    std::vector<uint32_t> m_order; // numbers of the Gaussians in the order of the file
    uint32_t m_width = 0, m_height = 0;
    Json m_meta;
    std::vector<std::pair<std::string, ByteImage>> m_images;
};

class SogReader {
public:
    SogReader(std::function<std::vector<std::byte>(const std::string&)> read, const std::string& name)
        : m_name(name), m_read(std::move(read))
    {
        const std::vector<std::byte> text = m_read("meta.json");
        m_meta = Json::parse(reinterpret_cast<const char*>(text.data()),
                             reinterpret_cast<const char*>(text.data()) + text.size());
        m_count = m_meta.at("count").get<size_t>();
        if (m_meta.at("version") != 2)
            fail("version of meta.json is " + m_meta["version"].dump(), "2");
    }

    GaussianSet read()
    {
        GaussianSet set;
        set.degree = m_meta.contains("shN") ? m_meta["shN"].at("bands").get<int>() : 0;
        if (set.degree < 0 || set.degree > kMostShDegree)
            fail(formatString("degree %d", set.degree), "0 to 3");
        const ByteImage low = image("means", 0), high = image("means", 1), sizes = image("scales", 0),
                        rotations = image("quats", 0), colors = image("sh0", 0);
        const auto least = m_meta["means"].at("mins").get<std::array<float, 3>>(),
                   most = m_meta["means"].at("maxs").get<std::array<float, 3>>();
        const auto size_book = book("scales"), color_book = book("sh0");
        const size_t values = set.colorValues();
        set.color.resize(m_count * values);
        set.rotation.resize(m_count * 4);
        for (size_t i = 0; i < m_count; ++i) {
            for (size_t c = 0; c < 3; ++c) {
                const float step = float(low.pixel(i)[c] | high.pixel(i)[c] << 8);
                set.position.push_back(float(unpacked(least[c] + (most[c] - least[c]) * (step / kSteps))));
                set.log_scale.push_back(size_book[sizes.pixel(i)[c]]);
                set.color[i * values + c] = color_book[colors.pixel(i)[c]];
            }
            unpackRotation(rotations.pixel(i), set.rotation.data() + 4 * i);
            set.opacity.push_back(float(colors.pixel(i)[3]) / 255);
        }
        if (set.degree > 0)
            readHarmonics(set);
        set.score.assign(m_count, 0.0f);
        return set;
    }

private:
    [[noreturn]] void fail(const std::string& found, const std::string& expected) const
    {
        throw Error(ErrorCode::InvalidFile, m_name, found, expected, "export it again");
    }

    ByteImage image(const char* key, size_t which, size_t pixels)
    {
        const std::string member = m_meta.at(key).at("files").at(which).get<std::string>();
        ByteImage read = decodeWebp(m_read(member), m_name + ": " + member);
        if (size_t(read.width) * read.height < pixels)
            fail(formatString("%s has %u x %u pixels", member.c_str(), read.width, read.height),
                 formatString("at least %zu", pixels));
        return read;
    }
    ByteImage image(const char* key, size_t which) { return image(key, which, m_count); }

    [[nodiscard]] std::array<float, 256> book(const char* key) const
    {
        return m_meta.at(key).at("codebook").get<std::array<float, 256>>();
    }

    void readHarmonics(GaussianSet& set)
    {
        const size_t values = set.colorValues(), rest = values - 3, each = rest / 3;
        const auto centers = m_meta["shN"].at("count").get<size_t>();
        if (centers > kMostPalette)
            fail(formatString("a palette of %zu", centers), formatString("at most %zu", kMostPalette));
        const ByteImage palette = image("shN", 0, centers * each), labels = image("shN", 1);
        const auto codes = book("shN");
        for (size_t i = 0; i < m_count; ++i) {
            const size_t label = size_t(labels.pixel(i)[0]) | size_t(labels.pixel(i)[1]) << 8;
            if (label >= centers)
                fail(formatString("label %zu of %zu", label, centers), "less");
            for (size_t k = 0; k < rest; ++k)
                set.color[i * values + 3 + k] = codes[palette.pixel(label * each + k / 3)[k % 3]];
        }
    }

    std::string m_name;
    std::function<std::vector<std::byte>(const std::string&)> m_read;
    Json m_meta;
    size_t m_count = 0;
};

} // namespace

void requireSog() {}

SogMembers makeSogMembers(const GaussianSet& set, std::span<const size_t> ends, size_t most_palette, int threads)
{
    return SogWriter(set, ends).make(most_palette, threads);
}

GaussianSet readSogMembers(const std::function<std::vector<std::byte>(const std::string&)>& read,
                           const std::string& name)
{
    try {
        return SogReader(read, name).read();
    } catch (const Json::exception& fault) {
        throw Error(ErrorCode::InvalidFile, name, std::string("meta.json lacks something (") + fault.what() + ")",
                    "version 2 of the format", "export it again");
    }
}

void writeGaussianSog(const GaussianSet& set, const PieceSink& write, int threads)
{
    const size_t end = set.size();
    write(zipBundle(makeSogMembers(set, {&end, 1}, kMostPalette, threads)));
}

GaussianSet readGaussianSog(std::span<const std::byte> file, const std::string& name)
{
    const ZipArchive zip(file, name);
    return readSogMembers([&zip](const std::string& member) { return zip.read(member); }, name);
}

} // namespace gsc
