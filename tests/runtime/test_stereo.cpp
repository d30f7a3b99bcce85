// SPDX-License-Identifier: Apache-2.0
// Eyes with lenses of their own: their images, and one decode for both.
#include <gsc/error.h>
#include "runtime/view/stereo.h"
#include "tests/kernels/render_tools.h"
#include "tests/runtime/eye_pairs.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Rect {
    uint32_t x, y, width, height;
};

// Part of an image of the given width.
std::vector<float> cut(const std::vector<float>& pixels, uint32_t width, const Rect& r)
{
    std::vector<float> part;
    for (uint32_t y = r.y; y < r.y + r.height; ++y)
        part.insert(part.end(), pixels.begin() + 3 * (size_t(y) * width + r.x),
                    pixels.begin() + 3 * (size_t(y) * width + r.x + r.width));
    return part;
}

} // namespace

namespace {

SyntheticOptions withRule(LevelRule rule)
{
    SyntheticOptions options = octree(rule, 1500, 1);
    options.inputs = kMlpTakesDistance;
    return options;
}

// Two eyes at z = -5 whose images share a part; the second one's lens leans by `lean`.
std::vector<EyeParams> eyesApart(float apart, float lean)
{
    std::vector<EyeParams> eyes;
    for (const float side : {-0.5f, 0.5f}) {
        const float position[3] = {side * apart, 0.3f, -5}, target[3] = {side * apart, -0.2f, 0.3f};
        eyes.push_back(offCentre(lookAt(position, target, 0.5f, 130, 100), side * lean, 0));
    }
    return eyes;
}

FrameOptions merged()
{
    FrameOptions options;
    options.stereo = StereoMode::Merged;
    options.background[1] = 0.5f;
    return options;
}

std::unique_ptr<Renderer> open(CpuPath path, int threads, const ModelView& model)
{
    std::unique_ptr<Renderer> backend = makeCpuRenderer(path, threads);
    backend->load(model);
    return backend;
}

} // namespace

TEST_CASE("one decode for two lenses at one place is the exact one, and so is that of a single eye")
{
    const SyntheticModel model(withRule(LevelRule::Progressive));
    const auto backend = open(CpuPath::Fast, 2, model.view());
    FrameOptions exact = merged();
    exact.stereo = StereoMode::Exact;
    for (const std::vector<EyeParams>& eyes : {eyesApart(0, 0.2f), {eyesApart(0, 0.2f)[1]}}) {
        const auto together = render(*backend, eyes, merged()), apart = render(*backend, eyes, exact);
        for (size_t e = 0; e < eyes.size(); ++e)
            CHECK(together[e].pixels == apart[e].pixels);
    }
}

TEST_CASE("one decode for both eyes is refused beside reuse by error")
{
    const SyntheticModel model(withRule(LevelRule::None));
    const auto backend = open(CpuPath::Fast, 1, model.view());
    FrameOptions options = merged();
    options.reuse.policy = ReusePolicy::Error;
    const Outcome refused = outcomeOf([&] { (void)render(*backend, eyesApart(0.1f, 0), options); });
    CHECK(refused.code == ErrorCode::Unsupported);
}

// An image whose axis is off its middle is part of a wider one that is centred. Cut on multiples of 16 pixels, both
// give every Gaussian the same tiles. Differences remain from fp32, and near the borders: anchors that the narrower eye
// does not select, and the clamp of the Jacobian, which begins 0.15 widths outside each image.
TEST_CASE("off-centre and canted eyes draw what a wider centred image shows there")
{
    constexpr uint32_t kWidth = 320, kHeight = 256, kMargin = 32;
    const double pixel = 1.0 / 160; // tangent: 90 degrees across the wide image
    Random random(31);
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat}) {
        const SyntheticModel model({.anchors = 1500, .raster_rules = raster});
        for (const Rect part : {Rect{0, 0, 224, 192}, {96, 64, 224, 192}, {48, 0, 160, 240}, {176, 96, 144, 160}}) {
            CAPTURE(part.x);
            Camera head;
            head.translation[2] = 7; // the model lies ahead
            EyeView view;
            view.left = std::atan((double(part.x) - kWidth / 2.0) * pixel);
            view.right = std::atan((double(part.x + part.width) - kWidth / 2.0) * pixel);
            view.up = -std::atan((double(part.y) - kHeight / 2.0) * pixel);
            view.down = -std::atan((double(part.y + part.height) - kHeight / 2.0) * pixel);
            view.position[0] = double(random.uniform(-0.5f, 0.5f));
            view.position[1] = double(random.uniform(-0.5f, 0.5f));
            randomRotation(random, 0.25f, view.rotation);
            head.width = part.width;
            head.height = part.height;
            const Camera off = eyeOfHead(head, view);
            Camera wide;
            std::copy_n(off.rotation, 9, wide.rotation);
            std::copy_n(off.translation, 3, wide.translation);
            wide.width = kWidth;
            wide.height = kHeight;
            wide.fov_x = 2 * std::atan(kWidth / 2.0 * pixel);
            wide.fov_y = 2 * std::atan(kHeight / 2.0 * pixel);
            const Rect inner{kMargin, kMargin, part.width - 2 * kMargin, part.height - 2 * kMargin};
            for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference}) {
                if (path == CpuPath::Reference && part.x != 96)
                    continue; // slow
                const auto whole = renderWith(path, 1, model.view(), eyeParams(wide, {}), {});
                const auto eye = renderWith(path, 1, model.view(), eyeParams(off, {}), {});
                const std::vector<float> shown = cut(eye.pixels, part.width, inner);
                const std::vector<float> expected =
                    cut(whole.pixels, kWidth, {part.x + kMargin, part.y + kMargin, inner.width, inner.height});
                CHECK(compare(shown, expected).psnr > 80);
                const std::vector<float> black(shown.size());
                CHECK(compare(shown, black).psnr < 30); // there is something to see
                // with the borders
                CHECK(compare(eye.pixels, cut(whole.pixels, kWidth, part)).psnr > 35);
            }
        }
    }
}

TEST_CASE(
    "eyes beside each other see one depth, turned ones and one ahead of the other do not, near and far from the origin")
{
    Random random(5);
    for (int i = 0; i < 300; ++i) {
        CAPTURE(i);
        const float reach = i % 3 == 0 ? 1.0f : i % 3 == 1 ? 1e3f : 1e5f;
        Camera head = randomHead(random, reach, 640, 480), left, right;
        finishCamera(head, 640, 480, 1.5);
        stereoPair(head, 0.064, left, right);
        const double origin[3] = {};
        const EyeParams l = eyeParams(left, origin);
        CHECK(sameDepths(l, eyeParams(right, origin)));
        Camera turned = right, ahead = right;
        for (int row = 0; row < 3; ++row) // by a millionth of a radian about the eye's y axis
            turned.rotation[3 * row + 2] += 1e-6 * right.rotation[3 * row];
        ahead.translation[2] += 5e-7 * double(reach);
        CHECK_FALSE(sameDepths(l, eyeParams(turned, origin)));
        CHECK_FALSE(sameDepths(l, eyeParams(ahead, origin)));
    }
}
