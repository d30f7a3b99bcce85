// SPDX-License-Identifier: Apache-2.0
#include "player/cameras/trainer_size.h"

#include "format/error.h"
#include "format/file/read_file.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace gsc {

namespace {

constexpr uint64_t kMaxSettings = 1u << 20; // bytes
constexpr double kTrainerMaxWidth = 1600;   // of -r -1
constexpr double kMaxSettingSide = 32768;   // pixels
constexpr const char* kDivisorKey = "resolution";
constexpr const char* kScalesKey = "resolution_scales";

// Position behind `key`= outside of strings, npos where it is not.
size_t valueOf(std::string_view text, std::string_view key)
{
    char quote = 0;
    for (size_t i = 0; i < text.size(); ++i) {
        const char c = text[i];
        if (quote != 0) {
            if (c == '\\')
                ++i;
            else if (c == quote)
                quote = 0;
            continue;
        }
        if (c == '\'' || c == '"')
            quote = c;
        const bool starts = i == 0 || text[i - 1] == '(' || text[i - 1] == ',' || text[i - 1] == ' ';
        if (starts && text.substr(i, key.size()) == key && text.substr(i + key.size(), 1) == "=")
            return i + key.size() + 1;
    }
    return std::string_view::npos;
}

uint32_t sideOf(double pixels)
{
    return uint32_t(std::clamp(pixels, 1.0, kMaxSettingSide));
}

// `text` from `at` on, as a number; NaN where it is none. Moves `at` behind it.
double numberAt(const std::string& text, size_t& at)
{
    char* end = nullptr;
    const double value = std::strtod(text.c_str() + at, &end);
    if (end == text.c_str() + at)
        return std::nan("");
    at = size_t(end - text.c_str());
    return value;
}

// The first of a list of numbers, 1 where no list is there.
double firstScale(const std::string& text, const std::string& file, const CameraReading& how)
{
    size_t at = valueOf(text, kScalesKey);
    if (at == std::string::npos || text[at] != '[')
        return 1;
    const double first = numberAt(text, ++at);
    if (std::isnan(first))
        return 1;
    if (text.substr(at, 1) == ",")
        how.warn(formatString("%s: \"%s\" names several sizes of each photograph; the first, 1/%g, is taken",
                              file.c_str(), kScalesKey, first));
    return first;
}

// Of Octree-AnyGS's config.yaml, whose lines are "  key: value".
std::optional<TrainerResolution> resolutionOfYaml(const std::string& text, const std::string& file,
                                                  const CameraReading& how)
{
    TrainerResolution found;
    bool stated = false;
    for (size_t at = 0; at < text.size(); at = std::min(text.find('\n', at), text.size() - 1) + 1) {
        size_t key = text.find_first_not_of(" ", at);
        if (key == std::string::npos || text.compare(key, 12, "resolution: ") != 0)
            continue;
        const double value = numberAt(text, key += 12);
        stated = stated || !std::isnan(value);
        found.divisor = std::isnan(value) ? found.divisor : value;
    }
    return stated ? std::optional(checkedResolution(found, file, how)) : std::nullopt;
}

} // namespace

ImageSize trainerSize(uint32_t width, uint32_t height, const TrainerResolution& resolution)
{
    const double r = resolution.divisor;
    if (r == 1 || r == 2 || r == 4 || r == 8) {
        const double divisor = resolution.scale * r; // nearbyint: half to even, as Python rounds
        return {sideOf(std::nearbyint(width / divisor)), sideOf(std::nearbyint(height / divisor))};
    }
    const double down = r == -1 ? std::max(1.0, width / kTrainerMaxWidth) : width / r;
    // both truncations as the trainers', in double: the width may come out as 1599
    const double scale = down * resolution.scale;
    return {sideOf(width / scale), sideOf(height / scale)};
}

TrainerResolution checkedResolution(const TrainerResolution& stated, const std::string& file, const CameraReading& how)
{
    const double r = stated.divisor;
    if ((r == -1 || (r >= 1 && r <= kMaxSettingSide)) && stated.scale >= 1e-3 && stated.scale <= kMaxSettingSide)
        return stated;
    how.warn(formatString("%s: %s %g with a scale of %g is none that the trainers take; pictures are at most %g pixels "
                          "wide, as with -1",
                          file.c_str(), kDivisorKey, r, stated.scale, kTrainerMaxWidth));
    return {};
}

std::optional<TrainerResolution> trainerResolutionOf(std::string_view cfg_args, const std::string& file,
                                                     const CameraReading& how)
{
    const std::string text(cfg_args);
    if (size_t at = valueOf(text, "images"); at != std::string::npos && at < text.size()) {
        const size_t end = text.find(text[at], at + 1);
        if ((text[at] == '\'' || text[at] == '"') && end != std::string::npos)
            warnOfSmallImages(text.substr(at + 1, end - at - 1), file, how);
    }
    size_t at = valueOf(text, kDivisorKey);
    if (at == std::string::npos)
        return std::nullopt;
    TrainerResolution found;
    found.divisor = numberAt(text, at);
    if (std::isnan(found.divisor)) // None, or something no trainer wrote
        return std::nullopt;
    found.scale = firstScale(text, file, how);
    return checkedResolution(found, file, how);
}

std::optional<TrainerResolution> readTrainerResolution(const std::string& folder, const CameraReading& how)
{
    for (const char* name : {"cfg_args", "config.yaml"}) {
        const std::string path = (std::filesystem::path(folder) / name).string();
        std::error_code none;
        if (!std::filesystem::is_regular_file(path, none))
            continue;
        const std::string text = readInputText(path, kMaxSettings, "the trainer's settings");
        return path.ends_with(".yaml") ? resolutionOfYaml(text, path, how) : trainerResolutionOf(text, path, how);
    }
    return std::nullopt;
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
    const std::string times = name.substr(bar + 1, 6);
    if (std::atoi(times.c_str()) > 1)
        how.warn(formatString("%s: images is '%.60s', which may be photographs 1/%s as large as those of the cameras; "
                              "the cameras' own size is taken, pass --size for another",
                              file.c_str(), name.c_str(), times.c_str()));
}

} // namespace gsc
