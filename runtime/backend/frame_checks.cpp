// SPDX-License-Identifier: Apache-2.0
#include "runtime/backend/frame_checks.h"

#include <gsc/error.h>
#include "format/numbers/count_text.h"
#include "kernels/math/mlp.h"

namespace gsc {

uint64_t modelBytes(const ModelView& model)
{
    const ModelParams& params = *model.params;
    uint64_t bytes = sizeof(ModelParams) + params.level_count * sizeof(LevelRecord) +
                     params.chunk_count * sizeof(ChunkRecord) + params.group_count * sizeof(GroupRecord);
    for (uint64_t c = 0; c < params.chunk_count; ++c)
        bytes += model.chunks[c].payload_bytes;
    return bytes;
}

void checkModel(const ModelView& model)
{
    const ModelParams& params = *model.params;
    for (const MlpKind kind : {MlpKind::Opacity, MlpKind::Covariance, MlpKind::Color})
        if (mlpRecord(model, kind) == nullptr)
            throw Error(ErrorCode::InvalidFile, "model", formatString("has no MLP of kind %u", uint32_t(kind)),
                        "opacity, covariance and colour", "convert the checkpoint again");
    if ((params.flags & kModelFeatureBank) && mlpRecord(model, MlpKind::FeatureBank) == nullptr)
        throw Error(ErrorCode::InvalidFile, "model", "says it has a feature bank but holds no MLP of that kind", "one",
                    "convert the checkpoint again");
    if ((params.flags & kModelFeatureBank) && params.feat_dim % 4 != 0)
        throw Error(ErrorCode::InvalidFile, "model", formatString("feature bank with %u features", params.feat_dim),
                    "a multiple of 4", "convert the checkpoint again");
}

void checkSize(uint32_t width, uint32_t height)
{
    constexpr uint32_t kMaxPixels = 65535; // the kernels hold the pixel boxes of splats in 16 bits
    if (width < 1 || height < 1 || width > kMaxPixels || height > kMaxPixels)
        throw Error(ErrorCode::Usage, "frame", formatString("image of %u x %u pixels", width, height),
                    formatString("1 to %u each way", kMaxPixels), "choose another size");
}

void checkColumns(const ColumnRange& columns, uint32_t width)
{
    const ColumnRange drawn = columns.within(width);
    if (columns.first % kColumnStep != 0 || columns.end % kColumnStep != 0 || drawn.first >= drawn.end ||
        (columns.all() && columns.first != 0))
        throw Error(
            ErrorCode::Usage, "frame",
            formatString("columns %u to %u of an image of %u", columns.first, columns.end, width),
            formatString(
                "multiples of %u, of which the first is less than the second and lies in the image, or 0 to 0 for all",
                kColumnStep),
            "correct them");
}

namespace {

void checkTarget(const FrameTarget& target, const EyeParams& eye, bool on_host)
{
    using Kind = FrameTarget::Kind;
    const size_t pixel = pixelBytes(target.format), word = pixel == 8 ? 8 : 4;
    const bool memory = target.kind == Kind::Host || target.kind == Kind::Device;
    if (target.kind > Kind::Surface || target.format > PixelFormat::Bgra8 ||
        (target.kind == Kind::Surface && !on_host && target.surface == 0))
        throw Error(ErrorCode::Usage, "target",
                    formatString("kind %u, format %u and surface %llu", uint32_t(target.kind), uint32_t(target.format),
                                 target.surface),
                    "kinds and formats that there are and a surface that is not 0", "correct them");
    if (target.kind == Kind::Surface && (on_host || target.format == PixelFormat::Rgb32f))
        throw Error(ErrorCode::Unsupported, "target",
                    on_host ? "a surface of a renderer on the host" : "a surface of three floats",
                    on_host ? "memory" : "Rgba16f, Rgba8 or Bgra8",
                    on_host ? "use a target of kind Host" : "use one of them");
    if (memory && (target.pixels == nullptr || reinterpret_cast<uintptr_t>(target.pixels) % word != 0 ||
                   target.pitch % word != 0 || (target.pitch != 0 && target.pitch < pixel * eye.width)))
        throw Error(
            ErrorCode::Usage, "target",
            formatString("memory at %p with rows of %zu bytes", target.pixels, target.pitch),
            formatString("a place and a pitch that are multiples of %zu and room for %u pixels of %zu bytes a row",
                         word, eye.width, pixel),
            "correct them");
    if (memory
            ? reinterpret_cast<uintptr_t>(target.depth) % 4 != 0 || target.depth_pitch % 4 != 0 ||
                  (target.depth_pitch != 0 && target.depth_pitch < 4 * size_t(eye.width)) || target.depth_surface != 0
            : target.depth != nullptr || (target.kind == Kind::None && target.depth_surface != 0))
        throw Error(ErrorCode::Usage, "target",
                    formatString("depths at %p with rows of %zu bytes and in surface %llu, of a target of kind %u",
                                 static_cast<void*>(target.depth), target.depth_pitch, target.depth_surface,
                                 uint32_t(target.kind)),
                    formatString("them where the pixels are, multiples of 4 and room for %u values of 4 bytes a row",
                                 eye.width),
                    "correct them");
}

} // namespace

void checkOptions(const ModelView& model, const FrameOptions& options, uint32_t eye_count)
{
    const ModelParams& params = *model.params;
    if (eye_count < 1 || eye_count > kMaxEyes)
        throw Error(ErrorCode::Usage, "frame", formatString("%u eyes", eye_count), "1 or 2", "draw one or both");
    // the comparison is written so that a NaN fails, too
    if (!(options.lod_fade >= 0 && options.lod_fade <= 1) ||
        !(options.lod_hysteresis >= 0 && options.lod_hysteresis <= 1))
        throw Error(
            ErrorCode::Usage, "frame",
            formatString("LOD fade %g and hysteresis %g", double(options.lod_fade), double(options.lod_hysteresis)),
            "0 to 1 level each", "correct them");
    const Foveation& fovea = options.foveation;
    bool gazes = true;
    for (const auto& gaze : fovea.gaze)
        gazes = gazes && std::abs(gaze[0]) <= 100 && std::abs(gaze[1]) <= 100;
    if (!(fovea.smallest >= 0 && fovea.smallest <= kMostFoveaPixels) || !gazes ||
        (fovea.smallest > 0 && options.tier == Tier::Exact))
        throw Error(ErrorCode::Usage, "frame",
                    formatString("foveation to %g pixels in tier %s", double(fovea.smallest),
                                 options.tier == Tier::Exact ? "exact" : "fast"),
                    "0 to 100, gazes of 0 to 100 at depth 1 and tier fast", "correct them");
    if (!(options.detail >= 0 && options.detail <= kMostDetail) ||
        (options.detail > 0 && options.reuse.policy != ReusePolicy::None))
        throw Error(ErrorCode::Usage, "frame",
                    formatString("detail of %g pixels, reuse policy %u", double(options.detail),
                                 uint32_t(options.reuse.policy)),
                    formatString("0 to %g pixels, and without reuse where it is not 0", double(kMostDetail)),
                    "correct them");
    if (uint32_t(options.view) >= kFrameViews)
        throw Error(ErrorCode::Usage, "frame", formatString("view %u", uint32_t(options.view)),
                    formatString("0 to %u", kFrameViews - 1), "choose one that there is");
    const bool has_rows = params.appearance_dim > 0;
    if (has_rows && (options.appearance < 0 || uint32_t(options.appearance) >= params.appearance_rows))
        throw Error(ErrorCode::Usage, "frame", formatString("appearance row %d", options.appearance),
                    formatString("0 to %u", params.appearance_rows - 1), "choose one of the rows the model holds");
    if (!has_rows && options.appearance >= 0)
        throw Error(ErrorCode::Usage, "frame", formatString("appearance row %d", options.appearance),
                    "none, because the model has no appearance embedding", "leave the option out");
}

void checkInFlight(size_t frames, uint32_t most)
{
    if (frames >= most)
        throw internalError("renderer", formatString("%zu frames are in flight", frames),
                            formatString("fewer than %u at a submit(), behind a wait()", most));
}

void throwNotInFlight(uint64_t ticket)
{
    throw internalError("renderer", "frame " + std::to_string(ticket) + " is not in flight",
                        "a ticket of submit() that no wait() has ended");
}

bool decodesMerged(const FrameOptions& options, uint32_t eye_count)
{
    return options.stereo == StereoMode::Merged && eye_count == 2;
}

void checkReuse(const std::string& backend, ReusePolicy policy)
{
    if (backend == "cuda" && policy == ReusePolicy::Error)
        throw Error(ErrorCode::Unsupported, "frame",
                    "reuse policy error on the backend cuda, where decoding takes less time than drawing what it keeps",
                    "depth or none", "draw with a detail there, or on the CPU")
            .with({Setting::Detail, Setting::CpuBackend});
}

void checkRequest(const ModelView& model, const FrameRequest& request, bool on_host)
{
    if (model.params == nullptr)
        throw internalError("renderer", "no model is loaded", "load() before submit()");
    const FrameOptions& options = request.options;
    const auto eye_count = uint32_t(request.eyes.size());
    checkOptions(model, options, eye_count);
    if (!(options.reuse.bound >= 0 && options.reuse.bound <= 1e6f))
        throw Error(ErrorCode::Usage, "frame", formatString("reuse bound %g", double(options.reuse.bound)),
                    "0 to 1000000 in 1/255", "correct it");
    if (decodesMerged(options, eye_count) && options.reuse.policy == ReusePolicy::Error)
        throw Error(ErrorCode::Unsupported, "frame",
                    "stereo merged together with reuse policy error, which bounds the change for each eye",
                    "policy depth or none", "use one of them");
    for (const EyeParams& eye : request.eyes) {
        checkSize(eye.width, eye.height);
        checkColumns(options.columns, eye.width);
    }
    if (!request.targets.empty() && request.targets.size() != request.eyes.size())
        throw Error(ErrorCode::Usage, "frame",
                    formatCount(request.targets.size(), "target") + " for " + formatCount(eye_count, "eye"),
                    "one for each or none", "correct them");
    for (size_t e = 0; e < request.targets.size(); ++e)
        checkTarget(request.targets[e], request.eyes[e], on_host);
}

} // namespace gsc
