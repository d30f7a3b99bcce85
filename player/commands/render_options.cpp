// SPDX-License-Identifier: Apache-2.0
#include "player/commands/render_options.h"

#include <gsc/error.h>
#include <gsc/file/output_paths.h>
#include "player/frames/made_cameras.h"
#include "runtime/cameras/length.h"
#include "runtime/records/reuse_names.h"
#include "runtime/cli/options.h"
#include "player/devices/worker_options.h"

#include <cmath>
#include <cstdio>
#include <numbers>

namespace gsc {

namespace {

constexpr double kMaxLength = 1e15; // largest length that an option takes, world units
constexpr double kMaxTargetMs = 60000;

std::vector<float> parseColor(const std::string& name, const std::string& text)
{
    float r = 0, g = 0, b = 0;
    int used = 0;
    if (std::sscanf(text.c_str(), "%f,%f,%f%n", &r, &g, &b, &used) != 3 || size_t(used) != text.size() ||
        !std::isfinite(r) || !std::isfinite(g) || !std::isfinite(b))
        detail::failValue(name, text, "no colour", "three numbers such as 0,0,0, or \"model\"");
    return {r, g, b};
}

void addReuseOptions(CLI::App& app, PlayOptions& options)
{
    const Heading heading(app, "Reuse of decoded Gaussians");
    ReuseOptions& reuse = options.frame.reuse;
    addChoice<ReusePolicy>(
        app, "--reuse", reuse.policy, reusePolicies(), "default: none",
        "draw decoded Gaussians, the networks' output, again in later frames: depth: for a number of frames, fewer "
        "where more of the view is new; error, on a CPU: while their predicted change stays within --reuse-bound");
    addInteger(app, "--reuse-depth", reuse.max_depth, 0, kMaxReuseDepth, "N (default: 10)",
               "with --reuse depth, most frames that decoded Gaussians are drawn again; more is faster and less exact")
        .rare();
    addChoice<DepthGuidance>(
        app, "--reuse-guidance", reuse.guidance, depthGuidances(), "default: linear",
        "with --reuse depth, curve by which Gaussians are drawn again in fewer frames as more of the view is new")
        .rare();
    addNumber(app, "--reuse-bound", reuse.bound, {0, kMaxReuseBound}, " in 1/255", "B (default: 1)",
              "with --reuse error, largest predicted change of colour at which Gaussians are drawn again, in 1/255 of "
              "full colour; more is faster and less exact")
        .rare();
    addInteger(
        app, "--decode-budget", reuse.decode_budget, 0, int64_t(1) << 40, "N (default: 0)",
        "with --reuse error, most anchors decoded again per frame and eye, the largest predicted change first; fewer "
        "is faster and less exact. Anchors never decoded before always are; 0 = all that --reuse-bound asks for")
        .rare();
    addByteSize(
        app, "--cache-budget", reuse.cache_bytes, 1, "SIZE (default: a quarter)",
        "most memory for decoded Gaussians, such as 256M; default: a quarter of main memory, or on a GPU of its free "
        "memory")
        .rare();
}

void addLevelOptions(CLI::App& app, PlayOptions& options, Views views)
{
    const Heading heading(app, "Levels of detail");
    addNumber(
        app, "--detail", options.frame.detail, {0, double(kMostDetail)}, " pixels", "PIXELS (default: 0)",
        std::string(
            "size of the finest detail of far groups of anchors, in pixels: smaller Gaussians are joined into coarse "
            "copies, which later frames draw again; larger is faster and less exact; 0 = draw every Gaussian") +
            (views == Views::Cameras ? ". No effect on cameras in no order, such as the stored ones, and on single "
                                       "pictures of gsc-play FILE"
                                     : ""));
    addNumber(app, "--lod-bias", options.frame.lod_bias, {-kMaxLodBias, kMaxLodBias}, " levels", "X (default: 0)",
              "levels added to the level that distance asks for: below 0 draws less and faster, above 0 more detail; 0 "
              "is the trainer's rule")
        .rare();
    addNumber(app, "--lod-fade", options.frame.lod_fade, {0, kMaxLodWidth}, " levels", "X (default: 0)",
              "width of the fade, in levels, up to 1, with which an anchor appears around the distance where the "
              "trainer's rule switches it on; 0 = at once")
        .rare();
    addNumber(app, "--lod-hysteresis", options.frame.lod_hysteresis, {0, kMaxLodWidth}, " levels", "X (default: 0)",
              "levels by which a switch of level may lag behind the camera, up to 1, so that small movements to and "
              "fro switch nothing; 0 = no lag")
        .rare();
}

void addFoveationOptions(CLI::App& app, PlayOptions& options, bool knows_gaze)
{
    Choices<FoveationMode> modes = {{"none", FoveationMode::None}, {"fixed", FoveationMode::Fixed}};
    if (knows_gaze)
        modes.emplace_back("gaze", FoveationMode::Gaze);
    addChoice<FoveationMode>(
        app, "--foveation", options.frame.foveation, modes, "default: none",
        std::string("draw fewer Gaussians away from where an eye looks: those too fine to be seen there are left out, "
                    "in tier fast on a GPU; fixed: each eye looks along its axis") +
            (knows_gaze ? "; gaze: the headset tells where the eyes look, if it can" : ""));
    addNumber(
        app, "--fovea-pixels", options.frame.fovea_pixels, {0.1, kMostFoveaPixels}, " pixels", "X (default: 2)",
        "with --foveation, standard deviation in pixels of the finest Gaussian drawn 40 degrees or more from where the "
        "eye looks; larger draws less. Within 12 degrees all are drawn; in between the limit grows with the angle")
        .rare();
}

} // namespace

OptionHandle addBackend(CLI::App& app, const char* name, std::string& field, bool or_auto, const char* help)
{
    Choices<std::string> names = {{"cuda", "cuda"}, {"cpu", "cpu"}, {"cpu-reference", "cpu-reference"}};
    if (or_auto)
        names.insert(names.begin(), {"auto", "auto"});
    return addChoice<std::string>(app, name, field, names, or_auto ? "default: auto" : "default: the measured one",
                                  help);
}

void addFile(CLI::App& app, PlayOptions& options)
{
    addText(app, "FILE", options.model.file, "FILE.gsc|MODEL", "model to play: a .gsc, or a trained model's folder");
}

void addCameraReading(CLI::App& app, PlayOptions& options)
{
    addFlag(app, "--ignore-distortion", options.cameras.ignore_distortion,
            "draw cameras with lens distortion as if they had none, instead of refusing them")
        .rare();
    addChoice<CamerasTransform>(app, "--cameras-transform", options.cameras.transform,
                                {{"keep", CamerasTransform::Keep}, {"undo", CamerasTransform::Undo}},
                                "default: keep, with a warning",
                                "coordinates of a transforms.json with applied_transform or applied_scale: keep: as "
                                "they stand; undo: as they were before these were applied")
        .rare();
}

void addCameras(CLI::App& app, PlayOptions& options)
{
    detail::addValue(
        app, "--cameras", "stored|FILE.json (default: stored)",
        "cameras to draw: those stored in FILE, some of them by name (stored:NAME,NAME), or of a file: cameras.json of "
        "a trained model, transforms.json, nerfstudio's camera_path.json or a trajectory "
        "(schemas/trajectory.schema.json), or of a folder: a COLMAP model, a data set or a trained model",
        [&options](const std::string& name, const std::string& text) {
            if (!parseCameras(text, options.cameras))
                detail::failValue(name, text, "holds an empty name", "stored:NAME or stored:NAME,NAME");
        });
    addCameraReading(app, options);
}

void addOwnCamera(CLI::App& app, PlayOptions& options)
{
    const auto add = [&](const char* option, std::optional<std::array<double, 3>>& place, const char* help) {
        detail::addValue(app, option, "X,Y,Z", help, [&place](const std::string& name, const std::string& text) {
            if (!(place = parsePlace(text)))
                detail::failValue(name, text, "no place", "three numbers of at most 1e15, such as 0.5,-1,2");
        });
    };
    add("--position", options.cameras.position,
        "place of a camera of your own, in world units, with the lens of the first one of --cameras (60 degrees wide "
        "if "
        "there is none) and a level horizon");
    add("--look-at", options.cameras.look_at, "place that the camera of --position has in the middle of its picture");
}

void checkOwnCamera(const CLI::App& app, const CameraChoice& choice)
{
    checkEffect(app, "--position", choice.look_at.has_value(), "--look-at");
    checkEffect(app, "--look-at", choice.position.has_value(), "--position");
    if (choice.position && !hasDirection({*choice.position, *choice.look_at}))
        throw Error(ErrorCode::Usage, "--look-at", "is the place of --position", "another, to look at",
                    "pass another place");
}

void addFrames(CLI::App& app, PlayOptions& options)
{
    detail::addValue(app, "--frames", "A:B (default: all)", "cameras A to B-1, counted from 0; either may be left out",
                     [&options](const std::string& name, const std::string& text) {
                         options.cameras.range = name + " " + text;
                         options.cameras.may_end_sooner = false;
                         if (!parseFrameRange(text, options.cameras.first, options.cameras.end))
                             detail::failValue(name, text, "no range", "A:B with A below B, such as 0:100");
                     });
}

void addViewOptions(CLI::App& app, PlayOptions& options, const std::string& size)
{
    const Heading heading(app, "View");
    addImageSize(
        app, "--size", options.view.width, options.view.height, "WxH|W|1080p (default: " + size + ")",
        "width and height of a picture in pixels; a width alone keeps the camera's aspect, at another aspect one "
        "axis shows more",
        true);
    detail::addValue(app, "--fov", "DEGREES (default: the camera's)", "horizontal angle of view",
                     [&options](const std::string& name, const std::string& text) {
                         const double angle = detail::number(name, text, {0.01, 179.9}, " degrees");
                         options.view.fov_x = angle * std::numbers::pi / 180;
                     });
    addInteger(app, "--eyes", options.view.eyes, 1, 2, "1|2 (default: 1)", "pictures per frame: 1, or 2 for stereo");
    detail::addValue(app, "--ipd", "LENGTH (default: 0.064 m of the model's metre, or the trajectory's)",
                     "distance between the eyes: in world units, or in metres such as 64mm",
                     [&options](const std::string& name, const std::string& text) {
                         options.view.ipd = parseLength(text, name.c_str());
                     });
    addLookOptions(app, options);
}

void addLookOptions(CLI::App& app, PlayOptions& options)
{
    const Heading heading(app, "View");
    addChoice<StereoMode>(app, "--stereo", options.frame.stereo, stereoModes(), "default: exact",
                          "viewpoint of the networks, which compute colour and opacity: exact: each eye; merged: the "
                          "middle between both, once: faster and less exact")
        .rare();
    addInteger(app, "--appearance", options.cameras.appearance, 0, std::numeric_limits<int>::max(),
               "ROW (default: the camera's own)",
               "row of the appearance embedding (one per training picture) for every camera")
        .rare();
    detail::addValue(app, "--background", "model|R,G,B (default: model)",
                     "colour behind the model, three numbers from 0 to 1; model = the colour it was trained with",
                     [&options](const std::string& name, const std::string& text) {
                         if (text == "model")
                             options.frame.background.reset();
                         else
                             options.frame.background = parseColor(name, text);
                     })
        .rare();
    addNumber(app, "--near", options.frame.near_z, {0, kMaxLength, true}, " world units", "Z (default: the model's)",
              "nearest depth drawn, in world units")
        .rare();
}

void addRunOptions(CLI::App& app, PlayOptions& options, Views views)
{
    const Heading heading(app, "Rendering");
    addChoice<TierChoice>(app, "--tier", options.frame, tierChoices(), "default: fast",
                          "exactness of the pictures: exact: the trainer's image, but without the trainer's rounding "
                          "errors far from the origin; fast: half precision on a GPU, exact on a CPU; " +
                              formatString("turbo: fast with --detail %g, for trajectories", kTurboDetail));
    addBackend(app, "--backend", options.devices.backend, true,
               "device that renders: cuda: a GPU; cpu; cpu-reference: slow and simple, to check the others against; "
               "auto: a GPU if there is one, else the CPU");
    addInteger(app, "--device", options.devices.device, 0, 255, "N (default: 0)",
               "number of the GPU, as in the list of gsc-play backends")
        .rare();
    addInteger(app, "--threads", options.devices.threads, 0, 4096, "N (default: 0)",
               "CPU threads, 0 = all cores; with a GPU they only read the file");
    addByteSize(app, "--vram-budget", options.devices.vram_budget, 1, "SIZE (default: all there is)",
                "most GPU memory for model and frame, such as 4G; a frame that needs more is drawn in several passes, "
                "which is slower")
        .rare();
    addFlag(app, "--verify", options.model.verify, "check the checksum of every byte before the first frame").rare();
    addFoveationOptions(app, options, views == Views::Headset);
    addReuseOptions(app, options);
    addLevelOptions(app, options, views);
}

void addFirstPicture(CLI::App& app, PlayOptions& options)
{
    addFlag(app, "--first-picture", options.devices.first_picture,
            "draw while the model is still being copied to the GPU, coarse levels and near anchors first; not with "
            "--tier exact")
        .rare();
}

void settleFirstPicture(PlayOptions& options)
{
    options.devices.first_picture &= options.frame.tier != Tier::Exact;
}

void addShard(CLI::App& app, PlayOptions& options, const char* what, const char* file)
{
    detail::addValue(
        app, "--shard", "I/N|auto (default: all)",
        formatString(
            "do only the I-th of N parts of %s, I from 1; run a process for each part, on any machine. auto takes I "
            "and N from Slurm's SLURM_ARRAY_TASK_ID and _COUNT or Open MPI's OMPI_COMM_WORLD_RANK and _SIZE; auto/N "
            "takes I also from the JOB_COMPLETION_INDEX of Kubernetes. Finished work is kept in %s, a file for each "
            "part: a part that is started again continues it. gsc merge-runs joins the files",
            what, file),
        [&options](const std::string& name, const std::string& text) {
            options.shard = parseShard(text, name, processEnvironment, remoteWorkers() != nullptr);
        })
        .rare();
}

void checkShardFile(const PlayOptions& options, const char* option, const std::string& file)
{
    if (options.shard.isGiven() && (file.empty() || isStandardOutput(file)))
        throw Error(ErrorCode::Usage, "--shard " + options.shard.text(), "nothing says where to keep what is done",
                    "a file of its own for each shard", formatString("pass %s FILE.jsonl", option));
}

void addScoreFrames(CLI::App& app, ScoreOptions& score)
{
    constexpr int64_t kMany = 1000000;
    addInteger(app, "--score-every", score.every, 1, kMany, "N (default: 1)",
               "score every N-th camera of the path against the tier exact")
        .rare();
    addInteger(app, "--score-first", score.first, 0, kMany, "N (default: 0)",
               "number of the first camera of the path to score, counted from 0")
        .rare();
}

void addTargetOption(CLI::App& app, PlayOptions& options, Views views)
{
    const Heading heading(app, "Levels of detail");
    addNumber(
        app, "--target-ms", options.frame.target_ms, {1e-6, kMaxTargetMs}, " milliseconds", "MS (default: none)",
        std::string("longest time of a frame to aim for: while frames take longer, --detail doubles up to 4 pixels "
                    "where it can be used, then --lod-bias falls; both return slowly to their given values") +
            (views == Views::Cameras
                 ? ". Refused if neither can change, as for a model of one level with cameras in no order"
                 : ""));
}

void checkEffect(const CLI::App& app, const char* option, bool has_effect, const std::string& needs)
{
    if (!has_effect && isGiven(app, option))
        throw Error(ErrorCode::Usage, option, "has no effect here", needs + " with it",
                    formatString("pass that too or leave %s out", option));
}

void checkEyes(const CLI::App& app, const PlayOptions& options, bool takes_two_eyes)
{
    const bool two = takes_two_eyes || options.view.eyes == 2;
    if (options.frame.stereo == StereoMode::Merged)
        checkEffect(app, "--stereo", two, "--eyes 2");
    checkEffect(app, "--ipd", two, "--eyes 2");
}

const char* detailOption(const CLI::App& app)
{
    return isGiven(app, "--detail") ? "--detail" : "--tier turbo";
}

namespace {

void checkDetail(const CLI::App& app, const FrameChoice& choice)
{
    if (choice.detail > 0 && choice.tier == Tier::Exact)
        throw Error(ErrorCode::Usage, "--detail", "joins what is small", "--tier fast or turbo",
                    "pass one of those or leave --detail out");
    if (choice.detail > 0 && choice.reuse.policy != ReusePolicy::None)
        throw Error(ErrorCode::Usage, detailOption(app),
                    formatString("together with --reuse %s", policyName(choice.reuse.policy)),
                    "one of them, because both keep what was decoded", "leave one of them out");
}

} // namespace

void checkRenderOptions(const CLI::App& app, const PlayOptions& options, bool paths_follow, bool takes_two_eyes)
{
    const ReuseOptions& reuse = options.frame.reuse;
    checkDetail(app, options.frame);
    for (const char* option : {"--reuse-depth", "--reuse-guidance"})
        checkEffect(app, option, reuse.policy == ReusePolicy::Depth, "--reuse depth");
    for (const char* option : {"--reuse-bound", "--decode-budget"})
        checkEffect(app, option, reuse.policy == ReusePolicy::Error, "--reuse error");
    checkEffect(app, "--fovea-pixels", options.frame.foveation != FoveationMode::None, "--foveation");
    if (options.frame.foveation != FoveationMode::None && options.frame.tier == Tier::Exact)
        throw Error(ErrorCode::Usage, "--foveation", "leaves Gaussians out", "--tier fast",
                    "pass that or leave --foveation out");
    checkEffect(app, "--cache-budget", reuse.policy != ReusePolicy::None, "--reuse depth or --reuse error");
    if (!paths_follow) {
        checkEyes(app, options, takes_two_eyes);
        for (const char* option : {"--ignore-distortion", "--cameras-transform"})
            checkEffect(app, option, options.cameras.isFile(), "--cameras FILE");
    }
    if (options.frame.stereo == StereoMode::Merged && reuse.policy == ReusePolicy::Error)
        throw Error(ErrorCode::Usage, "--stereo merged",
                    "together with --reuse error, which bounds the change for each eye", "--reuse depth or none",
                    "pass one of these or --stereo exact");
}

} // namespace gsc
