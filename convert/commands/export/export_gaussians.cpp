// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/export/export_gaussians.h"

#include "convert/explicit/gaussian_fit.h"
#include "convert/explicit/gaussian_render.h"
#include "format/file/mapped_file.h"
#include "format/file/output_file.h"
#include "format/interrupt.h"
#include "player/cameras/scene_cameras.h"
#include "runtime/metrics/metrics.h"
#include "runtime/cpu/renderer_cpu.h"
#include "runtime/renderer.h"

#include <charconv>

namespace gsc {

namespace {

constexpr size_t kMostFitCameras = 96,
                 kMostJudges = 12; // spread evenly; more change the fit by hundredths of a decibel

struct View {
    std::string name;
    EyeParams eye;
    FrameOptions options; // of the exact picture
};

View viewOf(const Scene& scene, const Camera& camera)
{
    return {camera.name, eyeParams(camera, scene.view().origin), exactOptionsFor(scene, camera)};
}

size_t cameraNumber(const std::vector<Camera>& cameras, const std::string& at)
{
    for (size_t i = 0; i < cameras.size(); ++i)
        if (cameras[i].name == at)
            return i;
    size_t number = cameras.size();
    const auto [end, fault] = std::from_chars(at.data(), at.data() + at.size(), number);
    if (fault != std::errc() || end != at.data() + at.size() || number >= cameras.size())
        throw Error(ErrorCode::Usage,
                    formatString("--at %s: no such camera, expected a name (the first is %s) or a number "
                                 "from 0 to %zu; choose one of them",
                                 at.c_str(), cameras[0].name.c_str(), cameras.size() - 1));
    return number;
}

// Those that are fitted, and those that judge.
struct Views {
    std::vector<View> fit, judges;
};

Views chooseViews(const Scene& scene, const GaussianExportOptions& options, Reporter& report)
{
    std::vector<std::string> ignored;
    const std::vector<Camera> cameras =
        sceneCameras(scene, options.cameras, options.ignore_distortion ? &ignored : nullptr);
    for (const std::string& text : ignored)
        report.warning(text);
    if (cameras.empty())
        throw Error(ErrorCode::Usage, options.file + ": no camera stored, expected some to fit colours over; pass a "
                                                     "camera file with --cameras");
    if (!options.at.empty()) {
        const View view = viewOf(scene, cameras[cameraNumber(cameras, options.at)]);
        return {{view}, {view}};
    }
    Views views;
    for (size_t i = 0; i < cameras.size(); ++i)
        (i % 2 == 0 ? views.fit : views.judges).push_back(viewOf(scene, cameras[i]));
    return {takeEvenly(std::move(views.fit), kMostFitCameras), takeEvenly(std::move(views.judges), kMostJudges)};
}

GaussianLoss lossOf(const GaussianSet& set, const std::shared_ptr<const Scene>& scene, const std::vector<View>& judges,
                    const GaussianExportOptions& options, Reporter& report)
{
    const std::unique_ptr<Renderer> exact = makeRenderer({"cpu"}, {options.threads});
    exact->load(scene);
    GaussianRenderer renderer(set, scene->view().origin, options.threads);
    const RasterConstants rules = rasterConstants(*scene->view().params, 0);
    GaussianLoss loss;
    PooledDifference pooled;
    for (size_t i = 0; i < judges.size(); ++i) {
        throwIfInterrupted();
        report.progress("compare", i, judges.size());
        const View& view = judges[i];
        std::vector<float> wanted(3 * size_t(view.eye.width) * view.eye.height), drawn(wanted.size());
        float* const image = wanted.data();
        (void)render(*exact, {&view.eye, 1}, view.options, &image);
        renderer.draw(view.eye, rules, view.options.background, drawn.data());
        const ImageView a{wanted.data(), view.eye.width, view.eye.height};
        const ImageView b{drawn.data(), view.eye.width, view.eye.height};
        pooled.add(compareImages(a, b));
        loss.ssim += ssim(a, b) / double(judges.size());
    }
    loss.cameras = judges.size();
    loss.psnr = pooled.psnr();
    loss.worst_psnr = pooled.worst_psnr;
    loss.worst = judges[pooled.worst_frame].name;
    return loss;
}

void writeFile(const GaussianSet& set, const GaussianExportOptions& options, const PieceSink& write)
{
    switch (options.to) {
    case GaussianFileFormat::Ply:
        return writeGaussianPly(set, write);
    case GaussianFileFormat::Spz:
        return writeGaussianSpz(set, write);
    case GaussianFileFormat::Glb:
        return writeGaussianGlb(set, write);
    case GaussianFileFormat::Sog:
        return writeGaussianSog(set, write, options.threads);
    }
}

// What a viewer gets of the file: `set`, or where the format rounds, what was written.
void readRounded(GaussianSet& set, const GaussianExportOptions& options, const std::string& written)
{
    const auto read = options.to == GaussianFileFormat::Spz   ? readGaussianSpz
                      : options.to == GaussianFileFormat::Sog ? readGaussianSog
                                                              : nullptr;
    if (read == nullptr)
        return;
    set = {};
    set = read(MappedFile(written).bytes(), options.output);
}

} // namespace

GaussianExport exportGaussians(const GaussianExportOptions& options, Reporter& report)
{
    if (options.to == GaussianFileFormat::Sog)
        requireSog();
    const std::shared_ptr<const Scene> scene = Scene::open(options.file);
    const Views views = chooseViews(*scene, options, report);
    std::vector<FitView> fit;
    for (const View& view : views.fit)
        fit.push_back({view.eye, view.options.appearance});
    const int degree = options.at.empty() ? options.degree : 0;
    const size_t bytes = (12 + 3 * shValues(degree)) * sizeof(float); // of a Gaussian
    const FitOptions fit_options{degree, options.threads, !options.at.empty(),
                                 rasterConstants(*scene->view().params, 0),
                                 size_t(cpuFacts(1).memory_bytes / 2 / bytes)};
    GaussianSet set = fitGaussians(scene->view(), fit, fit_options, [&](uint64_t done, uint64_t all) {
        throwIfInterrupted();
        report.progress("fit", done, all);
    });
    if (set.size() == 0)
        throw Error(ErrorCode::Usage, options.file + ": none of the cameras shows a Gaussian, expected some; pass "
                                                     "cameras that look at the model with --cameras");
    GaussianExport result;
    result.fitted = set.size();
    keepBest(set, size_t(options.most));
    result.gaussians = set.size();
    result.degree = set.degree;
    result.fit_cameras = fit.size();

    OutputFile output(options.output, OutputKind::Binary, options.overwrite);
    writeFile(set, options, [&](std::span<const std::byte> piece) {
        throwIfInterrupted();
        output.write(piece);
        result.bytes += piece.size();
    });
    output.sync();
    readRounded(set, options, output.temporaryPath());
    if (!views.judges.empty())
        result.loss = lossOf(set, scene, views.judges, options, report);
    report.endProgress(false);
    output.commit();
    return result;
}

} // namespace gsc
