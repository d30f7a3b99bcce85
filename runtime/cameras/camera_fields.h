// SPDX-License-Identifier: Apache-2.0
// Reads fields of JSON that several camera formats share: lens and pose; notes unread keys, and each kind of assumption
// with one sentence.
#pragma once

#include "runtime/cameras/camera_reading.h"
#include "runtime/cameras/json_fields.h"

#include <glm/mat3x3.hpp>

#include <algorithm>
#include <array>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// Assumptions made while a file was read, one sentence for each kind however many frames it concerns.
class CameraNotes {
public:
    explicit CameraNotes(std::string file) : m_file(std::move(file)) {}

    // Keeps the text for the first object of each `kind`, and counts the objects. `where`: name of the object.
    void add(const std::string& kind, const std::string& where, const std::string& text);
    // The keys of `object` that are not in `known` are named together.
    void addUnread(const JsonObject& object, std::span<const char* const> known);
    // After the last object: one sentence each, none where nothing was assumed.
    [[nodiscard]] std::vector<std::string> sentences() const;

private:
    struct Note {
        std::string text, last;
        size_t count = 0;
    };

    std::string m_file;
    std::map<std::string, Note> m_notes;
    std::set<std::string> m_unread;
};

// The keys of a frame, which stand for those of the whole file where the frame lacks them.
struct LensKeys {
    const JsonObject& frame;
    const JsonObject* file = nullptr; // null: the frame stands alone
    CameraNotes* notes = nullptr;     // takes keys that frame and file have with different values

    // Finds the object that has `key`: the frame, else the file; null if neither has. Without `null_counts` a value of
    // null counts as missing.
    [[nodiscard]] const JsonObject* holder(const char* key, bool null_counts = true) const;
};

// Keys that DistortionCheck reads; coefficients are those of the lenses of OpenCV, COLMAP and nerfstudio.
constexpr const char* kProjectionKeys[] = {"camera_model",    "is_fisheye",   "latlong",
                                           "equirectangular", "orthographic", "distortion_params"};
constexpr const char* kCoefficients[] = {
    "k0", "k1", "k2", "k3", "k4",  "k5",  "k6",    "p0",        "p1",        "p2",        "p3",        "p4",       "s0",
    "s1", "s2", "s3", "s4", "sx1", "sy1", "omega", "ftheta_p0", "ftheta_p1", "ftheta_p2", "ftheta_p3", "ftheta_p4"};

// Finds a lens that no pinhole can show: a coefficient such as k1 or p2 that is not 0, another camera model, a fisheye
// lens.
class DistortionCheck {
public:
    // Tells `how` in one sentence for the file where such lenses are ignored; otherwise they are refused.
    DistortionCheck(std::string file, const CameraReading& how);

    // Throws Error(Unsupported) for a lens that is not ignored or has no pinhole (a panorama), Error(InvalidFile) for a key of the wrong type.
    void add(const LensKeys& lens);
    // After the last camera.
    void finish();

private:
    void found(const JsonObject& holder, const char* key, bool has_pinhole);

    std::string m_file, m_first;
    const CameraReading& m_how;
    size_t m_cameras = 0, m_distorted = 0;
};

// Pixels from where the axis meets the image (cx, cy) to the middle of `width` x `height`, right and down; 0 for a
// missing key. Throws Error(InvalidFile), also if cx or cy is there and the size is not (0).
struct MiddleOffset {
    double x = 0, y = 0;
};
MiddleOffset readMiddleOffset(const LensKeys& lens, uint32_t width, uint32_t height);

constexpr double kRotationTolerance = 1e-3; // files with six printed digits pass, scaled or sheared matrices do not

// Largest deviation of m^T m from `scale2` times the identity.
double orthogonalityError(const glm::dmat3& m, double scale2);

// A focal length in pixels; outside its bounds the tangents of the view leave fp32.
double readFocal(const JsonObject& object, const char* key);
double readAngle(const JsonObject& object, const char* key);   // radians
double readDegrees(const JsonObject& object, const char* key); // the file's; returns radians
// An orthonormal, right-handed matrix of 3 rows, row-major; `what`: its name in messages.
void readRotation(const JsonObject& object, double out[9], const char* what = "camera-to-world");

// Tells `notes` of a lens that is possible and seldom meant: an axis outside the image, an angle close to a half turn.
void noteUnusual(const Camera& camera, const std::string& where, CameraNotes& notes);

// Findings in the cameras of a file beside their poses.
struct CameraFindings {
    DistortionCheck distortion;
    CameraNotes notes;

    CameraFindings(const std::string& file, const CameraReading& how) : distortion(file, how), notes(file) {}
    // After the last camera.
    void tell(const CameraReading& how)
    {
        distortion.finish();
        for (const std::string& text : notes.sentences())
            how.warn(text);
    }
};

// Collects the results of `read` for each object of an array; `what`: their name in messages. `root`, if given, is the
// object that holds the array; unknown keys of both, not in `known`, are noted.
struct ArrayOfCameras {
    const ParsedJson& array;
    const std::string& file;
    const char* what;
    std::span<const char* const> known;
    const JsonObject* root = nullptr;
    std::span<const char* const> known_of_root = {};
};
template <typename Read>
auto readEach(const ArrayOfCameras& from, const CameraReading& how, const Read& read)
{
    CameraFindings found(from.file, how);
    if (from.root)
        found.notes.addUnread(*from.root, from.known_of_root);
    std::vector<decltype(read(std::declval<JsonObject&>(), found, 0))> cameras;
    cameras.reserve(from.array.size());
    for (size_t i = 0; i < from.array.size(); ++i) {
        JsonObject object(from.array[i], formatString("%s: %s %zu", from.file.c_str(), from.what, i));
        found.notes.addUnread(object, from.known);
        cameras.push_back(read(object, found, i));
    }
    found.tell(how);
    return cameras;
}

// The keys of several lists, one list behind the other.
template <size_t... N>
constexpr auto joinKeys(const char* const (&... lists)[N])
{
    std::array<const char*, (N + ...)> all{};
    auto end = all.begin();
    ((end = std::copy_n(lists, N, end)), ...);
    return all;
}

} // namespace gsc
