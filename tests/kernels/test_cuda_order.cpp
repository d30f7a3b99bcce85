// SPDX-License-Identifier: Apache-2.0
// The order cache on a GPU: what it notes of a frame, that lists come cut finer for it, and that no picture changes.
#include "kernels/sort/order_cuda.h"
#include "runtime/order_cuda.h"
#include "tests/kernels/gpu_stage.h"
#include "tests/kernels/reuse_tools.h"

#include <doctest/doctest.h>

#include <cstdlib>

using namespace gsc;
using namespace gsc::test;

namespace {

// Near anchors whose Gaussians fill a small image, and five times as many far ones whose Gaussians all lie beside it:
// the depths of the anchors say nearly nothing of those of the splats.
struct LopsidedModel {
    static constexpr uint32_t kNear = 380;
    SyntheticModel model;

    explicit LopsidedModel(uint32_t seed = 1) : model(params(seed), anchors(seed), randomMlps(options(seed)), {}, 0) {}

    static SyntheticOptions options(uint32_t seed)
    {
        SyntheticOptions options;
        options.anchors = 6 * kNear;
        options.encoding = PositionEncoding::Float;
        options.log_scale = -2.6f;
        options.seed = seed;
        return options;
    }
    static ModelParams params(uint32_t seed) { return syntheticParams(options(seed)); }
    static SyntheticAnchors anchors(uint32_t seed)
    {
        const SyntheticOptions how = options(seed);
        SyntheticAnchors anchors = randomAnchors(how);
        Random random(how.seed);
        for (uint32_t i = 0; i < how.anchors; ++i) {
            const bool near = i < kNear;
            const float z = near ? random.uniform(3, 5) : random.uniform(40, 80), wide = near ? 0.9f : 8.0f;
            anchors.position[3 * i] = random.uniform(-wide, wide);
            anchors.position[3 * i + 1] = 0.3f - 0.05f * z + random.uniform(-wide, wide); // about where eyes look
            anchors.position[3 * i + 2] = z;
            for (uint32_t k = 0; !near && k < how.n_offsets; ++k)
                anchors.offset[(size_t(i) * how.n_offsets + k) * 3] = 1e5f;
        }
        return anchors;
    }
};

std::vector<EyeParams> small(size_t eye_count, float x = 0)
{
    std::vector<EyeParams> eyes;
    for (size_t e = 0; e < eye_count; ++e)
        eyes.push_back(eyeAhead(x + 0.02f * float(e), 0, 64, 32));
    return eyes;
}

FrameOptions ordered(FrameOptions options)
{
    options.reuse.order = true;
    return options;
}

uint64_t pairsOf(const FrameResult& result)
{
    return result.eyes[0].pairs + result.eyes[1].pairs;
}

struct Step {
    std::vector<EyeParams> eyes;
    const char* what;
};

// A walk, turns, jumps, a view of nothing, and other numbers and sizes of eyes in between.
std::vector<Step> path()
{
    std::vector<Step> steps;
    for (int i = 0; i < 3; ++i)
        steps.push_back({walk(i, 1), "walk"});
    const float at[3] = {0.3f, 0.2f, -1}, targets[4][3] = {{1, 0, 3}, {3, 0, 1}, {0, 0, -4}, {0.1f, 0, 4}};
    for (const auto& target : targets)
        steps.push_back({{lookAt(at, target, 0.9f, 120, 90)}, "turn"});
    const float far_off[3] = {0, 0, -90}, away[3] = {0, 0, -190}, middle[3] = {0, 0, 0};
    steps.push_back({{lookAt(far_off, middle, 0.06f, 120, 90)}, "jump"});
    steps.push_back({{lookAt(far_off, away, 0.9f, 120, 90)}, "nothing"});
    steps.push_back({walk(1, 1), "jump back"});
    for (int i = 2; i < 5; ++i)
        steps.push_back({walk(i, 2), "two eyes"});
    for (int i = 0; i < 3; ++i)
        steps.push_back({strafe(0.05f * float(i), 2, 0.06f), "eyes that look the same way"});
    steps.push_back({walk(5, 1), "one eye"});
    steps.push_back({{eyeAt(0.3f, -5, 70, 150)}, "another size"});
    return steps;
}

} // namespace

TEST_CASE("order: every nth key is counted at its depth, in a frame that stands alone")
{
    for (const uint32_t count : {0u, 1u, 500u, kOrderSamples, kOrderSamples + 1, 3 * kOrderSamples - 7})
        for (const bool repeats : {false, true}) {
            CAPTURE(count);
            CAPTURE(repeats);
            Random random(count + 1);
            std::vector<BinKey> keys(count);
            std::vector<SplatPlace> places(count);
            for (uint32_t i = 0; i < count; ++i) {
                keys[i] = {0, count - 1 - i}; // after the sort, only this means something
                places[i] = {floatBits(random.uniform(0.01f, 500)), 0};
            }
            FrameCounters counters{};
            counters.overflow = repeats ? kPairOverflow : 0u;
            counters.pass.pairs[0] = count / 3; // of two lists per bin
            counters.pass.pairs[1] = count - count / 3;
            std::vector<uint32_t> want(kDepthBuckets, 2);
            const uint32_t step = (count + kOrderSamples - 1) / kOrderSamples;
            for (uint32_t i = 0; i < count && !repeats; i += step)
                ++want[bucketOf(places[keys[i].slot].depth_bits)];
            const GuardedBuffer<BinKey> key_buffer(keys);
            const GuardedBuffer<SplatPlace> place_buffer(places);
            const GuardedBuffer<uint32_t> next(std::vector<uint32_t>(kDepthBuckets, 2));
            const GuardedBuffer<FrameCounters> counter_buffer(std::vector<FrameCounters>{counters});
            noteOrderCuda({key_buffer.get(), place_buffer.get(), 2, next.get(), counter_buffer.get()},
                          testStream().handle);
            CHECK(next.intact());
            CHECK(next.read() == want);
        }
}

TEST_CASE("order: a frame reads what the last one noted, if it did")
{
    MemoryBudget budget;
    CudaOrder order(budget);
    CHECK(order.needsMemory());
    order.prepare();
    CHECK(!order.needsMemory());
    CHECK(order.bytes() >= 2 * kDepthBuckets * sizeof(uint32_t));
    CHECK(budget.used == order.bytes());
    CHECK(order.job().known == nullptr);
    for (int frame = 0; frame < 3; ++frame) {
        const OrderJob job = order.job();
        CHECK(job.next != nullptr);
        CHECK(job.known != job.next);
        CHECK(order.job().known == job.known); // however often it is drawn
        order.end();
        CHECK(order.known());
        CHECK(order.job().known == job.next);
    }
    order.forget();
    CHECK(order.job().known == nullptr);
    order.end();
    order.drop();
    CHECK(budget.used == 0);
    CHECK(order.needsMemory());
    order.prepare();
    CHECK(order.job().known == nullptr);
}

TEST_CASE("order: no byte of any frame changes, over a path with jumps, for one eye and two, whatever else is reused")
{
    SyntheticOptions dense = modelOptions();
    dense.anchors = 3000;
    dense.log_scale = -2.8f;
    const SyntheticModel model(dense);
    FrameOptions merged = onGrey(Tier::Fast);
    merged.stereo = StereoMode::Merged;
    for (const FrameOptions& how :
         {onGrey(Tier::Fast), onGrey(Tier::Exact), merged, with(ReusePolicy::Error, 1), with(ReusePolicy::Depth)}) {
        CAPTURE(uint32_t(how.tier));
        CAPTURE(uint32_t(how.stereo));
        CAPTURE(uint32_t(how.reuse.policy));
        const auto plain = open(model.view()), cached = open(model.view());
        uint64_t known = 0, moved = 0;
        for (const Step& step : path()) {
            CAPTURE(step.what);
            const auto want = render(*plain, step.eyes, how), got = render(*cached, step.eyes, ordered(how));
            for (size_t e = 0; e < want.size(); ++e) {
                CHECK(sameBytes(got[e].pixels, want[e].pixels));
                CHECK(got[e].result.eyes[e].pairs == want[e].result.eyes[e].pairs);
            }
            const FrameResult &a = got[0].result, &b = want[0].result;
            CHECK(b.order_moves == 0);
            CHECK(a.order_moves <= pairsOf(a));
            CHECK(a.cache_bytes > b.cache_bytes);
            known += a.order_moves < pairsOf(a) ? pairsOf(a) : 0;
            moved += a.order_moves < pairsOf(a) ? a.order_moves : 0;
        }
        CHECK(known > 100000);
        CHECK(moved < known / 2);
        if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
            MESSAGE(moved, " of ", known, " keys in long pieces");
    }
}

// Of four slabs: without the cache all keys share one, and with it they have three.
TEST_CASE("order: lists of which the anchors know nothing come cut as finely as their last order says, and only theirs")
{
    const LopsidedModel lopsided, other(2);
    for (const Tier tier : {Tier::Fast, Tier::Exact})
        for (const size_t eye_count : {1, 2}) {
            CAPTURE(uint32_t(tier));
            CAPTURE(eye_count);
            const FrameOptions off = onGrey(tier), on = ordered(off);
            const auto gpu = open(lopsided.model.view());
            const auto draw = [&](const FrameOptions& options, float x = 0) {
                return render(*gpu, small(eye_count, x), options)[0].result;
            };
            const auto checkKnown = [&](const FrameResult& result) {
                CHECK(result.order_moves < pairsOf(result) * 3 / 4);
                CHECK(result.order_moves > 0); // counted at all
                if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
                    MESSAGE(result.order_moves, " of ", pairsOf(result));
            };
            const auto checkFirst = [&](const FrameResult& result) {
                CHECK(pairsOf(result) > 2000);
                CHECK(result.order_moves == pairsOf(result)); // all of them: there was no order
            };
            CHECK(draw(off).cache_bytes == 0);
            const std::vector<EyeParams> wide(eye_count, eyeAhead(0, 0, 96, 32)); // other bins, and more of them
            (void)render(*gpu, wide, on);
            CHECK(draw(off).cache_bytes > 0); // from here on no memory moves, and frames of both kinds are to be had
            checkFirst(draw(on));
            for (int i = 0; i < 3; ++i)
                checkKnown(draw(on, 0.01f * float(i)));
            CHECK(draw(off).order_moves == 0);
            checkFirst(draw(on));
            checkKnown(draw(on));
            gpu->dropCaches();
            CHECK(draw(off).cache_bytes == 0);
            checkFirst(draw(on));
            checkKnown(draw(on));
            CHECK(draw(on).cache_bytes > 0);
            gpu->load(other.model.view());
            checkFirst(draw(on));
            checkKnown(draw(on));
        }
}

TEST_CASE("order: what a frame of several passes shows is not noted, and what was noted before is forgotten")
{
    SyntheticOptions options = modelOptions();
    options.anchors = 6000 * kManyAnchors;
    options.log_scale = -3.5f;
    const SyntheticModel model(options);
    const FrameOptions on = ordered(onGrey(Tier::Exact)); // whose sums round alike however many passes there are
    const auto ample = open(model.view());
    const auto want = render(*ample, walk(0, 2), on);
    uint32_t most = 1;
    const uint64_t context = ample->device().context_bytes; // which no budget makes smaller
    for (uint64_t part = want[0].result.bytes_resident - context;; part = part * 14 / 16) {
        const uint64_t budget = context + part;
        CAPTURE(budget);
        const std::unique_ptr<Backend> gpu = makeBackend("cuda", 0);
        gpu->setMemoryBudget(budget);
        try {
            gpu->load(model.view());
            bool known = false; // from the frame before
            for (int i = 0; i < 4; ++i) {
                const auto got = render(*gpu, i == 2 ? strafe(90, 2) : walk(0, 2), on); // the third shows nothing
                const FrameResult& result = got[0].result;
                if (i != 2)
                    for (size_t e = 0; e < 2; ++e)
                        CHECK(sameBytes(got[e].pixels, want[e].pixels));
                if (result.passes > 1 || !known)
                    CHECK(result.order_moves == pairsOf(result));
                else if (pairsOf(result) > 0)
                    CHECK(result.order_moves < pairsOf(result));
                known = result.passes == 1;
                most = std::max(most, result.passes);
            }
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::OutOfMemory);
            break;
        }
    }
    CHECK(most > 1);
}

TEST_CASE(
    "order: a frame that is drawn again for want of room goes by the order of the frame before, and leaves its own")
{
    SyntheticOptions options = modelOptions();
    options.anchors = 500;
    options.log_scale = 0.1f; // more bins of every splat than there is room for at first
    const SyntheticModel model(options);
    for (const Tier tier : {Tier::Fast, Tier::Exact}) {
        CAPTURE(uint32_t(tier));
        const FrameOptions on = ordered(onGrey(tier));
        // about half of all, then all, for which the buffers are too small
        const float at[3] = {0, 0.3f, -8}, beside[3] = {8, 0.25f, 0};
        const std::vector<std::vector<EyeParams>> frames = {
            {lookAt(at, beside, 1.1f, 192, 240)}, {eyeAhead(0, -8, 192, 240)}, {eyeAhead(0, -8, 192, 240)}};
        const auto fresh = open(model.view()), warm = open(model.view());
        (void)render(*warm, frames[1], onGrey(tier));
        warm->dropCaches(); // has the buffers, and nothing else of that frame
        uint32_t repeats = 0;
        for (size_t i = 0; i < frames.size(); ++i) {
            CAPTURE(i);
            const auto a = render(*fresh, frames[i], on), b = render(*warm, frames[i], on);
            repeats += i > 0 ? a[0].result.repeats : 0;
            CHECK(a[0].result.passes == 1); // of several there is no order
            CHECK(b[0].result.repeats == 0);
            CHECK(sameBytes(a[0].pixels, b[0].pixels));
            CHECK(a[0].result.order_moves == b[0].result.order_moves);
            if (i > 0)
                CHECK(a[0].result.order_moves < pairsOf(a[0].result));
            if (std::getenv("GSC_TEST_VERBOSE") != nullptr)
                MESSAGE(a[0].result.order_moves, " of ", pairsOf(a[0].result), ", repeats ", a[0].result.repeats);
        }
#ifdef GSC_CUDA_EMULATION
        CHECK(repeats > 0);
#endif
    }
}
