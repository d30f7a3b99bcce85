// SPDX-License-Identifier: Apache-2.0
#include "tests/kernels/gpu_decode.h"

#include "kernels/decode/decode.h"
#include "kernels/math/projection.h"
#include "kernels/select/select_cuda.h"

#include <doctest/doctest.h>

#include <cstdlib>

namespace gsc::test {

namespace {

// Values of a splat, in the reference's units.
struct Plain {
    double conic[3], opacity, color[3];
};
Plain plain(const PackedSplat& s)
{
    constexpr double kLn2 = 0.6931471805599453;
    const double a = s.factor[0], b = s.factor[1], c = s.factor[2];
    return {{2 * kLn2 * a * a, 2 * kLn2 * a * b, 2 * kLn2 * (b * b + c * c)},
            stepsFloat(s.opacity),
            {stepsFloat(s.color[0]), stepsFloat(s.color[1]), stepsFloat(s.color[2])}};
}
Plain plain(const ExactSplat& s)
{
    return {{s.conic[0], s.conic[1], s.conic[2]}, s.opacity, {s.color[0], s.color[1], s.color[2]}};
}

bool sameTiles(const PackedSplat&, const TileRect&)
{
    return true; // it has none
}
bool sameTiles(const ExactSplat& s, const TileRect& tiles)
{
    return s.tx0 == tiles.x0 && s.ty0 == tiles.y0 && s.tx1 == tiles.x1 && s.ty1 == tiles.y1;
}

// As a frame of several passes does before it decodes one. listed, fraction: room for all of the frame's anchors.
void listPass(DecodeFrame& frame, uint32_t* listed, float* fraction)
{
    PassListArgs args{};
    std::copy_n(frame.eyes, kMaxEyes, args.eyes);
    args.model = frame.model;
    args.eye_count = frame.eye_count;
    args.grid = frame.grid;
    args.pass = frame.pass;
    args.visible = frame.visible;
    args.fraction = frame.fraction;
    args.capacity = frame.visible_capacity;
    args.listed = listed;
    args.listed_fraction = fraction;
    args.counters = frame.counters;
    listPassCuda(args, kTestProcessors, testStream().handle);
    frame.visible = listed;
    frame.fraction = fraction;
    frame.visible_count = &frame.counters->pass.anchors_listed;
}

void launch(const DecodeFrame& frame, const DecodeJob& job, PackedSplat* splats)
{
    DeviceScene& scene = job.model->scene;
    scene.useAppearance(job.appearance, testStream());
    const DecodeCudaArgs args{frame, scene.fragments(), scene.biases(), splats,
                              inverseOffsets(frame.model.params.n_offsets)};
    const size_t shared_bytes = job.shared_bytes != 0 ? job.shared_bytes : CudaDevice(0).limits().shared_bytes;
    decodeFastCuda(args, kTestProcessors, shared_bytes, testStream().handle);
}
void launch(const DecodeFrame& frame, const DecodeJob& job, ExactSplat* splats)
{
    DeviceScene& scene = job.model->scene;
    scene.loadExact(testStream());
    if (scene.fastPossible())
        scene.useAppearance(job.appearance, testStream());
    const size_t shared_bytes = CudaDevice(0).limits().shared_bytes;
    const auto per_thread = uint32_t(decodeScratch(*job.view->params));
    const GuardedBuffer<float> scratch(exactScratchValues(per_thread, kTestProcessors));
    const DecodeExactArgs args{frame,
                               scene.exactView(),
                               job.appearance,
                               scene.exactWeights(),
                               scratch.count() != 0 ? scratch.get() : nullptr,
                               per_thread,
                               splats};
    decodeExactCuda(args, kTestProcessors, shared_bytes, testStream().handle);
    CHECK(scratch.intact());
}

struct PixelBox {
    float x0, y0, x1, y1;

    [[nodiscard]] bool empty() const { return std::ceil(x0) > std::floor(x1) || std::ceil(y0) > std::floor(y1); }
};

// Pixels of the image that a splat of this footprint can change: upstream's tiles, cut by the box of the ellipse on
// which alpha is 1/255. sign +1: all that rounding may add, -1: what is left at least.
PixelBox reachedPixels(const EyeParams& eye, bool gsplat, const Footprint<float>& f, float opacity, float sign)
{
    const int32_t radius = std::max(f.radius + int32_t(sign) * (1 + f.radius / 30), 0);
    const TileRect tiles = tileRect<float>(eye, gsplat, f.x, f.y, radius);
    const float rim = sign > 0 ? float(kTileSize) : 0.0f; // rim of the square: fast rounds it up to the next tile
    const float reach = std::max(2 * std::log(255 * opacity * (1 + 0.03f * sign)), 0.0f);
    const float whole = sign > 0 ? 1.1f : -0.1f; // the scalar kernel rounds to whole pixels
    const float ex = std::sqrt(reach * f.cov.a) * (1 + 0.05f * sign) + whole;
    const float ey = std::sqrt(reach * f.cov.c) * (1 + 0.05f * sign) + whole;
    const float right = float(eye.width) - 1, bottom = float(eye.height) - 1;
    return {std::max({f.x - ex, float(tiles.x0 * int32_t(kTileSize)) - rim, 0.0f}),
            std::max({f.y - ey, float(tiles.y0 * int32_t(kTileSize)) - rim, 0.0f}),
            std::min({f.x + ex, float(tiles.x1 * int32_t(kTileSize)) - 1 + rim, right}),
            std::min({f.y + ey, float(tiles.y1 * int32_t(kTileSize)) - 1 + rim, bottom})};
}

bool coversPixels(const BinBox& box, const PixelBox& pixels, uint32_t bin_height)
{
    return float(box.x0 * kBinWidth) <= std::ceil(pixels.x0) && float(box.y0 * bin_height) <= std::ceil(pixels.y0) &&
           float((box.x1 + 1) * kBinWidth - 1) >= std::floor(pixels.x1) &&
           float((box.y1 + 1) * bin_height - 1) >= std::floor(pixels.y1);
}

bool liesWithin(const BinBox& box, const PixelBox& pixels, uint32_t bin_height)
{
    return box.x0 >= uint32_t(pixels.x0) / kBinWidth && box.y0 >= uint32_t(pixels.y0) / bin_height &&
           box.x1 <= uint32_t(pixels.x1) / kBinWidth && box.y1 <= uint32_t(pixels.y1) / bin_height;
}

void raise(double& worst, double value)
{
    worst = value == value ? std::max(worst, std::abs(value)) : INFINITY;
}

} // namespace

DecodeJob decodeJob(const ModelView& view, StageModel& model, const std::vector<EyeParams>& eyes, uint32_t count)
{
    DecodeJob job{&view, &model, eyes, {}, {}, -1, gridOf(eyes, 16, 3), {}};
    const uint32_t anchors = model.scene.model().anchor_count;
    uint32_t stride = 37; // no divisor of any count below, so every anchor comes once
    while (anchors % stride == 0)
        ++stride;
    for (uint32_t i = 0; i < std::min(count, anchors); ++i) {
        const uint32_t seen_by = eyes.size() == 1 ? 1u : i % 5 == 0 ? 1u : i % 5 == 1 ? 2u : 3u;
        job.visible.push_back(uint32_t(uint64_t(i) * stride % anchors) | seen_by << kAnchorBits);
    }
    cutIntoPasses(job, 1);
    return job;
}

void cutIntoPasses(DecodeJob& job, uint32_t passes)
{
    job.passes = passes;
    job.slab_of = evenSlabs(1, 10, passes * job.grid.slabs());
}

template <typename Splat>
Decoded<Splat> decodeOnDevice(const DecodeJob& job)
{
    const auto eye_count = uint32_t(job.eyes.size());
    const uint32_t cells_per_eye = job.grid.cells();
    FrameCounters before{};
    before.anchors_listed = uint32_t(job.visible.size());
    const GuardedBuffer<uint32_t> visible(job.visible);
    const GuardedBuffer<float> fraction(job.fraction);
    const GuardedBuffer<uint16_t> slab_of(job.slab_of);
    const GuardedBuffer<uint32_t> cells(std::vector<uint32_t>(size_t(eye_count) * cells_per_eye, 0));
    const GuardedBuffer<SplatPlace> places(size_t(eye_count) * job.slot_capacity);
    const GuardedBuffer<Splat> splats(size_t(eye_count) * job.slot_capacity);
    const GuardedBuffer<uint16_t> touches(size_t(eye_count) * job.slot_capacity);
    const GuardedBuffer<FrameCounters> counters(std::vector<FrameCounters>{before});

    DecodeFrame frame{};
    frame.model = job.model->scene.model();
    std::copy(job.eyes.begin(), job.eyes.end(), frame.eyes);
    for (size_t e = 0; e < job.eyes.size(); ++e) {
        frame.lenses[e] = eyeLens(job.eyes[e]);
        frame.bands[e] = eyeBand(job.eyes[e], {});
    }
    frame.eye_count = eye_count;
    frame.rules = rasterConstants(*job.view->params, 0);
    frame.grid = job.grid;
    frame.pass = {slab_of.get(), job.pass, job.passes};
    frame.visible = visible.get();
    frame.fraction = job.fraction.empty() ? nullptr : fraction.get();
    frame.visible_count = &counters.get()->anchors_listed;
    frame.visible_capacity = uint32_t(job.visible.size());
    frame.places = places.get();
    frame.touches = touches.get();
    frame.cells = cells.get();
    frame.slot_capacity = job.slot_capacity;
    frame.counters = counters.get();
    frame.bank = job.model->scene.bank();
    frame.takes_distance = job.model->scene.takes(kMlpTakesDistance);
    frame.takes_level = job.model->scene.takes(kMlpTakesLevel);
    const GuardedBuffer<uint32_t> listed(job.visible.size());
    const GuardedBuffer<float> listed_fraction(job.fraction.size());
    if (job.passes > 1)
        listPass(frame, listed.get(), job.fraction.empty() ? nullptr : listed_fraction.get());
    launch(frame, job, splats.get());
    for (const bool whole :
         {listed.intact(), listed_fraction.intact(), visible.intact(), fraction.intact(), slab_of.intact(),
          cells.intact(), places.intact(), splats.intact(), touches.intact(), counters.intact()})
        CHECK(whole);

    Decoded<Splat> decoded{};
    decoded.counters = counters.read()[0];
    const std::vector<SplatPlace> all_places = places.read();
    const std::vector<Splat> all_splats = splats.read();
    const std::vector<uint16_t> all_touches = touches.read();
    std::vector<uint32_t> sums(size_t(eye_count) * cells_per_eye, 0);
    for (uint32_t e = 0; e < eye_count; ++e) {
        const uint32_t reserved = decoded.counters.pass.slots[e];
        uint32_t bad = 0, twice = 0;
        for (uint32_t i = 0; i < job.slot_capacity; ++i) {
            const size_t at = size_t(e) * job.slot_capacity + i;
            const SplatPlace& place = all_places[at];
            if (i >= reserved) { // poison still
                bad += place.box != ~0u || place.depth_bits != ~0u;
                continue;
            }
            if (place.box == kNoBins)
                continue;
            if (!isInGrid(unpackBox(place.box), job.grid)) {
                ++bad;
                continue;
            }
            forCells(job.grid, job.slab_of, place, [&](uint32_t cell) { ++sums[size_t(e) * cells_per_eye + cell]; });
            bad += job.passes > 1 && job.slab_of[bucketOf(place.depth_bits)] / job.grid.slabs() != job.pass;
            const Splat& splat = all_splats[at];
            twice += !decoded.eyes[e].emplace(splat.order, Emitted<Splat>{splat, place, all_touches[at]}).second;
        }
        CHECK(bad == 0);
        CHECK(twice == 0);
        CHECK(decoded.counters.splats[e] == decoded.eyes[e].size());
        CHECK(decoded.counters.splats[e] + decoded.counters.dropped[e] <= decoded.counters.gaussians[e]);
    }
    CHECK(cells.read() == sums);
    return decoded;
}

template Decoded<PackedSplat> decodeOnDevice<PackedSplat>(const DecodeJob&);
template Decoded<ExactSplat> decodeOnDevice<ExactSplat>(const DecodeJob&);

ReferenceEye decodeOnHost(const DecodeJob& job, uint32_t eye)
{
    const ModelView& view = *job.view;
    std::vector<SelectedAnchor<float>> selected;
    for (size_t i = 0; i < job.visible.size(); ++i) {
        if ((job.visible[i] >> kAnchorBits >> eye & 1) == 0)
            continue;
        const uint32_t anchor = job.visible[i] & ((1u << kAnchorBits) - 1);
        uint32_t chunk = 0;
        while (chunk + 1 < view.params->chunk_count && view.chunks[chunk + 1].anchor_first <= anchor)
            ++chunk;
        selected.push_back(
            {chunk, anchor - view.chunks[chunk].anchor_first, job.fraction.empty() ? 1.0f : job.fraction[2 * i + eye]});
    }
    ReferenceEye result;
    const RasterConstants rules = rasterConstants(*view.params, 0);
    for (const auto& g :
         decodeReference<float>(view, job.eyes[eye].center, selected, job.appearance, result.any_positive)) {
        const Footprint<float> f = projectGaussian<float>(job.eyes[eye], rules, g);
        result.dropped += !f.finite;
        result.gaussians.emplace(g.order, Reference{g, f});
    }
    return result;
}

template <typename Splat>
void checkSplats(const DecodeJob& job, const Decoded<Splat>& decoded, const DecodeTolerance& tolerance)
{
    const bool gsplat = rasterConstants(*job.view->params, 0).gsplat;
    for (uint32_t e = 0; e < job.eyes.size(); ++e) {
        CAPTURE(e);
        const EyeParams& eye = job.eyes[e];
        const ReferenceEye reference = decodeOnHost(job, e);
        const auto& found = decoded.eyes[e];
        uint32_t missing = 0, unknown = 0, unwanted = 0, misplaced = 0, other_tiles = 0, doubtful = 0,
                 dropped_doubtful = 0;
        DecodeTolerance worst{};
        for (const auto& [order, r] : reference.gaussians) {
            const Footprint<float>& f = r.footprint;
            const float opacity = r.gaussian.opacity;
            const bool at_floor = opacity < kOpacityFloor + float(tolerance.opacity);
            doubtful += at_floor;
            dropped_doubtful += at_floor && !f.finite;
            const PixelBox most = reachedPixels(eye, gsplat, f, opacity, 1),
                           least = reachedPixels(eye, gsplat, f, opacity, -1);
            const auto at = found.find(order);
            if (at == found.end()) {
                missing += f.finite && f.visible && !at_floor && !least.empty();
                continue;
            }
            if (!f.finite || f.radius == 0 || most.empty()) {
                ++unwanted;
                continue;
            }
            const BinBox box = unpackBox(at->second.place.box);
            misplaced += !liesWithin(box, most, job.grid.height) ||
                         (!least.empty() && !coversPixels(box, least, job.grid.height));
            other_tiles += !sameTiles(at->second.splat, f.tiles);
            const Plain p = plain(at->second.splat);
            raise(worst.pixel, double(at->second.splat.x) - double(f.x));
            raise(worst.pixel, double(at->second.splat.y) - double(f.y));
            raise(worst.opacity, p.opacity - double(opacity));
            for (int i = 0; i < 3; ++i)
                raise(worst.color, p.color[i] - double(r.gaussian.color[i]));
            raise(worst.depth, double(bitsFloat(at->second.place.depth_bits)) / double(f.depth) - 1);
            // note: compared as covariances; the inverse of a thin one multiplies every error by how thin it is
            const double det = p.conic[0] * p.conic[2] - p.conic[1] * p.conic[1], trace = double(f.cov.a) + f.cov.c;
            raise(worst.covariance, (p.conic[2] / det - double(f.cov.a)) / trace);
            raise(worst.covariance, (-p.conic[1] / det - double(f.cov.b)) / trace);
            raise(worst.covariance, (p.conic[0] / det - double(f.cov.c)) / trace);
        }
        for (const auto& [order, emitted] : found)
            if (reference.gaussians.count(order) == 0) {
                const bool at_floor = plain(emitted.splat).opacity < double(kOpacityFloor) + tolerance.opacity;
                unknown += !at_floor;
                doubtful += at_floor;
            }
        if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
            MESSAGE(found.size(), " splats, pixel ", worst.pixel, " covariance ", worst.covariance, " color ",
                    worst.color, " opacity ", worst.opacity, " depth ", worst.depth, " in doubt ", doubtful);
        CHECK(missing == 0);
        CHECK(unknown == 0);
        CHECK(unwanted == 0);
        CHECK(misplaced == 0);
        CHECK(other_tiles <= found.size() / 1000); // the last bit of a radius that is a whole number
        CHECK(worst.pixel <= tolerance.pixel);
        CHECK(worst.covariance <= tolerance.covariance);
        CHECK(worst.color <= tolerance.color);
        CHECK(worst.opacity <= tolerance.opacity);
        CHECK(worst.depth <= tolerance.depth);
        const auto differ = [](uint32_t a, size_t b) { return a > b ? a - b : b - a; };
        CHECK(differ(decoded.counters.gaussians[e], reference.gaussians.size()) <= doubtful);
        CHECK(differ(decoded.counters.dropped[e], reference.dropped) <= dropped_doubtful);
        CHECK((decoded.counters.any_positive[e] != 0) == reference.any_positive);
    }
}

template void checkSplats<PackedSplat>(const DecodeJob&, const Decoded<PackedSplat>&, const DecodeTolerance&);
template void checkSplats<ExactSplat>(const DecodeJob&, const Decoded<ExactSplat>&, const DecodeTolerance&);

} // namespace gsc::test
