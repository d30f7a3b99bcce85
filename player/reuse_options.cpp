// SPDX-License-Identifier: Apache-2.0
#include "player/reuse_options.h"

#include "format/error.h"
#include "player/cli_choice.h"
#include "player/reuse_names.h"

#include <utility>

namespace gsc {

namespace {

constexpr double kMaxTargetMs = 60000;

} // namespace

void addReuseOptions(CLI::App& app, PlayOptions& options)
{
    ReuseOptions& reuse = options.reuse;
    addChoice<ReusePolicy>(app, "--reuse", reuse.policy, reusePolicies(),
                           "When decoded Gaussians are drawn again in later frames: none: never; depth: for so many "
                           "frames, fewer the more of the view is new; error: while their predicted change stays "
                           "within a bound")
        ->option_text("none|depth|error (default: none)");
    app.add_option("--reuse-depth", reuse.max_depth, "Frames a Gaussian is drawn again at most, with --reuse depth")
        ->check(CLI::Range(0u, kMaxReuseDepth))
        ->option_text("N (default: 10)");
    addChoice<DepthGuidance>(app, "--reuse-guidance", reuse.guidance, depthGuidances(),
                             "How the share of the view that is new becomes a depth, with --reuse depth")
        ->option_text("linear|exponential|staged (default: linear)");
    app.add_option("--reuse-bound", reuse.bound,
                   "Predicted change of what an anchor draws, in 1/255, with --reuse error")
        ->option_text("B (default: 1)");
    app.add_option(
           "--decode-budget", reuse.decode_budget,
           "Most anchors decoded per frame and eye, the worst first, with --reuse error; what was never decoded "
           "is decoded all the same. 0 = as many as the bound wants")
        ->check(CLI::Range(uint64_t(0), uint64_t(1) << 40))
        ->option_text("N (default: 0)");
    app.add_option("--cache-budget", reuse.cache_bytes, "Most memory of decoded Gaussians, such as 256M")
        ->transform(CLI::AsSizeValue(false))
        ->option_text("SIZE (default: a quarter of the machine's)");
    app.add_flag(
        "--cut-cache", reuse.cut,
        "Keep which groups are visible while the camera cannot have changed it: the same picture, less selection. "
        "Pays where the camera moves little from frame to frame");
    app.add_flag("--order-cache", reuse.order,
                 "Sort by what the last frame's depth order was: the same picture; up to a fifth less time in the sort "
                 "on a CPU, and up to a fifth more on CUDA");
    app.add_option("--lod-bias", options.lod_bias,
                   "Levels added to the one that distance asks for: below 0 draws less, 0 is the trainer's")
        ->option_text("X (default: 0)");
    app.add_option("--lod-fade", options.lod_fade,
                   "Levels over which an anchor fades in about the place where the trainer's switches it on, up to 1")
        ->option_text("X (default: 0)");
    app.add_option("--lod-hysteresis", options.lod_hysteresis,
                   "Levels that a switch may lag behind the camera, up to 1: one that trembles at it switches nothing")
        ->option_text("X (default: 0)");
}

void addTargetOption(CLI::App& app, PlayOptions& options)
{
    app.add_option("--target-ms", options.target_ms,
                   "Hold this frame time: levels fall while frames take longer, and come back slowly up to --lod-bias")
        ->option_text("MS (default: none)");
}

void checkReuseOptions(const CLI::App& app, const PlayOptions& options)
{
    const ReuseOptions& reuse = options.reuse;
    const auto needs = [&](const char* option, bool fits, const char* expected) {
        if (!fits && app.count(option) > 0)
            throw Error(ErrorCode::Usage, formatString("%s: has no effect with --reuse %s, expected %s; pass it or "
                                                       "leave %s out",
                                                       option, policyName(reuse.policy), expected, option));
    };
    // written so that a NaN fails
    if (!(reuse.bound >= 0 && double(reuse.bound) <= kMaxReuseBound))
        throw Error(ErrorCode::Usage, formatString("--reuse-bound %g: out of range, expected 0 to %g, in 1/255",
                                                   double(reuse.bound), kMaxReuseBound));
    if (!(options.lod_bias >= -kMaxLodBias && options.lod_bias <= kMaxLodBias))
        throw Error(ErrorCode::Usage, formatString("--lod-bias %g: out of range, expected %g to %g levels",
                                                   options.lod_bias, -kMaxLodBias, kMaxLodBias));
    for (const auto& [option, value] :
         {std::pair<const char*, double>{"--lod-fade", options.lod_fade}, {"--lod-hysteresis", options.lod_hysteresis}})
        if (!(value >= 0 && value <= kMaxLodWidth))
            throw Error(ErrorCode::Usage,
                        formatString("%s %g: out of range, expected 0 to %g levels", option, value, kMaxLodWidth));
    const bool has_target = app.get_option_no_throw("--target-ms") != nullptr && app.count("--target-ms") > 0;
    if (has_target && !(options.target_ms > 0 && options.target_ms <= kMaxTargetMs))
        throw Error(ErrorCode::Usage, formatString("--target-ms %g: out of range, expected a time above 0 and up to "
                                                   "%g milliseconds",
                                                   options.target_ms, kMaxTargetMs));
    for (const char* option : {"--reuse-depth", "--reuse-guidance"})
        needs(option, reuse.policy == ReusePolicy::Depth, "--reuse depth");
    for (const char* option : {"--reuse-bound", "--decode-budget"})
        needs(option, reuse.policy == ReusePolicy::Error, "--reuse error");
    needs("--cache-budget", reuse.policy != ReusePolicy::None, "--reuse depth or --reuse error");
}

} // namespace gsc
