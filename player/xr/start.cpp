// SPDX-License-Identifier: Apache-2.0
#include "player/xr/start.h"

#include <gsc/error.h>
#include "player/poses/extent.h"

#include <glm/geometric.hpp>

#include <algorithm>
#include <cmath>
#include <numbers>

namespace gsc {

namespace {

constexpr uint32_t kStartSide = 48; // width and height of the pictures that are measured, pixels
// A surface nearer than this, in the viewer's metres, does not count as shown: nobody starts with the nose at a wall. A
// table-top is near on purpose.
constexpr double kNearest = 1, kTableNearest = 0.2;
// The middle of a table-top from the eyes, metres: as a low table before which one stands.
constexpr double kTableAhead = 0.6, kTableBelow = 0.35;

constexpr double inRadians(double angle)
{
    return angle * std::numbers::pi / 180;
}

// Two eyes of a usual headset: they see further outwards than inwards, and further down than up.
const SpaceEye kUsualEyes[kMaxEyes] = {
    {{{-0.032, 0, 0}}, inRadians(-54), inRadians(40), inRadians(44), inRadians(-55)},
    {{{0.032, 0, 0}}, inRadians(-40), inRadians(54), inRadians(44), inRadians(-55)},
};

// Point of the model in the middle of the first camera's picture, in the world. None if most of what is around the
// middle shows nothing.
std::optional<glm::dvec3> pointAhead(const Shot& first, const DrawDepths& draw)
{
    Shot shot = first;
    shot.camera.width = shot.camera.height = kStartSide;
    shot.ipd = 0;
    shot.right_eye.reset();
    const std::vector<float> depths = draw(shot, 1)[0];
    std::vector<float> middle;
    for (uint32_t y = 3 * kStartSide / 8; y < 5 * kStartSide / 8 && !depths.empty(); ++y)
        middle.insert(middle.end(), &depths[y * kStartSide + 3 * kStartSide / 8],
                      &depths[y * kStartSide + 5 * kStartSide / 8]);
    const auto median = middle.begin() + ptrdiff_t(middle.size() / 2);
    std::nth_element(middle.begin(), median, middle.end());
    if (median == middle.end() || !std::isfinite(*median))
        return std::nullopt;
    const Camera& camera = first.camera;
    const double view[3] = {camera.tan_mid_x * double(*median) - camera.translation[0],
                            camera.tan_mid_y * double(*median) - camera.translation[1],
                            double(*median) - camera.translation[2]};
    glm::dvec3 point{};
    for (int row = 0; row < 3; ++row)
        for (int column = 0; column < 3; ++column)
            point[row] += camera.rotation[3 * row + column] * view[column];
    return point;
}

// `level`: the level space at the first camera, whose direction the table-top keeps.
Placement tableStart(const ModelView& model, const Placement& level)
{
    glm::dvec3 middle{}, size{};
    for (int i = 0; i < 3; ++i) {
        const auto [low, high] = extentAlong(model, level.axes()[i]);
        middle += level.axes()[i] * ((low + high) / 2);
        size[i] = high - low;
    }
    const double width = std::max(size.x, size.z); // seen from above
    if (!std::isfinite(width) || width <= 0)
        return level;
    return {middle + width * (level.axes() * glm::dvec3(0, kTableBelow, kTableAhead)), level.axes(), width};
}

// Share of the pixels that show the model no nearer than `nearest` metres, in the eye that has fewer of them.
std::optional<double> shownFrom(const Placement& eyes, const Shot& first, double nearest, const DrawDepths& draw)
{
    Shot shot = first;
    shot.ipd = 0;
    shot.camera.width = shot.camera.height = kStartSide;
    shot.right_eye = eyes.eye(kUsualEyes[1], shot.camera);
    shot.camera = eyes.eye(kUsualEyes[0], shot.camera);
    double least = 1;
    for (const std::vector<float>& depths : draw(shot, kMaxEyes)) {
        if (depths.empty())
            return std::nullopt;
        const auto shows = [&](float z) { return std::isfinite(z) && double(z) >= nearest * eyes.scale(); };
        least = std::min(least, double(std::ranges::count_if(depths, shows)) / double(depths.size()));
    }
    return least;
}

} // namespace

Start chooseStart(StartPlace wanted, const ModelView& model, const Shot& first, const std::array<double, 3>& up,
                  double metre, const DrawDepths& draw)
{
    const Placement level(first.camera, up, metre, 0);
    Start start{StartPlace::Camera, level};
    if (wanted == StartPlace::Camera)
        return start;
    if (wanted == StartPlace::Table)
        return {StartPlace::Table, tableStart(model, level)};
    std::optional<Placement> ground;
    const std::optional<glm::dvec3> point = pointAhead(first, draw);
    if (point && Placement::isPlace(*point, level.axes()))
        ground.emplace(*point + level.axes()[1] * (kEyeHeight * level.scale()), level.axes(), level.scale());
    if (wanted == StartPlace::Ground)
        return ground ? Start{StartPlace::Ground, *ground} : start;
    double most = -1;
    // the first of two that show as much is taken: pictures are best where the photographs were taken
    const auto consider = [&](StartPlace place, const Placement& eyes, double nearest) {
        const std::optional<double> shown = start.shown[size_t(place)] = shownFrom(eyes, first, nearest, draw);
        if (!shown || *shown <= most)
            return;
        most = *shown;
        start.place = place;
        start.eyes = eyes;
    };
    consider(StartPlace::Camera, level, kNearest);
    if (ground)
        consider(StartPlace::Ground, *ground, kNearest);
    consider(StartPlace::Table, tableStart(model, level), kTableNearest);
    return start;
}

const char* startWords(StartPlace place)
{
    switch (place) {
    case StartPlace::Ground:
        return "on the ground";
    case StartPlace::Table:
        return "before a table-top";
    default:
        return "at the first camera";
    }
}

std::string startText(const Start& start)
{
    std::string text = formatString("starts %s", startWords(start.place));
    std::string measured;
    for (const StartPlace place : {StartPlace::Camera, StartPlace::Ground, StartPlace::Table})
        if (const std::optional<double> shown = start.shown[size_t(place)])
            measured += formatString("%s%.0f %% %s", measured.empty() ? "" : ", ", 100 * *shown, startWords(place));
    return measured.empty() ? text : text + "; of an eye's picture the model fills " + measured;
}

} // namespace gsc
