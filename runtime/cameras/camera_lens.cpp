// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_lens.h"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <span>

namespace gsc {

namespace {

constexpr double kMaxCentre = 1e6; // pixels; a crop may leave the axis outside the image, but not so far
// of the lenses of OpenCV, COLMAP and nerfstudio
constexpr const char* kCoefficients[] = {
    "k0", "k1", "k2", "k3", "k4",  "k5",  "k6",    "p0",        "p1",        "p2",        "p3",        "p4",       "s0",
    "s1", "s2", "s3", "s4", "sx1", "sy1", "omega", "ftheta_p0", "ftheta_p1", "ftheta_p2", "ftheta_p3", "ftheta_p4"};
constexpr const char* kFisheye = "is_fisheye";
// These pictures are no pinhole's, whatever else is ignored.
constexpr const char* kOtherProjections[] = {"latlong", "equirectangular", "orthographic"};
constexpr const char* kOtherModels[] = {
    "EQUIRECTANGULAR",         "LATLONG", "ORTHOGRAPHIC", "ORTHOPHOTO", "OMNIDIRECTIONALSTEREO_L",
    "OMNIDIRECTIONALSTEREO_R", "VR180_L", "VR180_R"};
// pinholes where every coefficient is 0
constexpr const char* kPinholes[] = {"PINHOLE", "SIMPLE_PINHOLE", "PERSPECTIVE", "SIMPLE_RADIAL",
                                     "RADIAL",  "OPENCV",         "FULL_OPENCV"};

bool isOneOf(std::span<const char* const> names, std::string model)
{
    std::ranges::transform(model, model.begin(), [](unsigned char c) { return char(std::toupper(c)); });
    return std::ranges::any_of(names, [&](const char* name) { return model == name; });
}

bool isFalse(const ParsedJson& value)
{
    return value == false || value == 0;
}

bool isZeroArray(const JsonObject& object, const char* key)
{
    const ParsedJson& values = object.at(key);
    if (!values.is_array() || !std::ranges::all_of(values, [](const ParsedJson& v) { return v.is_number(); }))
        object.fail(key, shownJson(values), "an array of coefficients");
    return std::ranges::all_of(values, [](const ParsedJson& v) { return v == 0; });
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

const JsonObject* LensKeys::holder(const char* key, bool null_counts) const
{
    const auto find = [&](const JsonObject& object) { return null_counts ? object.find(key) : object.stated(key); };
    const ParsedJson* const own = find(frame);
    const ParsedJson* const common = file ? find(*file) : nullptr;
    if (own && common && notes && *own != *common)
        notes->add(key, frame.where(),
                   formatString("key \"%s\" is %s and that of the whole file is %s; the frame's is taken", key,
                                shownJson(*own).c_str(), shownJson(*common).c_str()));
    return own ? &frame : common ? file : nullptr;
}

DistortionCheck::DistortionCheck(std::string file, const CameraReading& how) : m_file(std::move(file)), m_how(how) {}

void DistortionCheck::found(const JsonObject& holder, const char* key, bool has_pinhole)
{
    const std::string value = shownJson(holder.at(key));
    if (!has_pinhole)
        throw Error(ErrorCode::Unsupported,
                    formatString("%s: key \"%s\" is %s, expected a pinhole; such a picture is none even without its "
                                 "distortion, so cut it into pinhole pictures and export their cameras",
                                 holder.where().c_str(), key, value.c_str()));
    if (!m_how.ignore_distortion)
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
    const auto check = [&](const char* key, const auto& shows, const auto& has_pinhole) {
        const JsonObject* holder = lens.holder(key, false);
        if (!holder || shows(*holder))
            return;
        distorted = true;
        found(*holder, key, has_pinhole(*holder));
    };
    const auto yes = [](const JsonObject&) { return true; };
    for (const char* key : kOtherProjections)
        check(
            key, [key](const JsonObject& o) { return isFalse(o.at(key)); }, [](const JsonObject&) { return false; });
    check(
        "camera_model", [](const JsonObject& o) { return isOneOf(kPinholes, o.text("camera_model")); },
        [](const JsonObject& o) { return !isOneOf(kOtherModels, o.text("camera_model")); });
    check(
        kFisheye, [](const JsonObject& o) { return isFalse(o.at(kFisheye)); }, yes);
    check(
        "distortion_params", [](const JsonObject& o) { return isZeroArray(o, "distortion_params"); }, yes);
    for (const char* key : kCoefficients)
        check(
            key, [key](const JsonObject& o) { return o.number(key) == 0; }, yes);
    ++m_cameras;
    m_distorted += distorted;
}

void DistortionCheck::finish()
{
    if (m_distorted > 0)
        m_how.warn(formatString("%s: lens distortion of %zu of %zu cameras is ignored (the first says %s)",
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
