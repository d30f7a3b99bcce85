// SPDX-License-Identifier: Apache-2.0
#include "settings.h"

#include "script.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <fstream>
#include <nlohmann/json.hpp>
#include <numbers>
#include <set>
#include <stdexcept>

namespace gsc::fake_xr {

namespace {

using nlohmann::json;

[[noreturn]] void bad(const std::string& what)
{
    throw std::runtime_error(what);
}

// A misspelt key would silently test the default.
void allowOnly(const json& object, const char* where, const std::set<std::string>& keys)
{
    if (!object.is_object())
        bad(std::string(where) + " is no object, expected one");
    for (const auto& [key, value] : object.items())
        if (!keys.contains(key))
            bad(std::string(where) + " has an unknown key \"" + key + "\"");
}

float radians(double degrees)
{
    return float(degrees * std::numbers::pi / 180);
}

XrFovf fovFrom(const json& degrees)
{
    if (degrees.size() != 4)
        bad("fov has " + std::to_string(degrees.size()) + " values, expected left, right, up, down");
    return {radians(degrees[0]), radians(degrees[1]), radians(degrees[2]), radians(degrees[3])};
}

void readPose(const json& object, XrPosef& pose)
{
    if (const auto p = object.find("position"); p != object.end())
        pose.position = {p->at(0), p->at(1), p->at(2)};
    if (const auto q = object.find("rotation"); q != object.end())
        pose.orientation = normalized({q->at(0), q->at(1), q->at(2), q->at(3)});
}

std::vector<PoseKey> posesFrom(const json& list, const char* where)
{
    std::vector<PoseKey> keys;
    for (const json& item : list) {
        allowOnly(item, where, {"t", "position", "rotation"});
        PoseKey& key = keys.emplace_back(PoseKey{item.value("t", 0.0), kIdentity});
        readPose(item, key.pose);
    }
    std::ranges::stable_sort(keys, {}, &PoseKey::t);
    // q and -q are one rotation: each on the side of the one before, so that the way between them is the short one
    for (size_t i = 1; i < keys.size(); ++i) {
        const XrQuaternionf& before = keys[i - 1].pose.orientation;
        XrQuaternionf& q = keys[i].pose.orientation;
        if (before.x * q.x + before.y * q.y + before.z * q.z + before.w * q.w < 0)
            q = {-q.x, -q.y, -q.z, -q.w};
    }
    return keys;
}

ViewSettings defaultView(double left, double right, double up, double down, float x)
{
    const XrFovf fov{radians(left), radians(right), radians(up), radians(down)};
    return {fov, {{0, 0, 0, 1}, {x, 0, 0}}, 1440, 1584};
}

// Eyes that look straight ahead through shifted windows, as those of real headsets; quad views add a sharp inset each.
std::vector<ViewSettings> defaultViews(Configuration configuration)
{
    if (configuration == Configuration::Mono)
        return {defaultView(-50, 50, 45, -45, 0)};
    std::vector<ViewSettings> views{defaultView(-54, 40, 44, -55, -0.032f), defaultView(-40, 54, 44, -55, 0.032f)};
    if (configuration == Configuration::Quad) {
        views.push_back(defaultView(-14, 18, 15, -17, -0.032f));
        views.push_back(defaultView(-18, 14, 15, -17, 0.032f));
    }
    return views;
}

void readViews(const json& list, std::vector<ViewSettings>& views)
{
    if (list.size() != views.size())
        bad("views has " + std::to_string(list.size()) + " entries, expected " + std::to_string(views.size()));
    for (size_t i = 0; i < views.size(); ++i) {
        const json& item = list[i];
        allowOnly(item, "views", {"fov", "position", "rotation", "width", "height"});
        if (item.contains("fov"))
            views[i].fov = fovFrom(item["fov"]);
        readPose(item, views[i].eye);
        views[i].width = item.value("width", views[i].width);
        views[i].height = item.value("height", views[i].height);
    }
}

Configuration configurationFrom(const std::string& name)
{
    if (name == "stereo")
        return Configuration::Stereo;
    if (name == "mono")
        return Configuration::Mono;
    if (name == "quad")
        return Configuration::Quad;
    bad("configuration is \"" + name + "\", expected stereo, mono or quad");
}

Masks masksFrom(const json& meshes)
{
    Masks masks;
    for (const auto& [view, mesh] : meshes.items()) {
        MaskSettings& mask = masks[uint32_t(std::stoul(view))];
        for (const json& vertex : mesh.at("vertices")) {
            const auto number = [](const json& value) { return value.is_null() ? NAN : value.get<float>(); };
            mask.vertices.push_back({number(vertex.at(0)), number(vertex.at(1))});
        }
        mask.indices = mesh.at("indices").get<std::vector<uint32_t>>();
    }
    return masks;
}

std::vector<ScriptedEvent> eventsFrom(const json& list)
{
    static const std::set<std::string> kKnown{"hide", "show",         "unfocus",      "focus",
                                              "exit", "loss_pending", "session_lost", "instance_lost",
                                              "stop", "restart",      "mask"};
    std::vector<ScriptedEvent> events;
    for (const json& item : list) {
        allowOnly(item, "events", {"frame", "do", "polls", "masks"});
        const ScriptedEvent event{item.at("frame"), item.at("do"), item.value("polls", 20u),
                                  masksFrom(item.value("masks", json::object()))};
        if (!kKnown.contains(event.what))
            bad("events has \"" + event.what + "\", expected one of README.md");
        events.push_back(event);
    }
    std::ranges::stable_sort(events, {}, &ScriptedEvent::frame);
    return events;
}

XrVersion versionFrom(const std::string& text)
{
    unsigned major = 0, minor = 0;
    if (std::sscanf(text.c_str(), "%u.%u", &major, &minor) != 2)
        bad("vulkan_min is \"" + text + "\", expected one such as 1.1");
    return XR_MAKE_VERSION(major, minor, 0);
}

void readTracking(const json& file, Settings& s)
{
    s.head = posesFrom(file.value("head", json::array()), "head");
    s.floor = file.value("floor", s.floor);
    s.stage = file.value("stage", s.stage);
    for (const json& span : file.value("tracking_lost", json::array()))
        s.tracking_lost.emplace_back(span.at(0), span.at(1));
    s.gaze = posesFrom(file.value("gaze", json::array()), "gaze");
    const json hands = file.value("hands", json::object());
    allowOnly(hands, "hands", {"left", "right"});
    for (const auto& [hand, keys] : hands.items())
        s.hands["/user/hand/" + hand] = posesFrom(keys, "hands");
    s.profile = file.value("profile", s.profile);
    for (const json& item : file.value("inputs", json::array())) {
        allowOnly(item, "inputs", {"t", "path", "value"});
        const json& value = item.at("value");
        const float number = value.is_boolean() ? float(value.get<bool>()) : value.get<float>();
        s.inputs.push_back({item.value("t", 0.0), item.at("path"), number});
    }
    std::ranges::stable_sort(s.inputs, {}, &InputKey::t);
}

Settings settingsFrom(const json& file)
{
    allowOnly(file, "the settings",
              {"clock",  "hz",     "period_changes", "blocked_ms", "configuration", "views",   "head",
               "floor",  "stage",  "tracking_lost",  "gaze",       "hands",         "profile", "inputs",
               "events", "system", "formats",        "vulkan_min", "gpu",           "log",     "extensions_withheld",
               "dump",   "hash",   "visibility_mask"});
    Settings s;
    const std::string clock = file.value("clock", "virtual");
    if (clock != "virtual" && clock != "real")
        bad("clock is \"" + clock + "\", expected virtual or real");
    s.real_clock = clock == "real";
    s.hz = file.value("hz", s.hz);
    for (const json& change : file.value("period_changes", json::array()))
        s.rate_changes.push_back({change.at("frame"), change.at("hz")});
    std::ranges::stable_sort(s.rate_changes, {}, &RateChange::frame);
    const auto usable = [](double hz) { return hz >= 1 && hz <= 1000; };
    if (!usable(s.hz) || !std::ranges::all_of(s.rate_changes, usable, &RateChange::hz))
        bad("a refresh rate is out of range, expected 1 to 1000 Hz");
    s.blocked_ms = file.value("blocked_ms", s.blocked_ms);
    s.configuration = configurationFrom(file.value("configuration", "stereo"));
    s.views = defaultViews(s.configuration);
    if (file.contains("views"))
        readViews(file["views"], s.views);
    readTracking(file, s);
    s.events = eventsFrom(file.value("events", json::array()));
    if (file.contains("formats"))
        s.formats = file["formats"].get<std::vector<int64_t>>();
    s.extensions_withheld = file.value("extensions_withheld", s.extensions_withheld);
    s.system = file.value("system", s.system);
    s.vulkan_min = versionFrom(file.value("vulkan_min", "1.0"));
    s.gpu = file.value("gpu", s.gpu);
    if (file.contains("visibility_mask"))
        s.visibility_mask = masksFrom(file["visibility_mask"]);
    s.log = file.value("log", s.log);
    s.dump = file.value("dump", s.dump);
    s.hash = file.value("hash", s.hash);
    return s;
}

} // namespace

Settings readSettings()
{
    const char* path = std::getenv("GSC_FAKE_XR");
    if (path == nullptr || *path == '\0')
        return settingsFrom(json::object());
    std::ifstream stream(path);
    try {
        if (!stream)
            bad("it cannot be read, expected a JSON file");
        return settingsFrom(json::parse(stream));
    } catch (const std::exception& e) {
        throw std::runtime_error(std::string(path) + ": " + e.what());
    }
}

} // namespace gsc::fake_xr
