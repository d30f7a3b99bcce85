// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include <gsc/file/output_paths.h>
#include "player/commands/commands.h"
#include "player/commands/play_command.h"
#include "player/commands/render_options.h"
#include "runtime/image/image_io.h"
#include "player/output/out_pattern.h"
#include "player/devices/worker_options.h"
#include "player/play/play.h"
#include "player/play/play_report.h"
#include "player/window/window.h"
#include "runtime/cli/options.h"
#include "runtime/cli/version.h"
#include <gsc/renderer.h>
#include "player/commands/worker_flags.h"

#include <cstdlib>
#include <filesystem>
#include <memory>

#include <unistd.h>

namespace gsc {

namespace {

constexpr const char* kPlayExamples = R"(examples:
  gsc-play room.gsc
      a window to fly through it, or through a trained model's folder
  gsc-play room.gsc --out 'frames/{name}.png'
      every camera stored in the file, at its own size
  gsc-play room.gsc --cameras path.json --size 1920x1080 --video flight.mp4
      a video, which needs the program ffmpeg
  gsc-play room.gsc --position 0,-1,-3 --look-at 0,0,1 --size 1080p --out my.png
      a picture from where you like
  gsc-play bench room.gsc --size 1920x1080
      what a frame costs, stage by stage; gsc-play bench --help

more examples:
  gsc-play room.gsc --turntable turn.mp4 --size 1080p
      a full turn round the model; --interpolate flies through its cameras
  gsc-play room.gsc --cameras stored:0027,0042 --out pictures/
      two stored cameras by name, into a folder
  gsc-play room.gsc --cameras path.json --frames 0:100 --size 1920x1080 \
      --out 'out/{frame:04}.png' --stats out.jsonl
      the first 100 frames of a trajectory, with what each cost
  gsc-play room.gsc --tier exact --depth 16 --out 'exact/{name}.png'
      the trainer's own image, 16 bits per channel
  gsc-play room.gsc --eyes 2 --ipd 0.065 --out 'vr/{frame:04}_{eye}.exr'
      both eyes, 32-bit float
  gsc-play room.gsc --cameras path.json --backend cpu --reuse error \
      --reuse-bound 1
      decoded Gaussians are drawn again while they change by less than 1/255
  gsc-play city.gsc --cameras flight.json --target-ms 11 --lod-fade 0.5 \
      --lod-hysteresis 0.1 --stats out.jsonl
      less detail if frames take longer than 11 ms; levels change softly
  gsc-play city.gsc --cameras flight.json --tier turbo --stats out.jsonl
      small far Gaussians are joined, and kept from frame to frame: faster
  gsc-play room.gsc --cameras path.json --size 1280x720 --out - | ffplay -
      pictures to another program, as they are drawn
  gsc-play room.gsc --out 'frames/{name}.png' --shard 2/4 --stats shard_2.jsonl
      every fourth camera from the second on; gsc merge-runs shard_*.jsonl -o
      frames.jsonl joins the four files

A model whose file is named as a command is played as ./bench. Results go to
standard output, everything else to standard error.
exit codes:
  0 ok   1 usage   2 input/output   3 invalid file   4 internal   5 unsupported
  6 out of memory   7 device   8 a bound was passed   130 interrupted)";

OptionHandle addVideo(CLI::App& app, PlayOptions& options, const char* option, CameraMotion motion, const char* help)
{
    return detail::addValue(app, option, "FILE.mp4", help,
                            [&options, motion](const std::string& name, const std::string& text) {
                                options.output.video = text;
                                options.output.video_option = name;
                                options.cameras.motion = motion;
                            });
}

void addOutputOptions(CLI::App& app, PlayOptions& options)
{
    const Heading heading(app, "Files");
    addText(app, "--out", options.output.out, "PATTERN",
            "pictures to write: {name}, {frame}, {frame:04} and {eye} in the pattern are filled in (" +
                imageExtensions() +
                "; JPEG and WebP of quality 95), or a folder for {frame:04}_{name}.png; - is a stream on "
                "standard output, two eyes side by side");
    addChoice<StreamFormat>(
        app, "--stream", options.output.stream,
        {{"y4m", StreamFormat::Y4m}, {"rgb24", StreamFormat::Rgb24}, {"rgb48", StreamFormat::Rgb48}}, "default: y4m",
        "format of --out -: YUV4MPEG2 (4:4:4, 16 bits, full range), or bare pixels of 8 or 16 bits per channel")
        .rare();
    addVideo(app, options, "--video", CameraMotion::None,
             "video to write with the program ffmpeg: H.264, nearly lossless, two eyes side by side");
    addVideo(app, options, "--turntable", CameraMotion::Turntable,
             "video of a full turn round what the cameras look at, or round --look-at from --position")
        .excludes(optionOf(app, "--video"));
    OptionHandle way = addVideo(app, options, "--interpolate", CameraMotion::Interpolate,
                                "video of a smooth way through the cameras: photographs in the order of their names, "
                                "named ones and trajectories as they are given");
    for (const char* other : {"--video", "--turntable", "--position", "--look-at"})
        way.excludes(optionOf(app, other));
    addNumber(app, "--seconds", options.cameras.seconds, {0.1, 600}, " seconds", "S (default: 10, or by the cameras)",
              "length of --turntable or --interpolate; by default a way takes a second from camera to camera, 2 to 30 "
              "in all")
        .rare();
    addNumber(app, "--fps", options.cameras.fps, {0.001, 1000}, " frames a second",
              "N (default: the trajectory's, or 30)", "frames per second of the video or y4m stream")
        .rare();
    addChoice<PixelDepth>(app, "--depth", options.output.depth, {{"8", PixelDepth::Eight}, {"16", PixelDepth::Sixteen}},
                          "default: 8", "bits per channel of a PNG")
        .rare();
    addText(app, "--stats", options.output.stats, "FILE.jsonl",
            "file of stage times and counts: one JSON object per frame and line (schemas/frame-stats.schema.json); - "
            "is standard output");
    addFlag(app, "-w,--overwrite", options.output.overwrite, "replace files that exist");
    addShard(app, options, "the frames", "--stats");
}

// Throws if the options make a frame depend on the frame before it: a shard draws only every N-th frame.
void checkShard(const CLI::App& app, const PlayOptions& options)
{
    const bool keeps = options.frame.reuse.policy != ReusePolicy::None, coarse = options.frame.detail > 0;
    if (options.shard.isGiven() && (keeps || coarse || options.frame.lod_hysteresis > 0 || options.frame.target_ms > 0))
        throw Error(ErrorCode::Usage, "--shard " + options.shard.text(),
                    formatString("with %s a frame depends on those before it", keeps    ? "--reuse"
                                                                               : coarse ? detailOption(app)
                                                                               : options.frame.lod_hysteresis > 0
                                                                                   ? "--lod-hysteresis"
                                                                                   : "--target-ms"),
                    "frames that can be drawn apart", "leave one of them out");
    checkShardFile(options, "--stats", options.output.stats);
}

void checkOut(const CLI::App& app, const PlayOptions& options)
{
    const bool is_png =
        options.output.out.size() > 4 && options.output.out.compare(options.output.out.size() - 4, 4, ".png") == 0;
    const bool is_stream = isStandardOutput(options.output.out);
    checkEffect(app, "--depth", is_png, "--out of a .png");
    checkEffect(app, "--stream", is_stream, "--out -");
    checkEffect(app, "--fps",
                !options.output.video.empty() || (is_stream && options.output.stream == StreamFormat::Y4m),
                "--video or --out - --stream y4m");
    checkEffect(app, "--seconds", options.cameras.motion != CameraMotion::None, "--turntable or --interpolate");
    checkEffect(app, "--overwrite",
                (!options.output.out.empty() && !is_stream) || !options.output.video.empty() ||
                    (!options.output.stats.empty() && !isStandardOutput(options.output.stats)),
                "--out, --video or --stats");
    if (is_stream && isStandardOutput(options.output.stats))
        throw Error(ErrorCode::Usage, "--stats -", "--out - has standard output", "one of them", "give --stats a file");
    if ((is_stream || !options.output.video.empty()) && options.shard.isGiven())
        throw Error(ErrorCode::Usage, is_stream ? "--out -" : options.output.video_option, "is one stream",
                    "the files of --shard " + options.shard.text(),
                    "give --out a pattern of names, or leave --shard out");
    if (!options.output.video.empty() && !options.output.video.ends_with(".mp4"))
        throw Error(ErrorCode::Unsupported, options.output.video_option + " " + options.output.video,
                    "has another ending", ".mp4", "choose such a name, or pipe --out - into ffmpeg");
    if (!options.output.out.empty() && !is_stream && !isImageExtension(options.output.out))
        throw Error(ErrorCode::Unsupported, "--out " + options.output.out, "this build cannot write such a file",
                    "one of " + imageExtensions() + ", or a folder",
                    hasOpenImageIo() ? "choose one of them, or put / behind a folder"
                                     : "choose one of them, put / behind a folder, or use a build with GSC_WITH_OIIO");
}

// Returns true for a folder, be it there or to be made: a name without an ending and without braces is one.
bool namesFolder(const std::string& out)
{
    std::error_code code;
    return out.ends_with('/') || std::filesystem::is_directory(out, code) ||
           (out.find_first_of("{}") == std::string::npos &&
            std::filesystem::path(out).filename().string().find('.') == std::string::npos);
}

// Returns true if a person sits before a display, who sees nothing of what is drawn for nothing.
bool isAtDisplay()
{
    const auto is_set = [](const char* name) {
        const char* const value = std::getenv(name);
        return value != nullptr && *value != '\0';
    };
    return ::isatty(STDIN_FILENO) && ::isatty(STDOUT_FILENO) && ::isatty(STDERR_FILENO) &&
           (is_set("DISPLAY") || is_set("WAYLAND_DISPLAY"));
}

ErrorCode runPlay(const PlayOptions& options, Reporter& report)
{
    if (hasWindow() && !isForSomething(options, report) && isAtDisplay()) {
        WindowOptions window;
        window.play = options;
        report.tell("opens a window; --out FOLDER writes pictures instead");
        try {
            return runWindowCommand(window, report);
        } catch (const Error& e) {
            if (e.code() != ErrorCode::Unsupported || (e.subject() != "display" && e.subject() != "window"))
                throw;
            throw Error(e.code(), e.subject(), e.found(), e.expected(), "add --out FOLDER to write pictures instead");
        }
    }
    const PlaySummary summary = play(options, report);
    report.endProgress(false);
    const std::string text =
        report.json() ? playReportJson(options, summary, report.warnings()) : playReportText(options, summary);
    isStandardOutput(options.output.stats) || isStandardOutput(options.output.out) ? report.tell(text)
                                                                                   : report.text(text);
    return ErrorCode::Ok;
}

} // namespace

void addPlayOptions(CLI::App& app, PlayOptions& options)
{
    addFile(app, options);
    addCameras(app, options);
    addOwnCamera(app, options);
    addFrames(app, options);
    addViewOptions(app, options);
    addRunOptions(app, options);
    addWorkerOptions(app, options);
    addTargetOption(app, options);
    addOutputOptions(app, options);
}

void settlePlayOptions(PlayOptions& options)
{
    std::string& out = options.output.out;
    if (out.empty() || isStandardOutput(out) || !namesFolder(out))
        return;
    out = literalPattern(out + (out.ends_with('/') ? "" : "/"));
    out += options.view.eyes == 2 ? "{frame:04}_{name}_{eye}.png" : "{frame:04}_{name}.png";
}

void checkPlayOptions(const CLI::App& app, const PlayOptions& options)
{
    if (options.model.file.empty())
        throw Error(ErrorCode::Usage, "FILE", "not given", "a .gsc or a trained model behind gsc-play",
                    "see gsc-play --help");
    checkRenderOptions(app, options, false);
    checkOwnCamera(app, options.cameras);
    checkWorkerOptions(app, options);
    checkEffect(app, "--device", !options.devices.backend.starts_with("cpu"), "--backend cuda or auto");
    checkOut(app, options);
    checkShard(app, options);
}

void addPlayCommand(CLI::App& root, Invocation& invocation)
{
    auto options = std::make_shared<PlayOptions>();
    auto lists = std::make_shared<bool>(false);
    addPlayOptions(root, *options);
    addFlag(root, "--list-devices", *lists,
            "list the devices that can render, and end: with their memory and the links between them");
    addReporterOptions(root, invocation.reporter, true);
    setFooter(root, kPlayExamples);
    onParsed(root, [&root, &invocation, options, lists] {
        if (hasCommand(root))
            return;
        if (*lists) {
            invocation.run = [](Reporter& report) {
                report.text(report.json() ? deviceListJson() : deviceListText());
                return ErrorCode::Ok;
            };
            return;
        }
        settlePlayOptions(*options);
        checkPlayOptions(root, *options);
        invocation.run = [options](Reporter& report) { return runPlay(*options, report); };
    });
}

void addBackendsCommand(CLI::App& root, Invocation& invocation)
{
    CLI::App& command = addCommand(root, "backends", "List the devices that can render on this machine");
    onParsed(command, [&invocation] {
        invocation.run = [](Reporter& report) {
            for (const DeviceInfo& device : devices())
                if (device.usable)
                    report.text(device.id.backend +
                                (device.id.ordinal == 0 ? "" : " --device " + std::to_string(device.id.ordinal)) +
                                ": " + device.text);
            return ErrorCode::Ok;
        };
    });
}

int runGscPlay(int argc, const char* const* argv)
{
    return runProgram(
        {"gsc-play", "Plays a .gsc model: renders it from the cameras given, in a window or in a headset.",
         versionText("gsc-play") + "\nimages " + imageExtensions(),
         "print the version, the commit, the versions of the file format and of CUDA, and the image files it writes",
         "",
         [](CLI::App& root, Invocation& invocation) {
             addPlayCommand(root, invocation);
             addBenchCommand(root, invocation);
             addStabilityCommand(root, invocation);
             addLiveCommand(root, invocation);
             addWindowCommand(root, invocation);
             addXrCommand(root, invocation);
             addBackendsCommand(root, invocation);
         }},
        argc, argv);
}

} // namespace gsc
