// SPDX-License-Identifier: Apache-2.0
#include "player/cameras/camera_lens.h"

#include <algorithm>
#include <cmath>
#include <iterator>

namespace gsc {

namespace {

constexpr double kMaxCentre = 1e6; // pixels; a crop may leave the axis outside the image, but not so far
constexpr const char* kCoefficients[] = {"k1", "k2", "k3", "k4", "k5", "k6", "p1", "p2"};
// pinholes where every coefficient is 0
constexpr const char* kPinholes[] = {"PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "SIMPLE_RADIAL",
                                     "RADIAL",  "OPENCV",         "FULL_OPENCV"};

bool isPinhole(const std::string& model)
{
    return std::any_of(std::begin(kPinholes), std::end(kPinholes), [&](const char* name) { return model == name; });
}

double middleOffset(const LensKeys& lens, const char* key, const char* size_key, uint32_t size)
{
    const JsonObject* holder = lens.holder(key);
    if (!holder)
        return 0;
    const double centre = holder->number(key);
    if (size == 0)
        holder->fail(key, formatString("%g and the image has no size", centre),
                     formatString("\"%s\" beside it, because it is in pixels; add the size of the image", size_key));
    if (!(std::abs(centre) <= kMaxCentre))
        holder->fail(key, formatString("%g", centre), "a number of pixels between -1e6 and 1e6");
    return 0.5 * size - centre;
}

} // namespace

const JsonObject* LensKeys::holder(const char* key) const
{
    return frame.has(key) ? &frame : file && file->has(key) ? file : nullptr;
}

DistortionCheck::DistortionCheck(std::string file, std::vector<std::string>* ignored)
    : m_file(std::move(file)), m_ignored(ignored)
{
}

void DistortionCheck::found(const JsonObject& holder, const char* key)
{
    const std::string value = shownJson(holder.at(key));
    if (!m_ignored)
        throw Error(
            ErrorCode::Unsupported,
            formatString("%s: key \"%s\" is %s, expected a pinhole without distortion; undistort the images and "
                         "export the cameras again, or pass --ignore-distortion",
                         holder.where().c_str(), key, value.c_str()));
    if (m_distorted == 0)
        m_first += formatString("%s\"%s\" is %s", m_first.empty() ? "" : ", ", key, value.c_str());
}

void DistortionCheck::add(const LensKeys& lens)
{
    bool distorted = false;
    const auto check = [&](const char* key, const auto& shows) {
        const JsonObject* holder = lens.holder(key);
        if (!holder || shows(*holder))
            return;
        distorted = true;
        found(*holder, key);
    };
    check("camera_model", [](const JsonObject& o) { return isPinhole(o.text("camera_model")); });
    check("is_fisheye", [](const JsonObject& o) { return o.at("is_fisheye") == false; });
    for (const char* key : kCoefficients)
        check(key, [key](const JsonObject& o) { return o.number(key) == 0; });
    ++m_cameras;
    m_distorted += distorted;
}

void DistortionCheck::finish()
{
    if (m_distorted > 0)
        m_ignored->push_back(formatString("%s: lens distortion of %zu of %zu cameras is ignored (the first says %s)",
                                          m_file.c_str(), m_distorted, m_cameras, m_first.c_str()));
}

MiddleOffset readMiddleOffset(const LensKeys& lens, uint32_t width, uint32_t height)
{
    return {middleOffset(lens, "cx", "w", width), middleOffset(lens, "cy", "h", height)};
}

void refuseMiddleOffset(const LensKeys& lens)
{
    for (const char* key : {"cx", "cy"})
        if (const JsonObject* holder = lens.holder(key))
            holder->fail(key, shownJson(holder->at(key)),
                         "none in a trajectory, whose frames look through the middle of the image; state lenses that "
                         "do not with \"views\"");
}

} // namespace gsc
