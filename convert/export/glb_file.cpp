// SPDX-License-Identifier: Apache-2.0
#include "convert/export/gaussian_files.h"

#include <gsc/error.h>

#include <nlohmann/json.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

namespace gsc {

namespace {

using Json = nlohmann::ordered_json;

constexpr uint32_t kFloat = 5126, kArrayBuffer = 34962; // codes of glTF for float values and for a vertex buffer
constexpr size_t kPiece = 1u << 16;                     // floats that are written at once

// An array of floats in the file, with `each` values for a Gaussian.
struct Attribute {
    std::string name;
    size_t each;
    std::function<float(size_t i, size_t c)> value;
};

std::vector<Attribute> attributesOf(const GaussianSet& set)
{
    const std::string prefix = "KHR_gaussian_splatting:";
    std::vector<Attribute> all = {
        {"POSITION", 3, [&set](size_t i, size_t c) { return set.position[3 * i + c]; }},
        // in the order x y z w
        {prefix + "ROTATION", 4, [&set](size_t i, size_t c) { return set.rotation[4 * i + (c + 1) % 4]; }},
        {prefix + "SCALE", 3, [&set](size_t i, size_t c) { return std::exp(set.log_scale[3 * i + c]); }},
        {prefix + "OPACITY", 1, [&set](size_t i, size_t) { return set.opacity[i]; }}};
    for (int degree = 0; degree <= set.degree; ++degree)
        for (int m = 0; m <= 2 * degree; ++m) {
            const size_t at = shValues(degree - 1) + size_t(m);
            all.push_back({prefix + "SH_DEGREE_" + std::to_string(degree) + "_COEF_" + std::to_string(m), 3,
                           [&set, at](size_t i, size_t c) { return set.color[i * set.colorValues() + 3 * at + c]; }});
        }
    return all;
}

Json documentOf(const GaussianSet& set, const std::vector<Attribute>& attributes, uint64_t bytes)
{
    Json accessors = Json::array(), views = Json::array(), names = Json::object();
    uint64_t offset = 0;
    for (const Attribute& attribute : attributes) {
        const uint64_t length = set.size() * attribute.each * sizeof(float);
        views.push_back({{"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", kArrayBuffer}});
        Json accessor = {{"bufferView", accessors.size()},
                         {"componentType", kFloat},
                         {"count", set.size()},
                         {"type", attribute.each == 1   ? "SCALAR"
                                  : attribute.each == 3 ? "VEC3"
                                                        : "VEC4"}};
        if (attribute.name == "POSITION") {
            std::array<float, 3> least, most;
            for (size_t c = 0; c < 3; ++c) {
                least[c] = most[c] = set.position[c];
                for (size_t i = 0; i < set.size(); ++i) {
                    least[c] = std::min(least[c], set.position[3 * i + c]);
                    most[c] = std::max(most[c], set.position[3 * i + c]);
                }
            }
            accessor["min"] = least;
            accessor["max"] = most;
        }
        names[attribute.name] = accessors.size();
        accessors.push_back(std::move(accessor));
        offset += length;
    }
    return {{"asset", {{"version", "2.0"}, {"generator", "gsc"}}},
            {"extensionsUsed", {"KHR_gaussian_splatting"}},
            {"scene", 0},
            {"scenes", {{{"nodes", {0}}}}},
            {"nodes", {{{"mesh", 0}, {"rotation", {0, 0, 1, 0}}}}},
            {"meshes",
             {{{"primitives",
                {{{"attributes", std::move(names)},
                  {"mode", 0},
                  {"extensions",
                   {{"KHR_gaussian_splatting",
                     {{"kernel", "ellipse"},
                      {"colorSpace", "srgb_rec709_display"},
                      {"sortingMethod", "cameraDistance"},
                      {"projection", "perspective"}}}}}}}}}}},
            {"buffers", {{{"byteLength", bytes}}}},
            {"bufferViews", std::move(views)},
            {"accessors", std::move(accessors)}};
}

} // namespace

void writeGaussianGlb(const GaussianSet& set, const PieceSink& write)
{
    const std::vector<Attribute> attributes = attributesOf(set);
    uint64_t bytes = 0;
    for (const Attribute& attribute : attributes)
        bytes += set.size() * attribute.each * sizeof(float);
    std::string json = documentOf(set, attributes, bytes).dump();
    json.resize((json.size() + 3) / 4 * 4, ' ');
    const uint64_t all = 12 + 8 + json.size() + 8 + bytes;
    if (all > UINT32_MAX)
        throw Error(ErrorCode::Unsupported, "glb",
                    formatString("%zu Gaussians of degree %d take %llu bytes", set.size(), set.degree,
                                 static_cast<unsigned long long>(all)),
                    "at most 4 GiB", "choose a lower --sh, --max-gaussians, or --to ply");
    // codes of "glTF" and of the chunk "JSON"
    const uint32_t head[5] = {0x46546c67u, 2, uint32_t(all), uint32_t(json.size()), 0x4e4f534au};
    const uint32_t binary[2] = {uint32_t(bytes), 0x004e4942u}; // code of the chunk "BIN"
    write(std::as_bytes(std::span(head)));
    write(std::as_bytes(std::span(json)));
    write(std::as_bytes(std::span(binary)));
    std::vector<float> piece;
    const auto flush = [&](size_t least) {
        if (piece.size() < least)
            return;
        write(std::as_bytes(std::span(piece)));
        piece.clear();
    };
    for (const Attribute& attribute : attributes)
        for (size_t i = 0; i < set.size(); ++i) {
            for (size_t c = 0; c < attribute.each; ++c)
                piece.push_back(attribute.value(i, c));
            flush(kPiece);
        }
    flush(1);
}

} // namespace gsc
