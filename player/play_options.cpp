// SPDX-License-Identifier: Apache-2.0
#include "player/play_options.h"

#include "format/error.h"
#include "format/gsc_layout.h"
#include "format/output_paths.h"
#include "player/bench.h"
#include "player/cli_choice.h"
#include "player/reuse_names.h"
#include "player/reuse_options.h"
#include "player/stability.h"
#include "runtime/backend.h"

#include <CLI/CLI.hpp>

#include <cmath>
#include <cstdio>
#include <numbers>

namespace gsc {

namespace {

constexpr const char* kExamples = R"(Examples:
  gsc-play room.gsc --out 'frames/{name}.png'
      every camera stored in the file, at its own size
  gsc-play room.gsc --cameras path.json --frames 0:100 --size 1920x1080 --out 'out/{frame:04}.png' --stats out.jsonl
      the first 100 frames of a trajectory, with what each cost
  gsc-play room.gsc --tier exact --depth 16 --out 'exact/{name}.png'
      the trainer's own image, 16 bits per channel
  gsc-play room.gsc --eyes 2 --ipd 0.065 --out 'vr/{frame:04}_{eye}.exr'
      both eyes, 32-bit float
  gsc-play room.gsc --cameras path.json --reuse error --reuse-bound 1 --stats out.jsonl
      decoded Gaussians are drawn again while they change by less than 1/255
  gsc-play city.gsc --cameras flight.json --target-ms 11 --lod-fade 0.5 --lod-hysteresis 0.1 --stats out.jsonl
      detail falls where a frame would take longer than 11 ms, and no level pops
  gsc-play bench room.gsc --eyes 2 --ipd 0.065 --size 2048x2048 --fov 90
      what a frame costs, stage by stage; gsc-play bench --help

Results go to standard output, everything else to standard error.
Exit codes: 0 ok, 1 usage, 2 I/O, 3 invalid file, 4 internal, 5 unsupported, 6 out of memory, 7 device,
130 interrupted.)";

constexpr const char* kBenchExamples = R"(Examples:
  gsc-play bench room.gsc --size 1920x1080
      300 frames round the stored cameras after 50 of warm-up, as a table
  gsc-play bench city.gsc --cameras flight.json --eyes 2 --ipd 0.065 --size 2048x2048 --fov 90 --quality 16 --out b.jsonl
      two eyes on a path, 16 frames scored against the tier `exact`, a line added to b.jsonl

  gsc-play bench room.gsc --sweep sweep.json --out runs.jsonl
      every combination of reuse, bounds and budgets that sweep.json asks for; gsc chart draws runs.jsonl

Images stay on the device. Times of stages are the device's own, `wall` is what the caller waits. A
sweep scores every frame: a backend on the host is timed and scored in one pass, scoring outside the times; any other
is timed first and renders again for the scores.
Exit codes: 0 ok, 1 usage, 2 I/O, 3 invalid file, 4 internal, 5 unsupported, 6 out of memory, 7 device,
130 interrupted.)";

constexpr const char* kStabilityExamples = R"(Examples:
  gsc sample paths room.gsc -o paths && gsc-play stability room.gsc --trajectories paths --size 640x480 --reuse error
      every breaking path, each frame against the tier exact; exit code 8 if one passes a bound

Exit codes: 0 ok, 1 usage, 2 I/O, 3 invalid file, 4 internal, 5 unsupported, 6 out of memory, 7 device, 8 a bound was
passed, 130 interrupted.)";

std::string versionText()
{
    std::string text = formatString("gsc-play %s%s%s\nfile format %u.%u\nimages %s\n", GSC_VERSION,
                                    *GSC_COMMIT != 0 ? ", commit " : "", GSC_COMMIT, kVersionMajor, kVersionMinor,
                                    imageExtensions().c_str());
    for (const BackendInfo& backend : availableBackends())
        text += formatString("backend %s: %s\n", backend.name.c_str(), backend.description.c_str());
    text.pop_back(); // CLI11 ends the line
    return text;
}

// Options whose text becomes something else; kept until parsing is over.
struct RawText {
    std::string size, background = "model", frames;
    double fov_degrees = 0;
};

void addFile(CLI::App& app, PlayOptions& options)
{
    app.add_option("FILE", options.input, "Model to play, a .gsc")->required()->option_text("(required)");
}

// `range`: the option that picks some of the cameras.
void addCameraOptions(CLI::App& app, PlayOptions& options, RawText& raw, const char* range)
{
    app.add_option("--cameras", options.cameras,
                   "cameras.json of a trained model, transforms.json, a trajectory (schemas/trajectory.schema.json), "
                   "or \"stored\": those in FILE")
        ->option_text("FILE|stored (default: stored)");
    app.add_option(range, raw.frames, "Cameras A to B-1 only; A alone is one camera")->type_name("A:B");
}

void addViewOptions(CLI::App& app, PlayOptions& options, RawText& raw)
{
    app.add_option("--size", raw.size, "Pixels of the image; default: the camera's")->type_name("WxH");
    app.add_option("--fov", raw.fov_degrees, "Horizontal angle of view; default: the camera's")->type_name("DEGREES");
    app.add_option("--eyes", options.eyes, "1, or 2 for stereo")
        ->check(CLI::Range(1, 2))
        ->option_text("1|2 (default: 1)");
    app.add_option("--ipd", options.ipd, "Distance of the two eyes in world units; default: what the trajectory states")
        ->type_name("LENGTH");
    addChoice<StereoMode>(app, "--stereo", options.stereo, stereoModes(),
                          "exact: the networks look from each eye; merged: from the middle between the two, once for "
                          "both")
        ->option_text("exact|merged (default: exact)");
    app.add_option("--appearance", options.appearance,
                   "Row of the appearance embedding for every camera; default: the camera's own")
        ->check(CLI::Range(0, std::numeric_limits<int>::max()))
        ->option_text("ROW");
    app.add_option("--background", raw.background, "Colour behind the model, or what it was trained with")
        ->option_text("R,G,B|model (default: model)");
    app.add_option("--near", options.near_z, "Nearest depth drawn, world units; default: the model's")->type_name("Z");
}

void addRunOptions(CLI::App& app, PlayOptions& options)
{
    addChoice<Tier>(
        app, "--tier", options.tier, {{"exact", Tier::Exact}, {"fast", Tier::Fast}},
        "exact: the trainer's image, of a model far from the origin without what rounding does to it there; fast: "
        "half precision where the backend has it; the CPU renders exact")
        ->option_text("exact|fast (default: fast)");
    app.add_option("--backend", options.backend, "What renders; --version lists what there is")
        ->option_text("auto|NAME (default: auto)");
    app.add_option("--threads", options.threads, "CPU threads, 0 = all cores")
        ->check(CLI::Range(0, 4096))
        ->option_text("N (default: 0)");
    app.add_option("--vram-budget", options.vram_budget,
                   "Most device memory for model and frame, such as 4G; frames that need more are drawn in more passes")
        ->transform(CLI::AsSizeValue(false))
        ->option_text("SIZE (default: all there is)");
    app.add_flag("--verify", options.verify, "Check the checksum of every byte before the first frame");
    addReuseOptions(app, options);
}

void addMessageOptions(CLI::App& app, PlayOptions& options)
{
    addChoice<ReportFormat>(app, "--format", options.format,
                            {{"text", ReportFormat::Text}, {"json", ReportFormat::Json}},
                            "Of the summary on standard output")
        ->option_text("text|json (default: text)");
    addChoice<ProgressStyle>(app, "--progress", options.progress,
                             {{"auto", ProgressStyle::Auto},
                              {"bar", ProgressStyle::Bar},
                              {"plain", ProgressStyle::Plain},
                              {"json", ProgressStyle::Json},
                              {"none", ProgressStyle::None}},
                             "On standard error")
        ->option_text("auto|bar|plain|json|none");
    app.add_flag("-q,--quiet", options.quiet, "No progress and no warnings");
}

void addBenchOptions(CLI::App& app, BenchOptions& options)
{
    constexpr uint32_t kMany = 1000000;
    app.add_option("--warmup", options.warmup, "Frames before the measured ones")
        ->check(CLI::Range(0u, kMany))
        ->option_text("N (default: 50)");
    app.add_option("--frames", options.frames, "Frames to measure, going round the cameras")
        ->check(CLI::Range(1u, kMany))
        ->option_text("N (default: 300)");
    app.add_option("--quality", options.quality, "Cameras to score against the tier exact")
        ->check(CLI::Range(0u, kMany))
        ->option_text("N (default: 0)");
    app.add_option("--reference", options.reference, "Backend that renders exact for --quality")
        ->option_text("NAME (default: the measured one)");
    app.add_option("--label", options.label, "Text for the report, such as what changed")->type_name("TEXT");
    app.add_option("--out", options.out, "File that takes one more line (schemas/bench-report.schema.json)")
        ->type_name("FILE");
    CLI::Option* sweep = app.add_option("--sweep", options.sweep,
                                        "Runs every combination that CONFIG asks for (schemas/sweep.schema.json), each "
                                        "from a cold start, scored against exact; --out takes a row for each "
                                        "(schemas/run.schema.json) and is gone on with where a sweep was stopped");
    sweep->type_name("CONFIG");
    for (const char* fixed : {"--cameras", "--shots", "--warmup", "--frames", "--quality", "--target-ms"})
        sweep->excludes(app.get_option(fixed)); // CONFIG says these
}

// What `stability` takes beside what is played and how.
void addStabilityOptions(CLI::App& app, StabilityOptions& options)
{
    app.add_option("--trajectories", options.trajectories, "Camera files, or folders of them")
        ->option_text("FILE|DIR...");
    app.add_option("--frames", options.frames, "First N frames of each")
        ->check(CLI::Range(1u, 1000000u))
        ->option_text("N (default: all)");
    app.add_option("--warmup", options.warmup, "Frames at the start of each that the times leave out")
        ->check(CLI::Range(0u, 1000000u))
        ->option_text("N (default: 5)");
    app.add_option("--reference", options.reference, "Backend that renders exact")
        ->option_text("NAME (default: the measured one)");
    app.add_option("--bound-psnr", options.bound_psnr, "Least of any frame against exact, dB; 0 = no bound")
        ->check(CLI::Range(0.0, 1000.0))
        ->option_text("DB (default: 50)");
    app.add_option("--bound-temporal", options.bound_temporal,
                   "Most that the error image changes in one frame, in medians of the trajectory; 0 = no bound")
        ->check(CLI::Range(0.0, 1e9))
        ->option_text("X (default: 2)");
    app.add_option("--bound-p99", options.bound_p99, "Most of the time of a frame at p99, in medians; 0 = no bound")
        ->check(CLI::Range(0.0, 1e9))
        ->option_text("X (default: 0)");
}

void addOutputOptions(CLI::App& app, PlayOptions& options)
{
    app.add_option("--out", options.out,
                   "Images to write; {name}, {frame}, {frame:04} and {eye} are filled in (" + imageExtensions() + ")")
        ->type_name("PATTERN");
    addChoice<PixelDepth>(app, "--depth", options.depth, {{"8", PixelDepth::Eight}, {"16", PixelDepth::Sixteen}},
                          "Bits per channel of a PNG")
        ->option_text("8|16 (default: 8)");
    app.add_option("--stats", options.stats,
                   "One JSON object per frame and line: time per stage, counts (schemas/frame-stats.schema.json); - is "
                   "standard output")
        ->type_name("FILE");
    app.add_flag("-w,--overwrite", options.overwrite, "Replace files that exist");
    addMessageOptions(app, options);
    app.add_flag("-v,--verbose", options.verbose, "A line per frame");
}

std::vector<float> parseColor(const std::string& text)
{
    float r = 0, g = 0, b = 0;
    int used = 0;
    if (std::sscanf(text.c_str(), "%f,%f,%f%n", &r, &g, &b, &used) != 3 || size_t(used) != text.size() ||
        !std::isfinite(r) || !std::isfinite(g) || !std::isfinite(b))
        throw Error(ErrorCode::Usage,
                    formatString("--background %s: no colour, expected three numbers such as 0,0,0 or \"model\"",
                                 text.c_str()));
    return {r, g, b};
}

void checkEyes(const PlayOptions& options)
{
    if (options.stereo == StereoMode::Merged && options.eyes == 1)
        throw Error(ErrorCode::Usage, "--stereo merged: has no effect with one eye, expected two; pass --eyes 2");
}

// `paths_follow`: cameras are read from files that are not known yet.
void finish(const CLI::App& app, PlayOptions& options, const RawText& raw, bool paths_follow = false)
{
    checkReuseOptions(app, options);
    if (!raw.size.empty())
        parseSize(raw.size, options.width, options.height);
    if (!raw.frames.empty())
        parseFrameRange(raw.frames, options.frame_first, options.frame_end);
    if (raw.background != "model")
        options.background = parseColor(raw.background);
    if (raw.fov_degrees != 0) {
        if (!(raw.fov_degrees > 0.01 && raw.fov_degrees < 179.9))
            throw Error(ErrorCode::Usage,
                        formatString("--fov %g: out of range, expected 0.01 to 179.9 degrees", raw.fov_degrees));
        options.fov_x = raw.fov_degrees * std::numbers::pi / 180;
    }
    // a trajectory may state the distance itself; play() asks again when it has read it
    const bool may_be_stated = options.ipd == 0 && (paths_follow || options.cameras != "stored");
    if (options.eyes == 2 && !may_be_stated && !(options.ipd > 0 && options.ipd < 1e15))
        throw Error(ErrorCode::Usage, formatString("--ipd %g: two eyes need a distance, expected a number above 0 in "
                                                   "world units of the model; pass --ipd LENGTH",
                                                   options.ipd));
    if (!paths_follow)
        checkEyes(options);
    if (options.stereo == StereoMode::Merged && options.reuse.policy != ReusePolicy::None)
        throw Error(ErrorCode::Usage, "--stereo merged: together with --reuse, which keeps what each eye decoded, "
                                      "expected one of them; pass --reuse none or --stereo exact");
    if (!(options.near_z >= 0 && options.near_z < 1e15))
        throw Error(ErrorCode::Usage, formatString("--near %g: expected a number above 0", options.near_z));
    if (isStandardOutput(options.out))
        checkOutput(options.out, OutputKind::Binary, false);
    if (!options.out.empty() && !isImageExtension(options.out))
        throw Error(ErrorCode::Unsupported,
                    formatString("--out %s: this build cannot write such a file, expected one of %s",
                                 options.out.c_str(), imageExtensions().c_str()));
}

// A decimal number and nothing else; false otherwise.
bool parseNumber(const std::string& text, uint64_t largest, uint64_t& value)
{
    if (text.empty() || text.size() > 15 || text.find_first_not_of("0123456789") != std::string::npos)
        return false;
    value = std::stoull(text);
    return value <= largest;
}

} // namespace

void parseSize(const std::string& text, uint32_t& width, uint32_t& height)
{
    constexpr uint64_t kMaxSide = 32768;
    const size_t x = text.find_first_of("xX");
    uint64_t w = 0, h = 0;
    if (x == std::string::npos || !parseNumber(text.substr(0, x), kMaxSide, w) ||
        !parseNumber(text.substr(x + 1), kMaxSide, h) || w == 0 || h == 0)
        throw Error(ErrorCode::Usage, formatString("--size %s: no size, expected width x height such as 1920x1080, "
                                                   "each 1 to 32768",
                                                   text.c_str()));
    width = uint32_t(w);
    height = uint32_t(h);
}

void parseFrameRange(const std::string& text, uint64_t& first, uint64_t& end)
{
    constexpr uint64_t kNoEnd = std::numeric_limits<uint64_t>::max();
    const size_t colon = text.find(':');
    const std::string head = text.substr(0, colon);
    const std::string tail = colon == std::string::npos ? "" : text.substr(colon + 1);
    uint64_t a = 0, b = kNoEnd;
    bool good = (head.empty() && colon != std::string::npos) || parseNumber(head, kNoEnd, a);
    if (colon == std::string::npos)
        b = a + 1;
    else
        good = good && (tail.empty() || parseNumber(tail, kNoEnd, b));
    if (!good || a >= b)
        throw Error(ErrorCode::Usage,
                    formatString("--frames %s: no range, expected A:B with A below B, or one number", text.c_str()));
    first = a;
    end = b;
}

std::optional<int> parsePlayOptions(int argc, const char* const* argv, PlayOptions& options)
{
    CLI::App app("Plays a .gsc model: renders it from the cameras given, without a window.", "gsc-play");
    app.footer(kExamples);
    app.set_version_flag("--version", versionText, "Version, file format and backends");
    RawText raw;
    addFile(app, options);
    addCameraOptions(app, options, raw, "--frames");
    addViewOptions(app, options, raw);
    addRunOptions(app, options);
    addTargetOption(app, options);
    addOutputOptions(app, options);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? 0 : int(ErrorCode::Usage);
    }
    finish(app, options, raw);
    return std::nullopt;
}

std::optional<int> parseBenchOptions(int argc, const char* const* argv, BenchOptions& options)
{
    CLI::App app("Measures what the frames of a .gsc model cost.", "gsc-play bench");
    app.footer(kBenchExamples);
    RawText raw;
    addFile(app, options.play);
    addCameraOptions(app, options.play, raw, "--shots");
    addViewOptions(app, options.play, raw);
    addRunOptions(app, options.play);
    addTargetOption(app, options.play);
    addBenchOptions(app, options);
    addMessageOptions(app, options.play);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? 0 : int(ErrorCode::Usage);
    }
    finish(app, options.play, raw, !options.sweep.empty());
    if (options.quality > 0 && options.play.reuse.policy != ReusePolicy::None)
        throw Error(ErrorCode::Usage, "--quality: scores single pictures and would not see what --reuse does to a "
                                      "path, expected --reuse none; pass --sweep CONFIG.json to score whole paths");
    if (options.quality > 0 && (options.play.lod_hysteresis > 0 || options.play.target_ms > 0))
        throw Error(ErrorCode::Usage,
                    "--quality: scores single pictures, to which --lod-hysteresis and --target-ms do nothing, expected "
                    "neither; pass --sweep CONFIG.json to score whole paths");
    return std::nullopt;
}

std::optional<int> parseStabilityOptions(int argc, const char* const* argv, StabilityOptions& options)
{
    CLI::App app(
        "Plays trajectories that were made to break what is kept between frames, and says whether the pictures "
        "hold still.",
        "gsc-play stability");
    app.footer(kStabilityExamples);
    RawText raw;
    addFile(app, options.play);
    addStabilityOptions(app, options);
    addViewOptions(app, options.play, raw);
    addRunOptions(app, options.play);
    addMessageOptions(app, options.play);
    try {
        app.parse(argc, argv);
    } catch (const CLI::ParseError& e) {
        return app.exit(e) == 0 ? 0 : int(ErrorCode::Usage);
    }
    finish(app, options.play, raw, true);
    checkEyes(options.play);
    for (const double bound : {options.bound_psnr, options.bound_temporal, options.bound_p99})
        if (!(bound >= 0))
            throw Error(ErrorCode::Usage, "--bound-psnr, --bound-temporal, --bound-p99: expected numbers from 0");
    return std::nullopt;
}

} // namespace gsc
