// SPDX-License-Identifier: Apache-2.0
#include "player/reuse_options.h"

#include "format/error.h"
#include "player/cli_choice.h"
#include "player/reuse_names.h"

namespace gsc {

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
           "Most anchors decoded per frame and eye, the worst first; what was never decoded is decoded all the same. "
           "0 = as many as --reuse wants")
        ->check(CLI::Range(uint64_t(0), uint64_t(1) << 40))
        ->option_text("N (default: 0)");
    app.add_option("--cache-budget", reuse.cache_bytes, "Most memory of decoded Gaussians, such as 256M")
        ->transform(CLI::AsSizeValue(false))
        ->option_text("SIZE (default: a quarter of the machine's)");
    app.add_flag("--cut-cache", reuse.cut, "Keep which groups are visible while the camera cannot have changed it");
    app.add_flag("--order-cache", reuse.order, "Sort from the last frame's depth order");
    app.add_option("--lod-bias", options.lod_bias,
                   "Levels added to the one that distance asks for: below 0 draws less, 0 is the trainer's")
        ->option_text("X (default: 0)");
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
    for (const char* option : {"--reuse-depth", "--reuse-guidance"})
        needs(option, reuse.policy == ReusePolicy::Depth, "--reuse depth");
    needs("--reuse-bound", reuse.policy == ReusePolicy::Error, "--reuse error");
    for (const char* option : {"--decode-budget", "--cache-budget"})
        needs(option, reuse.policy != ReusePolicy::None, "--reuse depth or --reuse error");
}

} // namespace gsc
