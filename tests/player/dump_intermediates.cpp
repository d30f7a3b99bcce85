// SPDX-License-Identifier: Apache-2.0
// dump_intermediates MODEL CAMERAS VIEW ROW < INDICES: bakes a trained model and prints, as JSON, what the scalar
// reference makes of it from one camera: the LOD mask, the visible anchors and, for the anchors whose PLY rows are read
// from standard input, every value that the trainers' dump holds. check_intermediates.py compares.
#include "kernels/decode/decode_body.h"
#include "kernels/select/select.h"
#include "kernels/select/select_body.h"
#include "runtime/cameras/camera_file.h"
#include <gsc/scene.h>
#include "tests/player/baked_model.h"

#include <nlohmann/json.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <iostream>
#include <map>

using namespace gsc;
using Json = nlohmann::json;

namespace {

struct Place {
    uint32_t chunk, local;
};

std::map<uint32_t, Place> placesBySource(const ModelView& model)
{
    std::map<uint32_t, Place> places;
    for (uint32_t chunk = 0; chunk < model.params->chunk_count; ++chunk)
        for (uint32_t local = 0; local < model.chunks[chunk].anchor_count; ++local)
            places[model.arrays[chunk].source_index[local]] = {chunk, local};
    return places;
}

// Opacity network's outputs of all offsets, those below the floor too.
std::vector<float> allOpacities(const ModelView& model, const ViewInput<float>& view, const Place& place)
{
    std::vector<float> scratch(decodeScratch(*model.params)), out(model.params->n_offsets);
    AnchorNetworks<float>(model, view, place.chunk, place.local, scratch.data()).evaluate(MlpKind::Opacity, out.data());
    for (float& value : out)
        value = std::tanh(value);
    return out;
}

bool inLodMask(const ModelView& model, const EyeParams& eye, const Place& place)
{
    const ModelParams& params = *model.params;
    const int32_t level = anchorLevel(model, place.chunk);
    const float predicted =
        predictedLevel<float>(params, anchorPosition(model, place.chunk, place.local), lodShift<float>(params, level),
                              eye.center, anchorExtraLevel(model, place.chunk, place.local), 0.0f);
    return level <= chooseLevel(LevelRule(params.level_rule), predicted, params.level_clamp).level;
}

Json anchorJson(const ModelView& model, const EyeParams& eye, const Place& place, int appearance)
{
    const Vec3<float> p = anchorPosition(model, place.chunk, place.local);
    const ViewInput<float> view = viewInput<float>(model, eye.center, p, place.chunk, appearance);
    const RasterConstants rules = rasterConstants(*model.params, 0);
    Json gaussians = Json::array();
    std::vector<float> scratch(decodeScratch(*model.params));
    decodeAnchor<float>(
        model, eye.center, place.chunk, place.local, 1.0f, appearance, scratch.data(), [&](const GaussianOf<float>& g) {
            const auto splat =
                footprint<float>(eye, rules, {g.position[0], g.position[1], g.position[2]}, g.scale, g.rotation);
            gaussians.push_back({{"k", g.order % model.params->n_offsets},
                                 {"xyz", g.position},
                                 {"scaling", g.scale},
                                 {"rot", g.rotation},
                                 {"opacity", {g.opacity}},
                                 {"color", g.color},
                                 {"radius", splat.visible ? splat.radius : 0}});
        });
    return {{"anchor", {p.x, p.y, p.z}},
            {"view", view.direction},
            {"dist", view.distance},
            {"neural_opacity", allOpacities(model, view, place)},
            {"gaussians", std::move(gaussians)}};
}

int dump(const std::string& model_path, const std::string& cameras, const std::string& view_name, int row)
{
    const test::BakedModel baked(model_path);
    const std::unique_ptr<Scene> scene = Scene::open(baked.path());
    const ModelView& model = scene->view();
    const std::vector<Camera> all = readCameraFile(cameras);
    const auto camera = std::find_if(all.begin(), all.end(), [&](const Camera& c) { return c.name == view_name; });
    if (camera == all.end())
        throw Error(ErrorCode::Usage, cameras, "has no camera " + view_name, "one", "name one that it has");
    const EyeParams eye = eyeParams(*camera, scene->view().origin);
    const int appearance = scene->appearanceRows().empty() ? -1 : scene->appearanceRow(row);
    const std::map<uint32_t, Place> places = placesBySource(model);

    std::vector<uint32_t> visible;
    for (const auto& anchor : selectReference<float>(model, eye, rasterConstants(*model.params, 0), 0.0f))
        visible.push_back(model.arrays[anchor.chunk].source_index[anchor.local]);
    std::sort(visible.begin(), visible.end());
    std::vector<uint32_t> lod_mask;
    if (model.params->flags & kModelHasLevels)
        for (const auto& [source, place] : places)
            if (inLodMask(model, eye, place))
                lod_mask.push_back(source);
    Json anchors = Json::array();
    for (uint32_t source = 0; std::cin >> source;)
        anchors.push_back(anchorJson(model, eye, places.at(source), appearance));
    std::cout << Json{{"visible", visible}, {"lod_mask", lod_mask}, {"anchors", std::move(anchors)}}.dump() << "\n";
    return 0;
}

} // namespace

int main(int argc, char** argv)
{
    if (argc != 5) {
        std::fprintf(stderr, "usage: dump_intermediates MODEL CAMERAS VIEW ROW < INDICES\n");
        return 1;
    }
    try {
        return dump(argv[1], argv[2], argv[3], std::atoi(argv[4]));
    } catch (const std::exception& e) {
        std::fprintf(stderr, "error: %s\n", e.what());
        return 1;
    }
}
