// SPDX-License-Identifier: Apache-2.0
#include "player/window/panel.h"

#include <gsc/error.h>
#include "runtime/records/frame_numbers.h"
#include "runtime/records/reuse_names.h"
#include "runtime/cli/reporter.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr size_t kHistory = 240; // number of values in a plot

using Kind = OverlayItem::Kind;

template <typename Names, typename Value>
int indexOf(const Names& names, Value value)
{
    for (size_t i = 0; i < names.size(); ++i)
        if (names[i].second == value)
            return int(i);
    return -1;
}

template <typename Names>
std::vector<std::string> wordsOf(const Names& names)
{
    std::vector<std::string> words;
    for (const auto& [word, value] : names)
        words.push_back(word);
    return words;
}

std::string stageLabel(const char* stage)
{
    return std::string(stage) + ", ms";
}

} // namespace

Panel::Panel(const ViewLimits& limits, std::vector<std::string> cameras, Overlay& overlay) : m_overlay(overlay)
{
    add(Kind::Heading, "Camera");
    add(Kind::Text, "pose");
    add(Kind::Choice, "movement", "keys 1, 2, 3");
    item("movement").choices = {"fly", "orbit", "walk"};
    add(Kind::Text, "speed");
    add(Kind::Choice, "camera", "PageUp, PageDown");
    item("camera").choices = std::move(cameras);
    add(Kind::Button, "screenshot", "F12");
    add(Kind::Button, "record the path", "R");

    add(Kind::Heading, "Picture");
    add(Kind::Choice, "tier", "T");
    item("tier").choices = wordsOf(tiers());
    add(Kind::Choice, "reuse", "U");
    item("reuse").choices = wordsOf(reusePolicies());
    add(Kind::Slider, "reuse bound, 1/255", "with reuse error: predicted change that is drawn");
    item("reuse bound, 1/255").most = 16;
    add(Kind::Choice, "detail, pixels", "G");
    item("detail, pixels").choices = wordsOf(kDetails);
    add(Kind::Slider, "level bias", "comma, period");
    item("level bias").least = -4;
    item("level bias").most = 4;
    add(Kind::Slider, "level fade", "levels over which an anchor fades in");
    item("level bias").enabled = item("level fade").enabled = limits.has_levels;
    add(Kind::Toggle, "two eyes", limits.no_stereo.empty() ? "O" : limits.no_stereo.c_str());
    item("two eyes").enabled = limits.no_stereo.empty();
    add(Kind::Colour, "background");
    add(Kind::Choice, "view", "V");
    item("view").choices = {"picture", "level", "age", "cost", "detail"};
    add(Kind::Choice, "against exact", "X; at rest");
    item("against exact").choices = {"off", "split", "difference"};
    add(Kind::Slider, "split", "[ and ]");

    add(Kind::Heading, "Time");
    add(Kind::Plot, "refresh, ms");
    add(Kind::Plot, "latency, ms");
    add(Kind::Plot, "frame, ms");

    add(Kind::Heading, "Stages");
    for (const auto& stage : kStages)
        add(Kind::Plot, stageLabel(stage.name).c_str());

    add(Kind::Heading, "Counts per eye");
    for (const EyeCount& count : kEyeCounts)
        add(Kind::Plot, count.name);

    add(Kind::Heading, "Machine");
    for (const char* const label : {"device", "memory", "cache", "poses", "workers"})
        add(Kind::Text, label);
    item("Stages").on = item("Counts per eye").on = item("Machine").on = false; // folded until somebody opens them
}

void Panel::add(Kind kind, const char* label, const char* hint)
{
    OverlayItem made;
    made.kind = kind;
    made.label = label;
    made.text = hint;
    made.on = kind == Kind::Heading;
    m_overlay.items.push_back(std::move(made));
}

OverlayItem& Panel::item(const char* label)
{
    const auto found = std::ranges::find(m_overlay.items, label, &OverlayItem::label);
    if (found == m_overlay.items.end())
        throw internalError("panel", formatString("has no %s", label), "one");
    return *found;
}

void Panel::plot(const char* label, double value)
{
    std::vector<float>& history = item(label).history;
    if (history.size() == kHistory)
        history.erase(history.begin());
    history.push_back(float(value));
}

void Panel::setSettings(const ViewSettings& settings, int camera, int mode, double speed)
{
    item("camera").choice = camera;
    item("movement").choice = mode;
    item("speed").text = formatString("%.3g world units a second", speed);
    item("tier").choice = indexOf(tiers(), settings.choice.tier);
    item("reuse").choice = indexOf(reusePolicies(), settings.choice.reuse.policy);
    item("reuse bound, 1/255").value = settings.choice.reuse.bound;
    item("reuse bound, 1/255").enabled = settings.choice.reuse.policy == ReusePolicy::Error;
    item("detail, pixels").choice = indexOf(kDetails, settings.choice.detail);
    item("level bias").value = float(settings.choice.lod_bias);
    item("level fade").value = float(settings.choice.lod_fade);
    item("two eyes").on = settings.two_eyes;
    std::copy_n(settings.background, 3, item("background").colour);
    item("view").choice = int(settings.view);
    item("against exact").choice = int(settings.compare);
    item("split").value = float(settings.split);
    item("split").enabled = settings.compare == CompareMode::Split;
}

bool Panel::take(ViewSettings& settings, int& camera, int& mode, bool& screenshot, bool& record)
{
    camera = item("camera").changed ? item("camera").choice : -1;
    mode = item("movement").changed ? item("movement").choice : -1;
    screenshot = item("screenshot").changed;
    record = item("record the path").changed;
    bool changed = false;
    for (OverlayItem& each : m_overlay.items) {
        changed = changed || each.changed;
        each.changed = false;
    }
    if (!changed)
        return false;
    settings.choice.tier = tiers()[size_t(item("tier").choice)].second;
    settings.choice.reuse.policy = reusePolicies()[size_t(item("reuse").choice)].second;
    settings.choice.reuse.bound = item("reuse bound, 1/255").value;
    if (const int detail = item("detail, pixels").choice; detail >= 0) // another than the listed stays
        settings.choice.detail = kDetails[size_t(detail)].second;
    settings.choice.lod_bias = item("level bias").value;
    settings.choice.lod_fade = item("level fade").value;
    settings.two_eyes = item("two eyes").on;
    std::copy_n(item("background").colour, 3, settings.background);
    settings.view = FrameView(item("view").choice);
    settings.compare = CompareMode(item("against exact").choice);
    settings.split = item("split").value;
    return true;
}

void Panel::addFrame(const PanelFrame& frame)
{
    plot("latency, ms", frame.latency_ms);
    plot("frame, ms", frame.result->times.total);
    for (const auto& stage : kStages)
        plot(stageLabel(stage.name).c_str(), frame.result->times.*stage.field);
    for (const EyeCount& count : kEyeCounts) {
        double sum = 0;
        for (uint32_t e = 0; e < frame.eyes; ++e)
            sum += double(frame.result->eyes[e].*count.field);
        plot(count.name, sum / frame.eyes);
    }
}

void Panel::addRefresh(double ms, bool rested)
{
    item("refresh, ms").text = rested ? "at rest" : "";
    if (!rested)
        plot("refresh, ms", ms);
}

void Panel::setFacts(const ServiceStats& stats, const FrameResult& last, const std::string& device,
                     const std::string& pose, bool recording)
{
    item("pose").text = pose;
    item("record the path").text = recording ? "R; records now" : "R";
    item("device").text = device;
    item("memory").text = formatBytes(last.bytes_resident);
    item("cache").text = formatBytes(last.cache_bytes);
    item("poses").text = formatString(
        "%s shown, %s late, %s expired, %s failed", formatCount(stats.counts.of(PoseEnd::Shown)).c_str(),
        formatCount(stats.counts.of(PoseEnd::Late)).c_str(), formatCount(stats.counts.of(PoseEnd::Expired)).c_str(),
        formatCount(stats.counts.of(PoseEnd::Failed)).c_str());
    std::string workers;
    for (const WorkerStats& worker : stats.workers)
        workers += formatString("%s%s %s, %s", workers.empty() ? "" : "; ", deviceText(worker.device).c_str(),
                                workerStateName(worker.state), formatCount(worker.parts, "part").c_str());
    item("workers").text = workers;
}

} // namespace gsc
