// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/model/gsc_checkpoint.h"

#include "convert/survey/chunk_values.h"
#include <gsc/half.h>
#include "format/numbers/morton.h"
#include "runtime/records/record.h"
#include <gsc/camera.h>

#include <algorithm>
#include <cstring>
#include <numeric>
#include <tuple>

namespace gsc {

namespace {

LinearLayer layerOf(const GscView& view, uint32_t in, uint32_t out, uint64_t weight, uint64_t bias)
{
    LinearLayer layer{in, out, std::vector<float>(size_t(in) * out), std::vector<float>(out)};
    std::memcpy(layer.weight.data(), view.weights.data() + weight, layer.weight.size() * sizeof(float));
    std::memcpy(layer.bias.data(), view.weights.data() + bias, layer.bias.size() * sizeof(float));
    return layer;
}

} // namespace

Checkpoint checkpointOf(const GscView& view, const std::string& path)
{
    const ModelParams& p = *view.params;
    Checkpoint result;
    result.model_path = result.ply_path = path;
    const OrderedJson manifest = manifestOf(view.manifest);
    if (const auto source = manifest.find("source"); source != manifest.end() && source->is_object()) {
        if (const auto container = source->find("container"); container != source->end() && container->is_string())
            result.container = container->get<std::string>();
        if (const auto iteration = source->find("iteration");
            iteration != source->end() && iteration->is_number_integer())
            result.iteration = iteration->get<int>();
    }
    result.family = ModelFamily(p.family);
    result.anchor_count = view.header->anchor_count;
    result.feat_dim = p.feat_dim;
    result.n_offsets = p.n_offsets;
    result.appearance_dim = p.appearance_dim;
    result.flags = p.flags & ~uint32_t(kModelHasRotation | kModelHasOpacity | kModelHasNormal);
    result.level_rule = LevelRule(p.level_rule);
    result.raster_rules = RasterRules(p.raster_rules);
    result.fork = p.fork;
    result.level_min = p.level_min;
    result.level_clamp = p.level_clamp;
    result.standard_dist = p.standard_dist;
    result.voxel_size = p.voxel_size;
    for (const MlpRecord& m : view.mlps)
        result.mlps.push_back(
            {MlpKind(m.kind),
             Activation(m.activation),
             m.inputs,
             {layerOf(view, m.in, m.hidden, m.weight0, m.bias0), layerOf(view, m.hidden, m.out, m.weight1, m.bias1)}});
    result.embedding.assign(view.embedding.begin(), view.embedding.end());
    result.embedding_numbers.assign(view.embedding_rows.begin(), view.embedding_rows.end());
    for (const CameraRecord& record : view.cameras)
        result.cameras.push_back(sourceCamera(record, view.camera_names));
    // the metre of the file is kept, even if the anchors that it was derived from are gone
    result.metre = metreOfManifest(view.manifest).value_or(Metre{});
    return result;
}

OrderedJson manifestOf(std::string_view manifest)
{
    ParsedRow parsed = parseRow(manifest);
    return parsed.json.is_object() ? std::move(parsed.json) : OrderedJson::object();
}

WriteOptions writeOptionsOf(const GscView& view)
{
    WriteOptions result;
    result.sensitivity = view.sensitivity.empty() ? SensitivityMode::None : SensitivityMode::Sampled;
    const OrderedJson manifest = manifestOf(view.manifest);
    const auto options = manifest.find("options");
    if (options == manifest.end() || !options->is_object())
        return result;
    if (const auto anchors = options->find("chunk_anchors");
        anchors != options->end() && anchors->is_number_unsigned() && anchors->get<uint64_t>() >= 1 &&
        anchors->get<uint64_t>() <= kMaxAnchors)
        result.chunk_anchors = anchors->get<uint64_t>();
    if (const auto drop = options->find("drop_invalid"); drop != options->end() && drop->is_boolean())
        // taken over although a .gsc holds no invalid anchor, because the manifest states the option
        result.drop_invalid = drop->get<bool>();
    // the option --appearance, if the file has the one row that it names; all rows of the file are written
    if (const auto row = options->find("appearance"); row != options->end() && row->is_number_unsigned() &&
                                                      view.embedding_rows.size() == 1 && *row == view.embedding_rows[0])
        result.appearance = int(view.embedding_rows[0]);
    return result;
}

void roundToHalves(std::vector<Mlp>& mlps)
{
    const auto nearest = [](std::vector<float>& values) {
        for (float& v : values)
            if (std::fabs(v) <= 65504)
                v = halfToFloat(floatToHalf(v));
    };
    for (Mlp& mlp : mlps)
        for (LinearLayer& layer : mlp.layers) {
            nearest(layer.weight);
            nearest(layer.bias);
        }
}

std::vector<uint32_t> anchorOrder(const GscView& view, bool by_source)
{
    const size_t n = view.header->anchor_count;
    std::vector<uint32_t> order(n);
    std::iota(order.begin(), order.end(), 0u);
    if (by_source)
        return {view.index.begin(), view.index.end()};
    if (view.params->position_encoding != uint32_t(PositionEncoding::Grid))
        return order;
    std::vector<std::pair<uint64_t, uint64_t>> keys(
        n); // per anchor: Morton key of its cube of 128 quanta, then its key within the cube
    for (const ChunkRecord& chunk : view.chunks) {
        const ChunkValues values(view, chunk);
        for (uint32_t i = 0; i < chunk.anchor_count; ++i) {
            const std::array<int32_t, 3> q = values.quanta(i);
            constexpr int32_t kMask = (1 << kChunkLog2) - 1;
            keys[chunk.anchor_first + i] = {
                mortonKey(q[0] >> kChunkLog2, q[1] >> kChunkLog2, q[2] >> kChunkLog2),
                mortonEncode(uint32_t(q[0] & kMask), uint32_t(q[1] & kMask), uint32_t(q[2] & kMask))};
        }
    }
    for (const LevelRecord& level : view.levels) // anchors of a level follow each other
        std::sort(order.begin() + ptrdiff_t(level.anchor_first),
                  order.begin() + ptrdiff_t(level.anchor_first + level.anchor_count),
                  [&](uint32_t a, uint32_t b) { return std::tuple(keys[a], a) < std::tuple(keys[b], b); });
    return order;
}

} // namespace gsc
