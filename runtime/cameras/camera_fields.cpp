// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_fields.h"

#include "format/numbers/count_text.h"
#include <glm/gtc/type_ptr.hpp>
#include <glm/matrix.hpp>

#include <cctype>
#include <cmath>
#include <numbers>
#include <numeric>

namespace gsc {

namespace {

constexpr double kWide = 170 * std::numbers::pi / 180; // an angle of view that is warned of, radians
constexpr size_t kMostNamed = 12;                      // most keys that a warning names
// limit of the axis's place, pixels; after a crop it may lie outside the image, but not so far
constexpr double kMaxCentre = 1e6;
constexpr const char* kFisheye = "is_fisheye";
// Camera models that no pinhole camera can stand for: their files are always refused.
constexpr const char* kOtherProjections[] = {"latlong", "equirectangular", "orthographic"};
constexpr const char* kOtherModels[] = {
    "EQUIRECTANGULAR",         "LATLONG", "ORTHOGRAPHIC", "ORTHOPHOTO", "OMNIDIRECTIONALSTEREO_L",
    "OMNIDIRECTIONALSTEREO_R", "VR180_L", "VR180_R"};
// Camera models that are pinholes if every coefficient is 0.
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
                     formatString("\"%s\" beside it, because it is in pixels", size_key), "add the size of the image");
    if (!(std::abs(centre) <= kMaxCentre))
        holder->fail(key, formatString("%g", centre), "a number of pixels between -1e6 and 1e6");
    return 0.5 * size - centre;
}

} // namespace

void CameraNotes::add(const std::string& kind, const std::string& where, const std::string& text)
{
    Note& note = m_notes[kind];
    if (note.count == 0)
        note.text = where + ": " + text;
    if (note.count == 0 || note.last != where)
        ++note.count;
    note.last = where;
}

void CameraNotes::addUnread(const JsonObject& object, std::span<const char* const> known)
{
    for (const std::string& key : object.keys())
        if (std::ranges::find(known, key) == known.end())
            m_unread.insert(key);
}

std::vector<std::string> CameraNotes::sentences() const
{
    std::vector<std::string> all;
    for (const auto& [kind, note] : m_notes)
        all.push_back(note.count == 1 ? note.text : note.text + formatString("; so in %zu places", note.count));
    if (m_unread.empty())
        return all;
    std::string names;
    size_t named = 0;
    for (const std::string& key : m_unread) {
        if (named++ == kMostNamed)
            break;
        names += (names.empty() ? "" : ", ") + shownJson(key);
    }
    if (m_unread.size() > kMostNamed)
        names += formatString(" and %zu more", m_unread.size() - kMostNamed);
    all.push_back(m_file + ": has " + names +
                  ", which no camera here is made of; poses and lenses are those of the other keys");
    return all;
}

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
        throw Error(ErrorCode::Unsupported, holder.where(), formatString("key \"%s\" is %s", key, value.c_str()),
                    "a pinhole",
                    "such a picture is none even without its distortion, so cut it into pinhole pictures and export "
                    "their cameras");
    if (!m_how.ignore_distortion)
        throw Error(ErrorCode::Unsupported, holder.where(), formatString("key \"%s\" is %s", key, value.c_str()),
                    "a pinhole without distortion",
                    "undistort the images and export the cameras again, or take the lens as a pinhole")
            .with({Setting::LensDistortion});
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
        m_how.warn(formatString("%s: lens distortion of %s of %s is ignored (the first says %s)", m_file.c_str(),
                                formatCount(m_distorted).c_str(), formatCount(m_cameras, "camera").c_str(),
                                m_first.c_str()));
}

MiddleOffset readMiddleOffset(const LensKeys& lens, uint32_t width, uint32_t height)
{
    return {middleOffset(lens, "cx", "w", width), middleOffset(lens, "cy", "h", height)};
}

double orthogonalityError(const glm::dmat3& m, double scale2)
{
    const glm::dmat3 off = transpose(m) * m - glm::dmat3(scale2);
    const double* const entries = glm::value_ptr(off);
    return std::accumulate(entries, entries + 9, 0.0, [](double a, double b) { return std::max(a, std::abs(b)); });
}

double readFocal(const JsonObject& object, const char* key)
{
    const double focal = object.positive(key);
    if (focal < 1e-3 || focal > 1e9)
        object.fail(key, formatString("%g", focal), "a focal length between 0.001 and 1e9 pixels");
    return focal;
}

double readAngle(const JsonObject& object, const char* key)
{
    const double angle = object.number(key);
    if (!(angle >= 1e-6 && angle < std::numbers::pi - 1e-6))
        object.fail(key, formatString("%g", angle), "an angle in radians between 0 and pi");
    return angle;
}

double readDegrees(const JsonObject& object, const char* key)
{
    const double degrees = object.number(key);
    if (!(degrees >= 1e-4 && degrees < 180 - 1e-4))
        object.fail(key, formatString("%g", degrees), "an angle in degrees between 0 and 180");
    return degrees * std::numbers::pi / 180;
}

void readRotation(const JsonObject& object, double out[9], const char* what)
{
    object.matrix("rotation", 3, 3, out);
    // the file's numbers are row by row, glm's matrices column by column
    const glm::dmat3 rotation = transpose(glm::make_mat3(out));
    const double error = orthogonalityError(rotation, 1), det = determinant(rotation);
    if (!(error < kRotationTolerance) || det < 0)
        object.fail("rotation", formatString("no rotation (determinant %g, columns off orthonormal by %g)", det, error),
                    formatString("an orthonormal, right-handed %s matrix", what));
}

void noteUnusual(const Camera& camera, const std::string& where, CameraNotes& notes)
{
    const double widest = std::max(camera.fov_x, camera.fov_y);
    if (widest > kWide)
        notes.add(
            "wide", where,
            formatString("sees %g degrees, nearly a half turn, which is seldom meant; is the focal length in pixels "
                         "of that size?",
                         widest * 180 / std::numbers::pi));
    const double right = std::abs(camera.tan_mid_x) / std::tan(camera.fov_x / 2);
    const double down = std::abs(camera.tan_mid_y) / std::tan(camera.fov_y / 2);
    if (right > 1 || down > 1)
        notes.add("axis", where, "the axis (cx, cy) meets no pixel of the image, which is seldom meant; it is kept");
}

} // namespace gsc
