// SPDX-License-Identifier: Apache-2.0
// Selection on the device against the flat scalar pass: the same set, whatever the model, the rule and the eyes.
#include "kernels/select/select.h"
#include "kernels/select/select_cuda.h"
#include "tests/backends/selection.h"
#include "tests/kernels/gpu_stage.h"

#include "kernels/math/anchor.h"
#include "kernels/math/lod.h"
#include "kernels/math/projection.h"

#include <doctest/doctest.h>

#include <map>
#include <memory>
#include <set>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Seen {
    uint32_t eyes = 0;
    float fraction[kMaxEyes] = {1, 1};
};

using SeenAnchors = std::map<uint32_t, Seen>; // by index in the file

struct DeviceSelection {
    SeenAnchors seen;
    uint32_t written = 0; // entries of the list
    FrameCounters counters{};
    std::vector<uint32_t> histogram;
};

DeviceSelection selectOnDevice(const StageModel& model, const std::vector<EyeParams>& eyes, float lod_bias,
                               uint32_t capacity, float lod_fade = 0, uint32_t runs = UINT32_MAX)
{
    const ModelParams& params = model.scene.model().params;
    const auto group_count = uint32_t(params.group_count);
    const bool fades = levelsFade(params, lod_fade);
    const GuardedBuffer<uint32_t> groups(group_count), visible(capacity);
    const GuardedBuffer<float> fraction(fades ? size_t(2) * capacity : 0);
    const GuardedBuffer<uint32_t> histogram(std::vector<uint32_t>(kDepthBuckets, 0));
    const GuardedBuffer<FrameCounters> counters(std::vector<FrameCounters>{FrameCounters{}});

    SelectCudaArgs args{};
    args.model = model.scene.model();
    args.run_count = std::min(runs, model.scene.runsThere());
    std::copy(eyes.begin(), eyes.end(), args.level_eyes);
    args.eye_count = uint32_t(eyes.size());
    args.rules = rasterConstants(params, 0);
    args.lod_bias = lod_bias;
    args.lod_fade = lod_fade;
    args.visible_groups = groups.get();
    args.listed_groups = groups.get();
    args.group_count = &counters.get()->groups_visible;
    args.visible = visible.get();
    args.fraction = fades ? fraction.get() : nullptr;
    args.capacity = capacity;
    args.histogram = histogram.get();
    args.counters = counters.get();
    selectGroupsCuda(args, kTestProcessors, testStream().handle);
    selectAnchorsCuda(args, kTestProcessors, testStream().handle);

    CHECK(groups.intact());
    CHECK(visible.intact());
    CHECK(fraction.intact());
    CHECK(histogram.intact());
    CHECK(counters.intact());
    DeviceSelection result;
    result.counters = counters.read()[0];
    result.histogram = histogram.read();

    const std::vector<uint32_t> listed_groups = groups.read();
    REQUIRE(result.counters.groups_visible <= group_count);
    std::set<uint32_t> distinct;
    for (uint32_t i = 0; i < group_count; ++i)
        if (i < result.counters.groups_visible)
            distinct.insert(listed_groups[i] & ((1u << kAnchorBits) - 1));
        else
            CHECK(listed_groups[i] == ~0u);
    CHECK(distinct.size() == result.counters.groups_visible);
    CHECK((distinct.empty() || *distinct.rbegin() < group_count));

    const std::vector<uint32_t> entries = visible.read();
    const std::vector<float> fractions = fraction.read();
    result.written = std::min(result.counters.anchors_listed, capacity);
    for (uint32_t i = 0; i < capacity; ++i) {
        if (i >= result.written) {
            CHECK(entries[i] == ~0u);
            continue;
        }
        Seen seen{entries[i] >> kAnchorBits, {1, 1}};
        if (fades)
            std::copy_n(fractions.begin() + 2 * i, 2, seen.fraction);
        result.seen.emplace(entries[i] & ((1u << kAnchorBits) - 1), seen);
    }
    CHECK(result.seen.size() == result.written); // no anchor twice
    return result;
}

struct Wanted {
    SeenAnchors seen;
    uint32_t visible[kMaxEyes] = {};
    std::set<uint32_t> chunks[kMaxEyes]; // with a visible anchor
    std::set<uint32_t> buckets;          // buckets of the depths of all visible anchors
};

Wanted selectOnHost(const ModelView& model, const std::vector<EyeParams>& eyes, float lod_bias, float lod_fade = 0)
{
    Wanted wanted;
    for (uint32_t e = 0; e < eyes.size(); ++e)
        for (const auto& anchor :
             selectReference<float>(model, eyes[e], rasterConstants(*model.params, 0), lod_bias, lod_fade)) {
            Seen& seen = wanted.seen[model.chunks[anchor.chunk].anchor_first + anchor.local];
            seen.eyes |= 1u << e;
            seen.fraction[e] = anchor.fraction;
            ++wanted.visible[e];
            wanted.chunks[e].insert(anchor.chunk);
            const float z = viewPoint<float>(eyes[e], anchorPosition(model, anchor.chunk, anchor.local)).z;
            wanted.buckets.insert(bucketOf(floatBits(std::max(z, 0.0f))));
        }
    return wanted;
}

Selected checkSelection(const ModelView& view, const StageModel& model, const std::vector<EyeParams>& eyes,
                        float lod_bias, float lod_fade)
{
    const Wanted wanted = selectOnHost(view, eyes, lod_bias, lod_fade);
    const DeviceSelection found = selectOnDevice(model, eyes, lod_bias, model.scene.model().anchor_count, lod_fade);
    const FrameCounters& counters = found.counters;
    Selected checked{.listed = wanted.seen.size(), .visible = size_t(wanted.visible[0]) + wanted.visible[1]};
    CHECK(counters.overflow == 0);
    CHECK(counters.anchors_listed == wanted.seen.size());
    CHECK(found.seen.size() == wanted.seen.size());
    uint32_t missing = 0, other_eyes = 0;
    float worst = 0;
    for (const auto& [anchor, seen] : wanted.seen) {
        const auto at = found.seen.find(anchor);
        if (at == found.seen.end()) {
            ++missing;
            continue;
        }
        other_eyes += at->second.eyes != seen.eyes;
        for (uint32_t e = 0; e < eyes.size(); ++e)
            if (seen.eyes >> e & 1)
                worst = std::max(worst, std::abs(at->second.fraction[e] - seen.fraction[e]));
    }
    CHECK(missing == 0);
    CHECK(other_eyes == 0);
    // the fraction of a level of about 4, in widths of a transition: two ulp of it, which is what log2f is off by on a device
    CHECK(worst <= 1e-6f / (lod_fade > 0 ? lod_fade : 1.0f));

    uint64_t sum = 0;
    bool known = true;
    for (uint32_t b = 0; b < kDepthBuckets; ++b) {
        sum += found.histogram[b];
        known &= found.histogram[b] == 0 || wanted.buckets.count(b) != 0;
    }
    CHECK(sum == checked.visible);
    CHECK(known);
    for (uint32_t e = 0; e < eyes.size(); ++e) {
        CHECK(counters.anchors_visible[e] == wanted.visible[e]);
        CHECK(counters.anchors_tested[e] >= wanted.visible[e]);
        CHECK(counters.anchors_tested[e] <= uint64_t(counters.groups_tested[e]) * kGroupSize);
        uint64_t shown = 0;
        for (const uint32_t chunk : wanted.chunks[e])
            shown += view.chunks[chunk].group_count;
        CHECK(counters.groups_tested[e] >= shown);
        CHECK(counters.groups_tested[e] <= view.params->group_count);
        checked.groups_tested += counters.groups_tested[e];
    }
    CHECK(counters.groups_visible <= checked.groups_tested);
    return checked;
}

const std::vector<EyeParams> kTwoEyes = {eyeAt(0.4f, -5, 150, 110), eyeAt(0.7f, -5, 150, 110)};

} // namespace

CheckSelection gsc::test::selectionOf(const ModelView& model)
{
    return [&model, there = std::make_shared<StageModel>(model)](const std::vector<EyeParams>& eyes, float lod_bias,
                                                                 float lod_fade) {
        return checkSelection(model, *there, eyes, lod_bias, lod_fade);
    };
}

TEST_CASE("select: the groups of a chunk beyond one run, the last of them short")
{
    SyntheticOptions options{.anchors = 3 * kRunGroups * kGroupSize - 300, .feat_dim = 4, .n_offsets = 1};
    options.extent = 12; // eight chunks
    const SyntheticModel synthetic(options);
    REQUIRE(synthetic.view().params->chunk_count == 8);
    const StageModel model(synthetic.view());
    CHECK(model.scene.model().run_count >= 8);
    for (const auto& eyes : {kTwoEyes, {eyeAt(0.2f, -1, 90, 140), eyeAt(2.4f, -3, 61, 40)}}) // and from within
        checkSelection(synthetic.view(), model, eyes, 0, 0);
}

TEST_CASE("select: a list that is too short is filled, not overrun, and says so")
{
    SyntheticOptions options{.anchors = 900, .feat_dim = 4, .n_offsets = 1, .levels = 3, .flags = kModelHasLevels};
    options.level_rule = LevelRule::Progressive; // its fractions are a second list
    const SyntheticModel synthetic(options);
    const StageModel model(synthetic.view());
    const Wanted wanted = selectOnHost(synthetic.view(), kTwoEyes, 0);
    const auto needed = uint32_t(wanted.seen.size());
    REQUIRE(needed > 200);
    for (const uint32_t capacity : {needed, needed - 1, needed / 2, 129u, 1u, 0u}) {
        CAPTURE(capacity);
        const DeviceSelection found = selectOnDevice(model, kTwoEyes, 0, capacity);
        CHECK(found.counters.overflow == (capacity < needed ? kVisibleOverflow : 0u));
        CHECK(found.counters.anchors_listed == needed); // size that the list grows to
        CHECK(found.counters.anchors_visible[0] == wanted.visible[0]);
        CHECK(found.counters.anchors_visible[1] == wanted.visible[1]);
        CHECK(found.written == capacity);
        for (const auto& [anchor, seen] : found.seen) {
            const auto at = wanted.seen.find(anchor);
            CHECK((at != wanted.seen.end() && at->second.eyes == seen.eyes));
        }
    }
}

TEST_CASE("select: needles so long that rounding leaves no determinant above zero in the middle of the image")
{
    SyntheticOptions options{.anchors = 1500};
    SyntheticAnchors anchors = randomAnchors(options);
    ModelParams params = syntheticParams(options);
    for (int i = 0; i < 4; ++i)
        params.constant_rotation[i] = i == 0 ? 0.9f : i == 3 ? 0.4f : 0.0f; // about the eye's axis
    const std::vector<EyeParams> eyes = {eyeAt(0.4f, -5, 60000, 50000)};
    uint32_t flattened = 0; // upstream draws those below zero and gives up those of zero
    for (const bool needles : {false, true}) {
        CAPTURE(needles);
        for (size_t i = 0; needles && i < anchors.count(); ++i)
            for (size_t axis = 0; axis < 3; ++axis) // exponentials 1, 0 and 0: equal on every device, unlike others
                anchors.scale[6 * i + axis] = axis == 0 ? 0.0f : -1000.0f;
        const SyntheticModel model(params, anchors, randomMlps(options), {}, 0);
        const StageModel stage(model.view());
        checkSelection(model.view(), stage, eyes, 0, 0);
        for (uint32_t i = 0; needles && i < anchors.count(); ++i) {
            const float scale[3] = {1, 0, 0};
            float q[4];
            std::copy_n(params.constant_rotation, 4, q);
            normalizeQuaternion(q);
            const Footprint<float> f =
                footprint<float>(eyes[0], rasterConstants(params, 0), anchorPosition(model.view(), 0, i), scale, q);
            flattened += f.depth > 0.2f && !(determinant(f.cov) > 0.0f) ? 1u : 0u;
        }
    }
    CHECK(flattened >= 3);
}

TEST_CASE("of a model that is on its way, anchors of the first runs are selected as of the whole, and no others")
{
    const SyntheticModel model({.anchors = 3000, .extent = 40});
    const StageModel on_device(model.view());
    const std::vector<EyeParams> eyes = {eyeAt(1, -30, 64, 64)};
    const DeviceModel& device = on_device.scene.model();
    const SeenAnchors all = selectOnDevice(on_device, eyes, 0, 3000).seen;
    const uint32_t runs = device.run_count / 2;
    const SeenAnchors some = selectOnDevice(on_device, eyes, 0, 3000, 0, runs).seen;
    std::vector<GroupRun> listed(device.run_count);
    GSC_CUDA_CHECK(cudaMemcpyAsync(listed.data(), device.runs, listed.size() * sizeof(GroupRun), cudaMemcpyDeviceToHost,
                                   testStream().handle));
    GSC_CUDA_CHECK(cudaStreamSynchronize(testStream().handle));
    const uint32_t end = model.view().groups[listed[runs].group_first].anchor_first;
    CHECK(some.size() == size_t(std::distance(all.begin(), all.lower_bound(end))));
    CHECK((some.size() > 100 && some.size() < all.size()));
    CHECK((some.empty() || some.rbegin()->first < end));
}
