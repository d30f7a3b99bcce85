// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/compare_render.h"

#include "convert/compare/trainer_pictures.h"
#include "convert/write/write_gsc.h"
#include "format/file/temporary.h"
#include <gsc/interrupt.h>
#include "runtime/cameras/scene_cameras.h"
#include "runtime/image/image_io.h"
#include "runtime/cpu/renderer_cpu.h"
#include <gsc/renderer.h>
#include <gsc/scene.h>
#include "runtime/frames/frame_loop.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>

namespace gsc {

namespace fs = std::filesystem;

namespace {

void writeFresh(const Checkpoint& checkpoint, const std::string& path, int threads, Reporter& report)
{
    WriteOptions options;
    options.output = path;
    options.threads = threads;
    options.drop_invalid = true;
    options.sensitivity = SensitivityMode::None; // only needed to reuse decoded Gaussians, which is not done here
    writeGsc(checkpoint, options, std::bind_front(&Reporter::progress, &report));
}

// Draws pictures of a file as a player does, or in double precision.
class FileRenderer {
public:
    FileRenderer(const std::string& path, CpuPath cpu_path, Tier tier, ReferencePrecision precision, int threads)
        : m_scene(Scene::open(path)), m_renderer(makeCpuRenderer(cpu_path, threads)), m_tier(tier),
          m_precision(precision)
    {
        m_renderer->load(m_scene);
    }

    [[nodiscard]] const Scene& scene() const { return *m_scene; }
    [[nodiscard]] Tier tier() const { return m_renderer->tierOf(m_tier); }

    Image render(const Camera& camera)
    {
        Image image{camera.width, camera.height, {}};
        image.pixels.resize(3 * size_t(camera.width) * camera.height);
        FrameOptions options = exactOptionsFor(*m_scene, camera);
        options.tier = m_tier;
        if (m_precision == ReferencePrecision::Double) {
            std::vector<double> exact(image.pixels.size());
            double* const pixels = exact.data();
            const EyeParams64 eye = eyeParams64(camera, m_scene->view().origin);
            FrameResult result;
            renderReference64(m_scene->view(), &eye, 1, options, &pixels, result);
            image.pixels.assign(exact.begin(), exact.end());
        } else {
            const std::vector<Shot> shots{shotOf(*m_scene, camera)};
            FrameLoop loop(*m_scene, shots, 1, options, *m_renderer);
            (void)loop.draw(0, [&image](size_t, LoopFrame& frame) {
                frame.targets[0] = hostTarget(image.pixels.data());
                frame.delivers = true;
            });
        }
        return image;
    }

private:
    std::shared_ptr<const Scene> m_scene;
    std::unique_ptr<Renderer> m_renderer;
    Tier m_tier;
    ReferencePrecision m_precision;
};

std::vector<Camera> camerasToCompare(const Scene& scene, const RenderOptions& options, Reporter& report)
{
    std::vector<std::string> warnings;
    std::vector<Camera> all =
        sceneCameras(scene, options.cameras, {options.ignore_distortion, options.cameras_transform, &warnings});
    for (const std::string& text : warnings)
        report.warning(text);
    return options.views == 0 ? all : takeEvenly(std::move(all), size_t(options.views));
}

bool isEightBit(const Image& image)
{
    return std::all_of(image.pixels.begin(), image.pixels.end(), [](float value) {
        const float scaled = 255 * value;
        return std::abs(scaled - std::round(scaled)) < 1e-3f;
    });
}

// An 8-bit picture tells each value only to within 1/255. Sets each value of `picture` as close to `actual` as the
// rounding allows, so that only differences beyond rounding count.
void undoRounding(Image& picture, Image& actual)
{
    constexpr float kHalf = 0.5f / 255;
    for (size_t i = 0; i < picture.pixels.size(); ++i) {
        actual.pixels[i] = std::clamp(actual.pixels[i], 0.0f, 1.0f); // as the trainer does before it writes a picture
        picture.pixels[i] = std::clamp(actual.pixels[i], picture.pixels[i] - kHalf, picture.pixels[i] + kHalf);
    }
}

// The trainer's pictures in `folder`, or none if `folder` is empty. Throws Error: Io if it is no folder, InvalidFile if
// it holds no picture with a known camera.
std::vector<TrainerPicture> picturesIn(const std::string& folder, const Scene& scene)
{
    if (folder.empty())
        return {};
    if (!fs::is_directory(folder))
        throw Error(ErrorCode::Io, folder, "is no folder", "the trainer's pictures", "check the path of --golden");
    auto pictures = fs::is_regular_file(folder + "/cameras.json") ? picturesOfGolden(folder)
                                                                  : picturesOfTest(folder, scene.cameras());
    if (pictures.empty())
        throw Error(ErrorCode::InvalidFile, folder, "holds no picture with a known camera",
                    "NAME.png and cameras.json, or NNNNN.png of the test cameras stored in the file",
                    "pass another folder to --golden or leave it out");
    return pictures;
}

void compareWithTrainer(const std::vector<TrainerPicture>& pictures, FileRenderer& renderer, const Lpips* lpips,
                        Reporter& report, RenderComparison& result)
{
    for (const TrainerPicture& source : pictures) {
        throwIfInterrupted();
        report.progress("trainer's pictures", result.trainer.views.size(), pictures.size());
        Image picture = readImage(source.path);
        Camera camera = source.camera;
        camera.width = picture.width;
        camera.height = picture.height;
        Image actual = renderer.render(camera);
        const bool eight_bit = isEightBit(picture);
        if (eight_bit)
            undoRounding(picture, actual);
        ScoredPicture view = scorePicture(camera.name, picture, actual, lpips);
        view.picture_bits = eight_bit ? 8 : 16;
        result.trainer.add(std::move(view));
    }
}

} // namespace

bool RenderComparison::passes(double min_psnr) const
{
    return reference.passes(min_psnr) && trainer.passes(min_psnr);
}

RenderComparison compareRenders(const Checkpoint& checkpoint, const std::string& file, const RenderOptions& options,
                                Reporter& report)
{
    RenderComparison result;
    const std::unique_ptr<Lpips> lpips = openLpips(options.lpips, options.threads);
    FileRenderer fast(file, CpuPath::Fast, options.tier, ReferencePrecision::Float, options.threads);
    result.tier = fast.tier();
    const std::vector<Camera> cameras = camerasToCompare(fast.scene(), options, report);
    // before the slow rendering, because this may throw
    const std::vector<TrainerPicture> pictures =
        picturesIn(options.golden.empty() ? findTrainerPictures(checkpoint) : options.golden, fast.scene());
    if (!cameras.empty()) {
        const Temporary folder(temporaryFolder() + "/gsc-compare", TemporaryKind::Folder, 0700);
        const std::string fresh = folder.path() + "/fresh.gsc";
        writeFresh(checkpoint, fresh, options.threads, report);
        FileRenderer reference(fresh, CpuPath::Reference, Tier::Exact, options.reference, options.threads);
        for (Camera camera : cameras) {
            throwIfInterrupted();
            report.progress("reference pictures", result.reference.views.size(), cameras.size());
            // a row that both files have: the new one has all rows
            camera.appearance = appearanceFor(fast.scene(), camera);
            const Image expected = reference.render(camera);
            result.reference.add(scorePicture(camera.name, expected, fast.render(camera), lpips.get()));
        }
    }
    compareWithTrainer(pictures, fast, lpips.get(), report, result);
    if (result.reference.views.empty() && result.trainer.views.empty())
        throw Error(ErrorCode::Usage, file, "stores no camera", "views to render",
                    "pass --cameras FILE or --golden DIR");
    report.endProgress(false);
    for (const PictureSet* set : {&result.reference, &result.trainer})
        if (result.lpips_missing.empty())
            result.lpips_missing = whyNoLpips(lpips.get(), *set);
    return result;
}

} // namespace gsc
