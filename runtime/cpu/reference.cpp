// SPDX-License-Identifier: Apache-2.0
#include "runtime/cpu/renderer_cpu.h"
#include "runtime/backend/frame_checks.h"

#include "kernels/blend/blend.h"
#include "kernels/present/false_colour.h"
#include "kernels/threads/stopwatch.h"
#include "kernels/math/anchor.h"

#include <algorithm>
#include <unordered_map>

namespace gsc {

namespace {

// Replaces the Gaussians' own colours by false colours. Nothing is kept between frames here, so every anchor is
// decoded for this frame.
template <typename Real>
void paintGaussians(const ModelView& model, const std::vector<SelectedAnchor<Real>>& selected, FrameView view,
                    std::vector<GaussianOf<Real>>& gaussians)
{
    std::unordered_map<uint64_t, FalseColour> of_source;
    for (const SelectedAnchor<Real>& anchor : selected)
        of_source[model.arrays[anchor.chunk].source_index[anchor.local]] =
            view == FrameView::Level ? levelColour(model.levels[model.chunks[anchor.chunk].level_index].level)
            : view == FrameView::Age ? ageColour(0)
                                     : detailColour(GroupSource::Near);
    for (GaussianOf<Real>& gaussian : gaussians) {
        const FalseColour& colour = of_source.at(gaussian.order / model.params->n_offsets);
        gaussian.color[0] = Real(colour.r);
        gaussian.color[1] = Real(colour.g);
        gaussian.color[2] = Real(colour.b);
    }
}

template <typename Real>
void renderEye(const ModelView& model, const EyeOf<Real>& eye, const Real* decode_center, const FrameOptions& options,
               Real* image, const DepthRows<Real>& depth, EyeCounts& counts, StageTimes& times)
{
    const RasterConstants rules = rasterConstants(*model.params, options.near_z);
    Stopwatch watch;
    std::vector<SelectedAnchor<Real>> selected =
        selectReference<Real>(model, eye, rules, Real(options.lod_bias), Real(options.lod_fade));
    for (uint64_t c = 0; c < model.params->chunk_count; ++c)
        counts.anchors_tested += model.chunks[c].anchor_count;
    counts.anchors_visible = counts.anchors_decoded = selected.size();
    times.select += watch.lap();

    bool any_positive = false;
    std::vector<GaussianOf<Real>> gaussians =
        decodeReference<Real>(model, decode_center, selected, options.appearance, any_positive);
    counts.gaussians_alive = gaussians.size();
    if (paintsGaussians(options.view))
        paintGaussians(model, selected, options.view, gaussians);
    times.decode += watch.lap();

    std::vector<SplatOf<Real>> splats = projectReference<Real>(eye, rules, gaussians, counts.gaussians_dropped);
    const ColumnRange columns = options.columns.within(eye.width);
    std::erase_if(splats, [&](const SplatOf<Real>& splat) {
        return uint32_t(splat.tiles.x1) * kTileSize <= columns.first ||
               uint32_t(splat.tiles.x0) * kTileSize >= columns.end;
    });
    counts.gaussians_visible = splats.size();
    times.project += watch.lap();

    const std::vector<uint32_t> sorted = sortReference(splats);
    times.sort += watch.lap();
    const TileLists lists = binReference(splats, sorted, tileCount(eye.width), tileCount(eye.height));
    counts.pairs = lists.entries.size();
    times.bin += watch.lap();

    if (any_positive)
        counts.blend_evaluations = blendReference(splats, lists, eye.width, eye.height, rules, options.background,
                                                  image, depth, options.columns, options.view == FrameView::Cost);
    else
        blendNothing(eye.width, eye.height, emptyColor(options), image, depth, options.columns);
    times.blend += watch.lap();
}

template <typename Real>
void renderReference(const ModelView& model, const EyeOf<Real>* eyes, uint32_t eye_count, const FrameOptions& options,
                     Real* const* images, FrameResult& result, const DepthRows<Real>* depths)
{
    checkModel(model);
    checkOptions(model, options, eye_count);
    for (uint32_t e = 0; e < eye_count; ++e) {
        checkSize(eyes[e].width, eyes[e].height);
        checkColumns(options.columns, eyes[e].width);
    }
    result = {};
    Stopwatch watch;
    const bool merged = decodesMerged(options, eye_count);
    Real middle[3] = {};
    if (merged)
        mergedCenter(eyes, middle);
    std::vector<Real> unwanted; // image of an eye for which the caller wants none
    for (uint32_t e = 0; e < eye_count; ++e) {
        Real* image = images != nullptr ? images[e] : nullptr;
        if (image == nullptr) {
            unwanted.resize(size_t(eyes[e].width) * eyes[e].height * 3);
            image = unwanted.data();
        }
        const DepthRows<Real> depth = depths != nullptr ? depths[e] : DepthRows<Real>{};
        renderEye<Real>(model, eyes[e], merged ? middle : eyes[e].center, options, image, depth, result.eyes[e],
                        result.times);
        blendHidden(eyes[e].width, eyes[e].height, options.lens[e], image, depth, options.columns);
    }
    result.times.total = watch.lap();
    result.bytes_resident = modelBytes(model);
}

} // namespace

void renderReference64(const ModelView& model, const EyeParams64* eyes, uint32_t eye_count, const FrameOptions& options,
                       double* const* images, FrameResult& result, const DepthRows<double>* depths)
{
    renderReference<double>(model, eyes, eye_count, options, images, result, depths);
}

void renderReference32(const ModelView& model, const EyeParams* eyes, uint32_t eye_count, const FrameOptions& options,
                       float* const* images, FrameResult& result, const DepthRows<float>* depths)
{
    renderReference<float>(model, eyes, eye_count, options, images, result, depths);
}

} // namespace gsc
