// SPDX-License-Identifier: Apache-2.0
#include "player/options/camera_choice.h"

#include <charconv>
#include <cmath>
#include <cstdio>

namespace gsc {

namespace {

// Parses a decimal number; returns false if the text holds anything else.
bool parseIndex(const std::string& text, uint64_t& value)
{
    const char* const end = text.data() + text.size();
    const auto [stop, error] = std::from_chars(text.data(), end, value);
    return error == std::errc() && stop == end;
}

} // namespace

bool parseCameras(const std::string& text, CameraChoice& choice)
{
    constexpr std::string_view kNamed = "stored:";
    choice.file = text;
    choice.names.clear();
    if (!text.starts_with(kNamed))
        return true;
    choice.file = "stored";
    for (size_t begin = kNamed.size(), end = 0; end != std::string::npos; begin = end + 1) {
        end = text.find(',', begin);
        choice.names.push_back(text.substr(begin, end == std::string::npos ? end : end - begin));
        if (choice.names.back().empty())
            return false;
    }
    return true;
}

std::optional<std::array<double, 3>> parsePlace(const std::string& text)
{
    constexpr double kMost = 1e15;
    std::array<double, 3> place{};
    int used = 0;
    if (std::sscanf(text.c_str(), "%lf,%lf,%lf%n", &place[0], &place[1], &place[2], &used) != 3 ||
        size_t(used) != text.size())
        return std::nullopt;
    for (const double value : place)
        if (!(std::abs(value) <= kMost))
            return std::nullopt;
    return place;
}

bool parseFrameRange(const std::string& text, uint64_t& first, uint64_t& end)
{
    const size_t colon = text.find(':');
    if (colon == std::string::npos)
        return false;
    const std::string head = text.substr(0, colon), tail = text.substr(colon + 1);
    uint64_t a = 0, b = std::numeric_limits<uint64_t>::max();
    if ((!head.empty() && !parseIndex(head, a)) || (!tail.empty() && !parseIndex(tail, b)) || a >= b)
        return false;
    first = a;
    end = b;
    return true;
}

} // namespace gsc
