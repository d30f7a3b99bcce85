// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/trainer_cameras.h"

#include "format/numbers/count_text.h"
#include "runtime/cameras/camera_fields.h"
#include <gsc/error.h>
#include <gsc/file/read_file.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <iterator>
#include <map>

namespace gsc {

namespace {

constexpr auto kUpstreamKeys =
    joinKeys(kProjectionKeys, kCoefficients,
             {"id", "img_name", "width", "height", "position", "rotation", "fx", "fy", "cx", "cy"});
constexpr uint64_t kMaxSettings = 1u << 20; // largest size of a settings file, bytes
constexpr double kTrainerMaxWidth = 1600;   // width in pixels above which the trainers' option -r -1 scales down
constexpr double kMaxSettingSide = 32768;   // limit for a photograph's size after scaling, pixels
// most digits of N in a folder's name images_N; longer ones are years or numbers of data sets
constexpr size_t kMostDigits = 2;
constexpr std::string_view kDivisorKey = "resolution";
constexpr std::string_view kImages = "images_";

// Finds `word` in `text` from `at` on where no letter, digit or underscore stands beside it; npos if there is none.
size_t findWord(std::string_view text, std::string_view word, size_t at)
{
    const auto joins = [&](size_t i) {
        return i < text.size() && (std::isalnum(static_cast<unsigned char>(text[i])) || text[i] == '_');
    };
    for (at = text.find(word, at); at != std::string_view::npos; at = text.find(word, at + 1))
        if ((at == 0 || !joins(at - 1)) && !joins(at + word.size()))
            return at;
    return at;
}

// Returns true if the key that ends at `at` has the value -1, the default.
bool isMinusOne(std::string_view text, size_t at)
{
    at = text.find_first_not_of(" \t\"'", at);
    if (at == std::string_view::npos || (text[at] != '=' && text[at] != ':'))
        return false;
    at = text.find_first_not_of(" \t", at + 1);
    if (at == std::string_view::npos || text.substr(at, 2) != "-1")
        return false;
    at = text.find_first_not_of(" \t\r", at + 2);
    return at == std::string_view::npos || text[at] == ',' || text[at] == ')' || text[at] == '}' || text[at] == '\n';
}

bool mayStateSize(std::string_view text)
{
    for (size_t at = 0; (at = findWord(text, kDivisorKey, at)) != std::string_view::npos;)
        if (at += kDivisorKey.size(); !isMinusOne(text, at))
            return true;
    return false;
}

// Reads a settings file. If it cannot be read, the returned text counts as one that may state anything: the file is
// needed for a warning only.
std::string settingsText(const std::string& path)
{
    try {
        return readInputText(path, kMaxSettings, "the trainer's settings");
    } catch (const Error&) {
        return std::string(kDivisorKey);
    }
}

uint32_t sideOf(double pixels)
{
    return uint32_t(std::clamp(pixels, 1.0, kMaxSettingSide));
}

std::vector<SourceCamera> upstreamCameras(const ParsedJson& root, const std::string& file, const CameraReading& how)
{
    if (!root.is_array())
        throw Error(ErrorCode::InvalidFile, file, "the root is no array", "the list of cameras that training writes",
                    "pass such a file");
    // cameras of equal name are all kept, with a warning: choosing by name gives one of them
    std::map<std::string, size_t> seen;
    std::string repeated;
    size_t repeats = 0;
    const auto read = [&](JsonObject& entry, CameraFindings& found, size_t) {
        SourceCamera camera;
        camera.name = entry.text("img_name");
        entry.setWhere(entry.where() + formatString(" (%.60s)", camera.name.c_str()));
        camera.id = int(entry.integer("id", 0, INT32_MAX));
        camera.width = entry.imageSide("width");
        camera.height = entry.imageSide("height");
        entry.vector3("position", camera.position);
        readRotation(entry, camera.rotation);
        camera.fx = readFocal(entry, "fx");
        camera.fy = readFocal(entry, "fy");
        found.distortion.add({entry});
        const MiddleOffset middle = readMiddleOffset({entry}, camera.width, camera.height);
        camera.middle_x = middle.x;
        camera.middle_y = middle.y;
        noteUnusual(cameraOf(camera), entry.where(), found.notes);
        if (++seen[camera.name] == 2 && repeats++ == 0)
            repeated = camera.name;
        return camera;
    };
    std::vector<SourceCamera> cameras = readEach({root, file, "entry", kUpstreamKeys}, how, read);
    if (repeats > 0)
        how.warn(formatString("%s: has %s of more than one camera (the first is %.60s); each of these is a camera "
                              "of its own here",
                              file.c_str(), formatCount(repeats, "name").c_str(), repeated.c_str()));
    return cameras;
}

} // namespace

Camera cameraOf(const SourceCamera& source)
{
    Camera camera;
    camera.name = source.name;
    std::memcpy(camera.rotation, source.rotation, sizeof(camera.rotation));
    translationFromPosition(source.rotation, source.position, camera.translation);
    camera.fov_x = angleOf(source.width, source.fx);
    camera.fov_y = angleOf(source.height, source.fy);
    setMiddle(camera, source.middle_x / source.width, source.middle_y / source.height);
    camera.appearance = source.appearance;
    const TrainedSize size = trainerSize(source.width, source.height, kDefaultResolution);
    camera.width = size.width;
    camera.height = size.height;
    return camera;
}

std::vector<SourceCamera> parseUpstreamCameras(std::string_view json, const std::string& name, const CameraReading& how)
{
    return upstreamCameras(parseJson(json, name), name, how);
}

std::vector<Camera> trainerCameras(const nlohmann::json& root, const std::string& name, const CameraReading& how)
{
    std::vector<Camera> cameras;
    std::ranges::transform(upstreamCameras(root, name, how), std::back_inserter(cameras), cameraOf);
    return cameras;
}

TrainedSize trainerSize(uint32_t width, uint32_t height, double r)
{
    if (r == 1 || r == 2 || r == 4 || r == 8) // nearbyint rounds half to even, as Python does
        return {sideOf(std::nearbyint(width / r)), sideOf(std::nearbyint(height / r))};
    // both truncations are done in double as by the trainers, so the width may be 1599
    const double down = r == kDefaultResolution ? std::max(1.0, width / kTrainerMaxWidth) : width / r;
    return {sideOf(width / down), sideOf(height / down)};
}

double checkedResolution(double stated, const std::string& file, const CameraReading& how)
{
    if (stated == kDefaultResolution || (stated >= 1 && stated <= kMaxSettingSide))
        return stated;
    how.warn(
        formatString("%s: resolution is %g, which no trainer takes; pictures are at most %g pixels wide, as with -1",
                     file.c_str(), stated, kTrainerMaxWidth));
    return kDefaultResolution;
}

void warnOfSettingsBeside(const std::string& cameras, const CameraReading& how)
{
    for (const char* name : {"cfg_args", "config.yaml"}) {
        const std::filesystem::path path = std::filesystem::path(cameras).parent_path() / name;
        std::error_code none;
        if (!std::filesystem::is_regular_file(path, none))
            continue;
        const std::string text = settingsText(path.string());
        if (mayStateSize(text))
            how.warn(formatString(
                "%s: its resolution is not applied to the cameras of %s, whose pictures are at most %g pixels wide; "
                "take those that gsc convert stored in the model, which have the trainer's size (--cameras stored)",
                path.c_str(), cameras.c_str(), kTrainerMaxWidth));
        if (const size_t at = text.find(kImages); at != std::string::npos)
            warnOfSmallImages(text.substr(at, text.find_first_not_of("0123456789", at + kImages.size()) - at),
                              path.string(), how);
    }
}

void warnOfSmallImages(const std::string& images, const std::string& file, const CameraReading& how)
{
    const size_t last = images.find_last_not_of('/');
    const std::string name = images.substr(0, last == std::string::npos ? 0 : last + 1);
    const size_t bar = name.find_last_of('_');
    if (bar == std::string::npos || bar + 1 == name.size() ||
        !std::all_of(name.begin() + std::ptrdiff_t(bar) + 1, name.end(),
                     [](unsigned char c) { return std::isdigit(c); }))
        return;
    const std::string times = name.substr(bar + 1);
    if (times.size() <= kMostDigits && std::atoi(times.c_str()) > 1)
        how.warn(formatString("%s: images is '%.60s', which may be photographs 1/%s as large as those of the cameras; "
                              "the cameras' own size is taken",
                              file.c_str(), name.c_str(), times.c_str()));
}

} // namespace gsc
