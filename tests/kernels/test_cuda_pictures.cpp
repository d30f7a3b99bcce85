// SPDX-License-Identifier: Apache-2.0
// The bytes of pictures, so that a change that is to change none is known to change none. A hash that differs on purpose
// is replaced by what GSC_PRINT_HASHES=1 prints; the commit says why.
#include <gsc/checksum.h>
#include "tests/kernels/gpu_tools.h"
#include "tests/kernels/picture_hashes.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <functional>
#include <set>
#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr uint32_t kSide = 64; // pixels
constexpr uint32_t kAnchors = 400;

using Eyes = std::vector<EyeParams>;

struct Model {
    const char* name;
    SyntheticOptions options;
    bool fast; // the tier is possible
};

struct Job {
    std::string name;
    const Model* model;
    FrameOptions options;
    std::function<Eyes(int frame)> eyes;
    int frames = 1;
    bool passes = false; // several
};

SyntheticOptions levels(LevelRule rule, RasterRules raster = RasterRules::DiffGaussian)
{
    SyntheticOptions options = octree(rule, kAnchors, 60 + uint32_t(rule));
    options.raster_rules = raster;
    return options;
}

std::vector<Model> models()
{
    SyntheticOptions scaffold, appearance, bank, other;
    scaffold.anchors = appearance.anchors = bank.anchors = other.anchors = kAnchors;
    appearance.appearance_dim = 16;
    appearance.appearance_rows = 3;
    appearance.inputs = kMlpTakesAppearance;
    bank.flags = kModelFeatureBank | kModelBankDistance;
    bank.inputs = kMlpTakesDistance;
    other.feat_dim = 16;
    other.n_offsets = 5;
    SyntheticOptions gsplat = scaffold, large = scaffold;
    large.anchors = 6000 * kManyAnchors; // so that splats, not bins, are what memory is for
    large.log_scale = -3.5f;
    gsplat.raster_rules = RasterRules::Gsplat;
    return {{"scaffold", scaffold, true},
            {"floor", levels(LevelRule::Floor), true},
            {"round", levels(LevelRule::Round), true},
            {"ceil", levels(LevelRule::Ceil), true},
            {"progressive", levels(LevelRule::Progressive), true},
            {"gsplat", gsplat, true},
            {"gsplat_round", levels(LevelRule::Round, RasterRules::Gsplat), true},
            {"appearance", appearance, true},
            {"bank", bank, true},
            {"other_shape", other, false},
            {"large", large, true}};
}

Eyes turned(int frame, size_t count)
{
    const float x = 0.4f + 0.05f * float(frame), z = -5 + 0.02f * float(frame);
    Eyes eyes = {eyeAt(x, z, kSide, kSide), eyeAt(x + 0.3f, z, kSide, kSide)};
    eyes.resize(count);
    return eyes;
}

// Eyes that look the same way, and so share their bins.
Eyes parallel(int frame)
{
    const float x = 0.2f + 0.05f * float(frame);
    return {eyeAhead(x, -5, kSide, kSide), eyeAhead(x + 0.1f, -5, kSide, kSide)};
}

Eyes lensOffAxis()
{
    const Eyes eyes = parallel(0);
    return {offCentre(eyes[0], -0.15f, 0.1f), offCentre(eyes[1], 0.25f, 0.1f)};
}

std::vector<Job> jobs(const std::vector<Model>& all)
{
    std::vector<Job> list;
    const auto add = [&](const Model& model, const char* name, const FrameOptions& options,
                         std::function<Eyes(int)> eyes, int frames = 1, bool passes = false) {
        list.push_back({std::string(model.name) + "/" + name, &model, options, std::move(eyes), frames, passes});
    };
    const auto one = [](int frame) { return turned(frame, 1); };
    const auto two = [](int frame) { return turned(frame, 2); };
    const auto ahead = [](int frame) { return parallel(frame); };
    const FrameOptions exact = onGrey(Tier::Exact), fast = onGrey(Tier::Fast);
    const auto changed = [&](const FrameOptions& from, const std::function<void(FrameOptions&)>& change) {
        FrameOptions options = from;
        change(options);
        return options;
    };
    const FrameOptions merged = mergedEyes(fast);
    const FrameOptions merged_exact = mergedEyes(exact);
    for (const Model& model : all) {
        const int row = model.options.appearance_rows > 0 ? 2 : -1;
        const auto with_row = [&](const FrameOptions& from) {
            return changed(from, [&](FrameOptions& o) { o.appearance = row; });
        };
        add(model, "exact", with_row(exact), one);
        add(model, "exact_merged", with_row(merged_exact), two);
        if (!model.fast)
            continue;
        add(model, "fast", with_row(fast), two);
        add(model, "fast_merged", with_row(merged), two);
        add(model, "fast_shared", with_row(fast), ahead);
    }
    const Model &scaffold = all[0], &round = all[2], &progressive = all[4], &bank = all[8];
    add(scaffold, "exact_two", exact, two);
    add(scaffold, "off_axis", fast, [](int) { return lensOffAxis(); });
    add(scaffold, "near", changed(fast, [](FrameOptions& o) { o.near_z = 4; }), one);
    add(scaffold, "away", fast, [](int) { return Eyes{eyeAt(0, 50, kSide, kSide)}; });
    add(all.back(), "passes_exact", exact, two, 1, true);
    add(all.back(), "passes_shared", fast, ahead, 1, true);
    for (const float bias : {-1.0f, 1.5f})
        add(round, bias < 0 ? "coarser" : "finer", changed(fast, [&](FrameOptions& o) { o.lod_bias = bias; }), two);
    for (const Model* model : {&round, &progressive}) {
        add(*model, "fade_exact", changed(exact, [](FrameOptions& o) { o.lod_fade = 0.5f; }), one);
        add(*model, "fade_merged", changed(merged, [](FrameOptions& o) { o.lod_fade = 0.5f; }), two);
    }
    add(round, "hysteresis", changed(fast, [](FrameOptions& o) { o.lod_hysteresis = 0.5f; }), two, 3);
    const auto reuse = [&](ReusePolicy policy, const std::function<void(ReuseOptions&)>& change) {
        return changed(fast, [&](FrameOptions& o) {
            o.reuse.policy = policy;
            change(o.reuse);
        });
    };
    for (const Model* model : {&scaffold, &round}) {
        add(*model, "depth", reuse(ReusePolicy::Depth, [](ReuseOptions& r) { r.max_depth = 2; }), two, 4);
        FrameOptions paper = reuse(ReusePolicy::Depth, [](ReuseOptions& r) { r.max_depth = 2; });
        paper.stereo = StereoMode::Merged;
        add(*model, "depth_merged", paper, two, 4);
        add(*model, "depth_merged_shared", paper, ahead, 4);
        add(*model, "depth_shared", reuse(ReusePolicy::Depth, [](ReuseOptions& r) { r.max_depth = 2; }), ahead, 4);
        const FrameOptions little = reuse(ReusePolicy::Depth, [](ReuseOptions& r) {
            r.max_depth = 2;
            r.cache_bytes = uint64_t(30) << 10;
        });
        add(*model, "depth_small_cache", little, two, 4);
        paper.reuse = little.reuse;
        add(*model, "depth_merged_small_cache", paper, ahead, 4);
    }
    add(scaffold, "depth_exponential",
        reuse(ReusePolicy::Depth, [](ReuseOptions& r) { r.guidance = DepthGuidance::Exponential; }), one, 4);
    add(scaffold, "depth_staged",
        reuse(ReusePolicy::Depth, [](ReuseOptions& r) { r.guidance = DepthGuidance::Staged; }), one, 4);
    const FrameOptions kept = reuse(ReusePolicy::Depth, [](ReuseOptions&) {});
    add(bank, "depth", kept, two, 4);
    add(round, "depth_fade", changed(kept, [](FrameOptions& o) { o.lod_fade = 0.5f; }), two, 4);
    add(round, "depth_age", changed(kept, [](FrameOptions& o) { o.view = FrameView::Age; }), two, 4);
    add(scaffold, "depth_foveation", changed(kept, [](FrameOptions& o) { o.foveation.smallest = 2; }), two, 4);
    return list;
}

// Renders with less and less memory until a frame takes several passes.
std::vector<Image<float>> inPasses(const ModelView& model, const Job& job)
{
    Renderer& whole = cudaRenderer();
    whole.load(model);
    const uint64_t frame = render(whole, job.eyes(0), job.options)[0].result.bytes_resident;
    const uint64_t context = whole.device().context_bytes;
    for (uint64_t part = frame - context; part > 0; part = part * 13 / 16) {
        const auto gpu = open(model, {"cuda"}, {0, context + part});
        std::vector<Image<float>> images = render(*gpu, job.eyes(0), job.options);
        if (images[0].result.passes > 1)
            return images;
    }
    FAIL("never several passes");
    return {};
}

uint64_t hashOf(const Job& job, const ModelView& model)
{
    Checksum64 hash;
    const auto addPictures = [&](const std::vector<Image<float>>& images) {
        for (const Image<float>& image : images)
            hash.update(std::as_bytes(std::span(image.pixels)));
    };
    if (job.passes) {
        addPictures(inPasses(model, job));
        return hash.digest();
    }
    const auto gpu = open(model);
    for (int i = 0; i < job.frames; ++i)
        addPictures(render(*gpu, job.eyes(i), job.options));
    return hash.digest();
}

// Hash of the picture on the device that runs the test; 0 = none is known.
uint64_t expectedHash(const std::string& name)
{
    for (const PictureHash& known : kPictureHashes)
        if (name == known.job)
#ifdef GSC_CUDA_EMULATION
            return known.emulated;
#else
            return known.h200;
#endif
    return 0;
}

// Hash of the functions that the emulation takes from the C library, whose last bits differ from machine to machine.
[[maybe_unused]] uint64_t mathHash()
{
    Checksum64 hash;
    for (int i = -4000; i < 4000; ++i) {
        const float x = 0.003f * float(i);
        const float values[] = {
            std::exp(x), std::exp2(x), std::log(1.0f + std::abs(x)), std::log2(1.0f + std::abs(x)), std::sin(x),
            std::cos(x), std::tanh(x)};
        hash.update(std::as_bytes(std::span(values)));
    }
    return hash.digest();
}

} // namespace

TEST_CASE("pictures have the bytes they had")
{
#ifndef GSC_CUDA_EMULATION
    const std::string device = cudaRenderer().device().name;
    if (device.find("H200") == std::string::npos) {
        MESSAGE("the hashes are those of an H200, not compared on ", device);
        return;
    }
#else
    if (mathHash() != kEmulatedMath) {
        MESSAGE("the emulation's hashes are of another C library's exp and log, not compared: ", mathHash());
        return;
    }
#endif
    const std::vector<Model> all = models();
    const std::vector<Job> list = jobs(all);
    CHECK(list.size() >= 60);
    std::set<uint64_t> different;
    std::string loaded;
    std::unique_ptr<SyntheticModel> model;
    for (const Job& job : list) {
        CAPTURE(job.name);
        if (loaded != job.model->name) {
            model = std::make_unique<SyntheticModel>(job.model->options);
            loaded = job.model->name;
        }
        const uint64_t hash = hashOf(job, model->view());
        different.insert(hash);
        if (std::getenv("GSC_PRINT_HASHES") != nullptr)
            std::printf("hash %s 0x%016llx\n", job.name.c_str(), static_cast<unsigned long long>(hash));
        else
            CHECK(hash == expectedHash(job.name));
    }
    CHECK(different.size() > list.size() * 3 / 4); // jobs that draw the same would test the same
}
