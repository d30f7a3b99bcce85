// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/lens_angles.h"

#include "runtime/cameras/camera_fields.h"

#include <cmath>
#include <numbers>
#include <optional>

namespace gsc {

namespace {

constexpr double kSameFocal = 1e-4; // relative; six printed digits of an angle are closer
constexpr double kSameView = 1e-3;  // the same of an angle and a focal length, one of which was computed from the other

enum class AngleUnit : uint8_t { Radians, Pixels, Degrees };

struct AngleKey {
    const char* x;
    const char* y;
    AngleUnit unit;
};
constexpr AngleKey kRadians{"camera_angle_x", "camera_angle_y", AngleUnit::Radians};
constexpr AngleKey kPixels{"fl_x", "fl_y", AngleUnit::Pixels};
constexpr AngleKey kDegrees{"x_fov", "y_fov", AngleUnit::Degrees};
// The first that an object has is taken, as instant-ngp and nerfstudio do: BlenderNeRF's camera_angle_y is the sensor's and
// not the picture's.
constexpr AngleKey kOfSize[] = {kPixels, kRadians, kDegrees};
// Pixels of a picture whose size nobody states say less than an angle.
constexpr AngleKey kOfNoSize[] = {kRadians, kPixels, kDegrees};

// What one key says: an angle, or a focal length in pixels.
struct StatedAngle {
    const char* key = nullptr;
    const JsonObject* holder = nullptr;
    double radians = 0, pixels = 0; // one of them is 0

    // In pixels of `side`; none where that is not known and an angle is stated.
    [[nodiscard]] std::optional<double> focal(uint32_t side) const
    {
        if (pixels > 0)
            return pixels;
        if (side == 0)
            return std::nullopt;
        return side / (2 * std::tan(radians / 2));
    }
};

StatedAngle readStated(const JsonObject& holder, const char* key, AngleUnit unit)
{
    StatedAngle stated{key, &holder};
    if (unit == AngleUnit::Pixels)
        stated.pixels = readFocal(holder, key);
    else if (unit == AngleUnit::Radians)
        stated.radians = readAngle(holder, key);
    else
        stated.radians = readDegrees(holder, key);
    return stated;
}

void noteDisagreement(const LensKeys& lens, const StatedAngle& taken, const StatedAngle& other, uint32_t side)
{
    std::optional<double> a = taken.focal(side), b = other.focal(side);
    if (taken.pixels == 0 && other.pixels == 0) // comparable in any picture
        a = 1 / std::tan(taken.radians / 2), b = 1 / std::tan(other.radians / 2);
    const double slack = (taken.pixels > 0) == (other.pixels > 0) ? kSameFocal : kSameView;
    if (a && b && std::abs(*a - *b) <= slack * *a)
        return;
    const auto source = [&](const StatedAngle& s) { return s.holder == &lens.frame ? "" : " of the whole file"; };
    lens.notes->add(std::string("angles ") + taken.key + other.key + source(other), lens.frame.where(),
                    formatString("keys \"%s\"%s (%s) and \"%s\"%s (%s) do not say the same; the first is taken",
                                 taken.key, source(taken), shownJson(taken.holder->at(taken.key)).c_str(), other.key,
                                 source(other), shownJson(other.holder->at(other.key)).c_str()));
}

// What is taken for one axis; no key where none is there.
StatedAngle angleOfAxis(const LensKeys& lens, const char* AngleKey::*axis, uint32_t side)
{
    StatedAngle taken;
    for (const JsonObject* holder : {&lens.frame, lens.file})
        for (const AngleKey& key : side > 0 ? kOfSize : kOfNoSize) {
            if (holder == nullptr || !holder->has(key.*axis))
                continue;
            const StatedAngle stated = readStated(*holder, key.*axis, key.unit);
            if (taken.key == nullptr)
                taken = stated;
            else if (lens.notes)
                noteDisagreement(lens, taken, stated, side);
        }
    return taken;
}

} // namespace

void readLensAngles(const LensKeys& lens, Camera& camera)
{
    const StatedAngle x = angleOfAxis(lens, &AngleKey::x, camera.width);
    const StatedAngle y = angleOfAxis(lens, &AngleKey::y, camera.height);
    if (x.key == nullptr && y.key == nullptr)
        throw Error(ErrorCode::InvalidFile,
                    formatString("%s: neither \"camera_angle_x\" nor \"fl_x\" is there, expected one of them in "
                                 "the frame or in the file; add one, or export the cameras again",
                                 lens.frame.where().c_str()));
    const StatedAngle& first = x.key ? x : y;
    if (first.pixels > 0 && (y.key == nullptr || y.pixels > 0)) {
        camera.focal_x = first.pixels;
        camera.focal_y = y.key ? y.pixels : first.pixels;
        return;
    }
    const bool comparable = camera.width > 0 || (x.pixels == 0 && y.pixels == 0);
    if (!comparable && x.key && y.key)
        lens.notes->add("mixed", lens.frame.where(),
                        formatString("key \"%s\" is in other units than \"%s\" and the image has no size to compare "
                                     "them by; \"%s\" is ignored and pixels are taken as square",
                                     y.key, x.key, y.key));
    const auto radians = [](const StatedAngle& s, uint32_t side) {
        return s.pixels > 0 ? 2 * std::atan(side / (2 * s.pixels)) : s.radians;
    };
    if (!comparable) {
        camera.focal_x = camera.focal_y = x.pixels;
        camera.fov_x = x.radians;
        return;
    }
    if (x.key)
        camera.fov_x = radians(x, camera.width);
    if (y.key)
        camera.fov_y = radians(y, camera.height);
}

} // namespace gsc
