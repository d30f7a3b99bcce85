// SPDX-License-Identifier: Apache-2.0
#include "player/xr/xr.h"

#include <gsc/error.h>
#include <gsc/file/output_paths.h>
#include <gsc/interrupt.h>
#include "runtime/module/load_module.h"
#include "runtime/cli/json_lines.h"
#include "player/devices/open_renderer.h"
#include "player/devices/worker_options.h"
#include "player/devices/worker_report.h"
#include "player/xr/place_file.h"
#include "player/xr/xr_session.h"

#include <cerrno>
#include <cstring>
#include <string_view>

#include <sched.h>

namespace gsc {

namespace {

constexpr double kExitSeconds = 2; // time that the runtime gets to end an interrupted session

std::unique_ptr<Headset> openHeadset(const XrOptions& options, HeadsetFacts* known = nullptr)
{
#ifdef GSC_WITH_XR
    HeadsetOptions headset;
    headset.device = deviceUuid(firstDevice(options.play.devices));
    headset.scale = options.scale;
    headset.stage = options.stage;
    headset.depth = options.depth;
    headset.known = known;
    return loadModule<HeadsetFunctions>("gsc_headset").open(headset);
#else
    (void)options, (void)known;
    throw Error(ErrorCode::Unsupported, "headset", "this build has none", "one made with Vulkan and OpenXR",
                "run .ci/setup.sh headset and build again, or play without a headset");
#endif
}

// Throws before the session begins if an output file cannot be written, or is named twice.
void checkFiles(const XrOptions& options)
{
    checkJsonLines(options.log, options.play.output.overwrite, options.play.model.file, options.play.cameras.file);
    if (!options.keeps_place)
        return;
    const std::string place = placePath(options.play.model.file);
    checkOutput(place, OutputKind::Text, true);
    const NamedPath outputs[] = {{place, "--keep-place"}, {options.log, "--log"}};
    checkOutputsDiffer({outputs, options.log.empty() ? 1u : 2u}, {});
}

// Returns true if the headset causes the error, so that a window could still show the model.
bool isOfHeadset(const Error& e)
{
    return (e.code() == ErrorCode::Device || e.code() == ErrorCode::Unsupported) &&
           (e.subject() == "headset" || e.subject() == "display");
}

// While this object lives, its thread runs before ordinary threads, such as those that draw. This needs the user's
// permission (`ulimit -r`, CAP_SYS_NICE), and the user must have asked for no other scheduling. Threads started by it
// are ordinary.
class RealTime {
public:
    explicit RealTime(Reporter& log)
    {
        if (sched_getscheduler(0) != SCHED_OTHER)
            return;
        sched_param priority = {};
        priority.sched_priority = sched_get_priority_min(SCHED_FIFO);
        m_taken = sched_setscheduler(0, SCHED_FIFO | SCHED_RESET_ON_FORK, &priority) == 0;
        if (!m_taken)
            log.detail(formatString("the session's thread has no real-time priority (%s)", std::strerror(errno)));
    }
    ~RealTime()
    {
        const sched_param ordinary = {};
        if (m_taken) // note: only CAP_SYS_NICE may take SCHED_RESET_ON_FORK away again
            sched_setscheduler(0, SCHED_OTHER | SCHED_RESET_ON_FORK, &ordinary);
    }
    RealTime(const RealTime&) = delete;
    RealTime& operator=(const RealTime&) = delete;

private:
    bool m_taken = false;
};

// Runs the session until it is over, or until it does not end in time after an interrupt.
void play(XrSession& session)
{
    std::optional<std::chrono::steady_clock::time_point> since;
    while (session.step()) {
        if (!interrupted())
            continue;
        if (!since)
            since = std::chrono::steady_clock::now();
        session.requestExit();
        if (std::chrono::steady_clock::now() - *since > std::chrono::duration<double>(kExitSeconds))
            return;
    }
}

OrderedJson spreadJson(const Spread& spread)
{
    return {{"mean", spread.mean},
            {"median", spread.median},
            {"p95", spread.p95},
            {"p99", spread.p99},
            {"max", spread.max}};
}

// Describes the share of each view's pixels that is not drawn.
std::string maskText(const HeadsetFacts& facts)
{
    if (!facts.tells_mask)
        return "none (XR_KHR_visibility_mask is not offered)";
    std::string text;
    for (const HeadsetView& view : facts.views)
        text += (text.empty() ? "" : ", ") + (view.hidden ? formatString("%.1f %%", 100 * *view.hidden) : "unknown");
    return "hides " + text + " of the pixels";
}

} // namespace

XrSummary runXr(const XrOptions& options, Reporter& log)
{
    checkFiles(options);
    std::unique_ptr<Headset> headset;
    try {
        headset = openHeadset(options);
    } catch (const Error& e) {
        throw HeadsetError(e);
    }
    const std::shared_ptr<const Scene> scene = openScene(options.play.model, options.play.devices, log);
    const HeadsetFacts& facts = headset->facts();
    log.tell(formatString("%s on %s, %s of %ux%u", facts.headset.c_str(), facts.runtime.c_str(),
                          formatCount(facts.views.size(), "view").c_str(), facts.views.front().width,
                          facts.views.front().height));
    if (!facts.draws)
        log.detail(formatString("%s shows what another device draws: pictures go through memory of the host",
                                facts.gpu.c_str()));
    if (options.depth && !facts.takes_depth)
        log.warning(
            "headset: the OpenXR runtime takes no depths, expected the extension XR_KHR_composition_layer_depth "
            "and the format D32_SFLOAT for --xr-depth; pictures go without");
    std::optional<XrSession> session;
    try {
        session.emplace(options, scene, *headset, log);
        const RealTime real_time(log);
        play(*session);
    } catch (const Error& e) {
        if (session && options.keeps_place)
            try {
                log.tell("wrote " + session->keepPlace());
            } catch (const Error& of_place) {
                log.warning(of_place.what());
            }
        if (isOfHeadset(e))
            throw HeadsetError(e);
        throw;
    }
    const XrSummary summary = session->finish();
    if (interrupted())
        throw Error(ErrorCode::Interrupted, "interrupted", "the session was ended by a signal",
                    "that it is left in the headset", "what was written is whole");
    return summary;
}

HeadsetFacts headsetFacts(const XrOptions& options, HeadsetFacts& known, Reporter& log)
{
    const std::unique_ptr<Headset> headset = openHeadset(options, &known);
    HeadsetFacts facts = headset->facts();
    if (!facts.tells_mask)
        return facts;
    ViewLenses lenses(*headset, log);
    std::vector<SpaceEye> eyes;
    try { // outside of a frame a runtime may not know where the eyes are
        if (const int64_t time = headset->now(); time > 0 && headset->locate(time, eyes))
            lenses.follow(eyes);
    } catch (const Error& e) {
        log.detail(e.what());
    }
    lenses.tell(facts);
    return facts;
}

OrderedJson headsetJson(const HeadsetFacts& facts)
{
    OrderedJson views = OrderedJson::array();
    for (const HeadsetView& view : facts.views)
        views.push_back({{"size", {view.width, view.height}},
                         {"recommended", {view.recommended_width, view.recommended_height}},
                         {"most", {view.most_width, view.most_height}},
                         {"hidden", view.hidden ? OrderedJson(*view.hidden) : OrderedJson()}});
    return {{"loader", facts.loader},
            {"vulkan", facts.vulkan},
            {"runtime", facts.runtime},
            {"headset", facts.headset},
            {"gpu", facts.gpu},
            {"gpu_draws", facts.draws},
            {"configuration", facts.configuration},
            {"views", views},
            {"formats", facts.formats},
            {"format", facts.format.empty() ? OrderedJson() : OrderedJson(facts.format)},
            {"spaces", facts.spaces},
            {"extensions", facts.extensions},
            {"tracks_gaze", facts.tracks_gaze},
            {"tells_mask", facts.tells_mask},
            {"takes_depth", facts.takes_depth}};
}

std::string headsetText(const HeadsetFacts& facts)
{
    const auto joined = [](const std::vector<std::string>& words) {
        std::string text;
        for (const std::string& word : words)
            text += (text.empty() ? "" : ", ") + word;
        return text.empty() ? std::string("none") : text;
    };
    std::string text =
        formatString("loader      %s\nvulkan      %s\nruntime     %s\nheadset     %s\n", facts.loader.c_str(),
                     facts.vulkan.c_str(), facts.runtime.c_str(), facts.headset.c_str());
    text += formatString("gpu         %s, %s\n", facts.gpu.c_str(),
                         facts.draws ? "which draws" : "not the device that draws: pictures go through the host");
    text += formatString("views       %zu, %s\n", facts.views.size(), facts.configuration.c_str());
    for (const HeadsetView& view : facts.views)
        text += formatString("            %ux%u, recommended %ux%u, at most %ux%u\n", view.width, view.height,
                             view.recommended_width, view.recommended_height, view.most_width, view.most_height);
    text +=
        "formats     " + joined(facts.formats) + "; taken: " + (facts.format.empty() ? "none" : facts.format) + "\n";
    text += "spaces      " + joined(facts.spaces) + "\n";
    text += std::string("gaze        ") + (facts.tracks_gaze ? "tracked" : "not tracked") + "\n";
    text += "lens mask   " + maskText(facts) + "\n";
    text += "extensions  " + joined(facts.extensions) + "\n";
    return text;
}

std::string headsetText(const HeadsetFacts& known, const Error& why)
{
    if (known.loader.empty())
        return {};
    const auto named = [](const std::string& name) { return name.empty() ? "none" : name.c_str(); };
    return formatString("loader      %s\nvulkan      %s\ngpu         %s\nruntime     %s\nheadset     none: %s\n",
                        named(known.loader), named(known.vulkan), named(known.gpu), named(known.runtime),
                        why.found().c_str());
}

OrderedJson xrJson(const XrSummary& summary)
{
    return {
        {"schema", "gsc.xr/1"},
        {"tool", {{"name", "gsc-play"}, {"version", thisTool().version}}},
        {"file", summary.file},
        {"headset", headsetJson(summary.headset)},
        {"seconds", summary.seconds},
        {"frames",
         {{"ended", summary.frames},
          {"visible", summary.visible},
          {"untracked", summary.untracked},
          {"missed", summary.missed}}},
        {"pictures", summary.pictures},
        {"age", spreadJson(summary.age)},
        {"ages", summary.ages},
        {"off_ms", spreadJson(summary.off_ms)},
        {"busy_ms", spreadJson(summary.busy_ms)},
        {"latency_ms", spreadJson(summary.latency_ms)},
        {"renewals", summary.renewals},
        {"workers", workersJson(summary.service)},
        {"place", summary.place.empty() ? OrderedJson() : OrderedJson(summary.place)},
    };
}

std::string xrText(const XrSummary& summary)
{
    std::string text = formatString(
        "%s in %.1f s, %s visible, %s missed; %s\n", formatCount(summary.frames, "frame").c_str(), summary.seconds,
        formatCount(summary.visible).c_str(), formatCount(summary.missed, "refresh", "refreshes").c_str(),
        formatCount(summary.pictures, "picture").c_str());
    uint64_t shown = 0;
    for (const uint64_t count : summary.ages)
        shown += count;
    if (shown > 0) {
        const uint64_t fresh = summary.ages[0] + summary.ages[1] + summary.ages[2];
        text += formatString("age of what is shown: median %.0f refreshes, p99 %.0f, most %.0f; %.2f %% at most 2\n",
                             summary.age.median, summary.age.p99, summary.age.max, 100 * double(fresh) / double(shown));
        text += formatString(
            "from pose to picture: median %.2f ms, p99 %.2f ms; busy time of the thread per frame: median %.3f ms, "
            "p99 %.3f ms\n",
            summary.latency_ms.median, summary.latency_ms.p99, summary.busy_ms.median, summary.busy_ms.p99);
    }
    if (summary.headset.tells_mask)
        text += "lens mask: " + maskText(summary.headset) + "\n";
    text += workersText(serviceFacts(summary.service));
    if (!summary.place.empty())
        text += "wrote " + summary.place + "\n";
    return text;
}

} // namespace gsc
