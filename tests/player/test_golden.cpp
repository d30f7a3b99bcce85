// SPDX-License-Identifier: Apache-2.0
// Acceptance: every golden view of every trained model, converted and rendered with --tier exact, is the trainer's own
// picture; on the fast path all of them, on the scalar reference the first view of each model.
#include <gsc/error.h>
#include "runtime/cpu/renderer_cpu.h"
#include <gsc/camera.h>
#include "runtime/model/local_model.h"
#include "runtime/metrics/metrics.h"
#include <gsc/scene.h>
#include "tests/kernels/moved_model.h"
#include "tests/player/baked_model.h"
#include "tests/player/golden_cameras.h"
#include "tests/player/golden_picture.h"
#include "tests/support/checkpoints.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>

using namespace gsc;

namespace {

constexpr double kPooledBar = 105, kBar = 103; // dB: all views together, each one

struct View {
    Image image, golden;
    FrameResult result;
};

View renderGolden(Renderer& backend, const Scene& scene, const std::string& model, const Camera& camera)
{
    View view;
    view.golden = readImage(model + "/golden/" + camera.name + ".png");
    view.image.width = camera.width;
    view.image.height = camera.height;
    view.image.pixels.resize(size_t(camera.width) * camera.height * 3);
    const EyeParams eye = eyeParams(camera, scene.view().origin);
    FrameOptions options; // black background, as the golden images have
    options.tier = Tier::Exact;
    options.appearance = scene.appearanceRows().empty() ? -1 : scene.appearanceRow(camera.appearance);
    float* pixels = view.image.pixels.data();
    view.result = render(backend, {&eye, 1}, options, &pixels);
    return view;
}

void checkModel(const std::string& model, const char* path_name, CpuPath path, bool all_views, PooledDifference& pooled)
{
    const std::string name = std::filesystem::path(model).filename().string();
    const test::BakedModel baked(model);
    const std::unique_ptr<Scene> scene = Scene::open(baked.path(), true);
    const std::unique_ptr<Renderer> backend = makeCpuRenderer(path, 0);
    backend->load(scene->view());
    for (const test::GoldenCamera& golden : test::readGoldenCameras(model)) {
        const View view = renderGolden(*backend, *scene, model, golden.camera);
        REQUIRE(view.golden.width == view.image.width);
        REQUIRE(view.golden.height == view.image.height);
        const ImageView a = test::viewOf(view.golden), b = test::viewOf(view.image);
        const ImageDifference difference = compareImages(a, b);
        std::printf("%-9s %-18s %-9s %s, SSIM %.7f, FLIP %.2e, %llu anchors, %.0f ms\n", path_name, name.c_str(),
                    golden.camera.name.c_str(), test::differenceText(difference).c_str(), ssim(a, b), flip(a, b),
                    static_cast<unsigned long long>(view.result.eyes[0].anchors_visible), view.result.times.total);
        std::fflush(stdout);
        CAPTURE(name);
        CAPTURE(golden.camera.name);
        CHECK(difference.psnr >= kBar);
        CHECK(difference.max_error <= test::kWorstPixel);
        pooled.add(difference);
        if (!all_views)
            break;
    }
}

void checkAll(const char* path_name, CpuPath path, bool all_views)
{
    PooledDifference pooled;
    for (const std::string& model : test::trainedModels())
        checkModel(model, path_name, path, all_views, pooled);
    if (pooled.frames == 0)
        return;
    test::printPooled(path_name, pooled);
    CHECK(pooled.psnr() >= kPooledBar);
}

// The worst view of a model's stored cameras, 100 km from the origin: dB to the pictures at the origin, read relative to
// its middle and as it lies there.
void checkFar(const std::string& model)
{
    const test::BakedModel baked(model);
    const std::unique_ptr<Scene> scene = Scene::open(baked.path());
    int32_t cells[3];
    test::farCells(scene->view(), cells);
    const test::MovedModel far(scene->view(), cells);
    const auto origin = localOrigin(far.view());
    REQUIRE(origin);
    const LocalModel local(far.view(), *origin);
    const std::unique_ptr<Renderer> backend = makeCpuRenderer(CpuPath::Fast, 0);
    const auto shoot = [&](const ModelView& view, const Camera& camera) {
        FrameOptions options;
        options.appearance = scene->appearanceRows().empty() ? -1 : scene->appearanceRow(camera.appearance);
        std::vector<float> pixels(size_t(camera.width) * camera.height * 3);
        float* image = pixels.data();
        const EyeParams eye = eyeParams(camera, view.origin);
        backend->load(view);
        (void)render(*backend, {&eye, 1}, options, &image);
        return pixels;
    };
    double after = INFINITY, before = INFINITY;
    for (const test::GoldenCamera& golden : test::readGoldenCameras(model)) {
        const Camera &camera = golden.camera, moved = test::movedCamera(camera, far.by());
        const std::vector<float> expected = shoot(scene->view(), camera);
        const auto distance = [&](const std::vector<float>& pixels) {
            return compareImages({expected.data(), camera.width, camera.height},
                                 {pixels.data(), camera.width, camera.height})
                .psnr;
        };
        after = std::min(after, distance(shoot(local.view(), moved)));
        before = std::min(before, distance(shoot(far.view(), moved)));
    }
    std::printf("far       %-18s moved by %.0f, %.0f, %.0f: worst view %6.2f dB; as fp32 has it there %.2f dB\n",
                std::filesystem::path(model).filename().c_str(), far.by()[0], far.by()[1], far.by()[2], after, before);
    std::fflush(stdout);
    CAPTURE(model);
    CHECK(after >= 80); // a splat that rounding puts on the other side of a tile or of another costs some dB
    CHECK(before < 45);
}

} // namespace

TEST_CASE("the fast path renders the trainers' pictures")
{
    checkAll("fast", CpuPath::Fast, true);
}

TEST_CASE("trained models 100,000 units from the origin draw what they draw at it")
{
    for (const std::string& model : test::trainedModels())
        checkFar(model);
}

TEST_CASE("the scalar reference renders the trainers' pictures")
{
    checkAll("reference", CpuPath::Reference, false);
}
