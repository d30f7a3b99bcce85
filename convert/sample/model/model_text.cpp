// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/model/model_text.h"

#include <gsc/error.h>

#include <charconv>

namespace gsc {

namespace {

// Shortest decimal number that reads back as the same double, as Python prints it.
std::string number(double value)
{
    if (value == 0)
        return "0.0";
    char buffer[40];
    const auto end = std::to_chars(buffer, buffer + sizeof(buffer), value).ptr;
    std::string text(buffer, end);
    if (text.find_first_of(".en") == std::string::npos)
        text += ".0";
    return text;
}

std::string vector(const double v[3])
{
    return formatString("[%s, %s, %s]", number(v[0]).c_str(), number(v[1]).c_str(), number(v[2]).c_str());
}

std::string rotationRows(const SourceCamera& camera)
{
    const double* r = camera.rotation;
    return formatString("[%s, %s, %s]", vector(r).c_str(), vector(r + 3).c_str(), vector(r + 6).c_str());
}

const char* boolean(bool value)
{
    return value ? "True" : "False";
}

} // namespace

std::string plyHeader(uint64_t anchors, bool octree, uint32_t feat_dim, uint32_t n_offsets)
{
    std::string text = formatString("ply\nformat binary_little_endian 1.0\nelement vertex %llu\n",
                                    static_cast<unsigned long long>(anchors));
    const auto property = [&](const char* name) { text += formatString("property float %s\n", name); };
    const auto numbered = [&](const char* name, uint32_t count) {
        for (uint32_t i = 0; i < count; ++i)
            property(formatString("%s%u", name, i).c_str());
    };
    constexpr const char* kFirst[2][6] = {{"x", "y", "z", "nx", "ny", "nz"},
                                          {"x", "y", "z", "level", "extra_level", "info"}};
    for (const char* name : kFirst[octree])
        property(name);
    numbered("f_offset_", 3 * n_offsets);
    numbered("f_anchor_feat_", feat_dim);
    property("opacity");
    numbered("scale_", 6);
    numbered("rot_", 4);
    return text + "end_header\n";
}

std::string scaffoldArguments(const TrainingArguments& a)
{
    const char* on = boolean(a.everything_on);
    return formatString("Namespace(sh_degree=3, feat_dim=32, n_offsets=10, voxel_size=%s, update_depth=3, "
                        "update_init_factor=16, update_hierachy_factor=4, use_feat_bank=%s, source_path='data/%s', "
                        "model_path='output/%s/scaffold', images='images', resolution=-1, white_background=False, "
                        "data_device='cuda', eval=True, lod=0, appearance_dim=%u, lowpoly=False, ds=1, ratio=1, "
                        "undistorted=False, add_opacity_dist=%s, add_cov_dist=%s, add_color_dist=%s)",
                        number(a.voxel_size).c_str(), on, a.scene.c_str(), a.scene.c_str(), a.appearance_dim, on, on,
                        on);
}

std::string octreeArguments(const TrainingArguments& a)
{
    const char* on = boolean(a.everything_on);
    return formatString("Namespace(feat_dim=32, n_offsets=10, fork=2, use_feat_bank=%s, source_path='data/%s', "
                        "model_path='output/%s/octree', images='images', resolution=-1, white_background=False, "
                        "random_background=False, resolution_scales=[1.0], data_device='cuda', eval=True, ds=1, "
                        "ratio=1, undistorted=False, appearance_dim=%u, add_opacity_dist=%s, add_cov_dist=%s, "
                        "add_color_dist=%s, add_level=%s, extend=1.1, dist2level='%s', base_layer=%d, "
                        "visible_threshold=0.01, update_ratio=0.2, progressive=True, dist_ratio=0.999, levels=-1, "
                        "init_level=-1, extra_ratio=0.25, extra_up=0.01)",
                        on, a.scene.c_str(), a.scene.c_str(), a.appearance_dim, on, on, on, on,
                        a.everything_on ? "floor" : "round", a.base_layer);
}

std::string camerasJson(const std::vector<SourceCamera>& cameras)
{
    std::string text = "[";
    for (size_t i = 0; i < cameras.size(); ++i) {
        const SourceCamera& c = cameras[i];
        text += formatString("%s{\"id\": %zu, \"img_name\": \"%s\", \"width\": %u, \"height\": %u, \"position\": ",
                             i ? ", " : "", i, c.name.c_str(), c.width, c.height);
        text += vector(c.position) + ", \"rotation\": " + rotationRows(c);
        text += ", \"fy\": " + number(c.fy) + ", \"fx\": " + number(c.fx) + "}";
    }
    return text + "]";
}

std::string trajectoryJson(const CameraPath& path)
{
    std::string text = formatString("{\n  \"schema\": \"gsc.trajectory/1\",\n  \"name\": \"%s\",\n  \"fps\": %s",
                                    path.name.c_str(), number(path.fps).c_str());
    if (!path.description.empty())
        text += ",\n  \"description\": \"" + path.description + "\"";
    if (path.metre > 0)
        text += ",\n  \"metre\": " + number(path.metre);
    if (path.ipd > 0)
        text += ",\n  \"ipd\": " + number(path.ipd);
    text += ",\n  \"frames\": [";
    for (size_t i = 0; i < path.frames.size(); ++i) {
        const SourceCamera& c = path.frames[i];
        text += formatString("%s\n    {\"name\": \"%s\", \"width\": %u, \"height\": %u, \"fx\": ", i ? "," : "",
                             c.name.c_str(), c.width, c.height);
        text += number(c.fx) + ", \"fy\": " + number(c.fy) + ",\n     \"position\": ";
        text += vector(c.position) + ",\n     \"rotation\": " + rotationRows(c);
        if (c.appearance >= 0)
            text += formatString(", \"appearance\": %d", c.appearance);
        text += "}";
    }
    return text + "\n  ]\n}\n";
}

} // namespace gsc
