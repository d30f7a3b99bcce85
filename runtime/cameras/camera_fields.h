// SPDX-License-Identifier: Apache-2.0
// Reads JSON fields that several camera formats share (lens and pose). Collects warnings of unread keys and of
// assumptions, one sentence for each kind.
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

// Collects assumptions that are made while a file is read. Each kind becomes one sentence, however many frames it
// concerns.
class CameraNotes {
public:
    explicit CameraNotes(std::string file) : m_file(std::move(file)) {}

    // Keeps `text` for the first object of each `kind`, and counts the objects. `where` names the object.
    void add(const std::string& kind, const std::string& where, const std::string& text);
    // Notes the keys of `object` that are not in `known`; one sentence names them all.
    void addUnread(const JsonObject& object, std::span<const char* const> known);
    // Returns one sentence for each kind, none if nothing was assumed. Call it after the last object.
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

// The object of a frame and that of the whole file; a key that the frame lacks is looked for in the file.
struct LensKeys {
    const JsonObject& frame;
    const JsonObject* file = nullptr; // null: the frame has no such file
    CameraNotes* notes = nullptr;     // notes keys whose values differ between frame and file; may be null

    // Returns the object that has `key`: the frame, else the file; null if neither has. `null_counts`: a key with the
    // value null counts as present.
    [[nodiscard]] const JsonObject* holder(const char* key, bool null_counts = true) const;
};

// Keys that DistortionCheck reads; kCoefficients are those of the lenses of OpenCV, COLMAP and nerfstudio.
constexpr const char* kProjectionKeys[] = {"camera_model",    "is_fisheye",   "latlong",
                                           "equirectangular", "orthographic", "distortion_params"};
constexpr const char* kCoefficients[] = {
    "k0", "k1", "k2", "k3", "k4",  "k5",  "k6",    "p0",        "p1",        "p2",        "p3",        "p4",       "s0",
    "s1", "s2", "s3", "s4", "sx1", "sy1", "omega", "ftheta_p0", "ftheta_p1", "ftheta_p2", "ftheta_p3", "ftheta_p4"};

// Finds lenses that a pinhole camera cannot show: a coefficient such as k1 or p2 that is not 0, another camera model,
// or a fisheye lens.
class DistortionCheck {
public:
    // If `how` says that such lenses are ignored, finish() warns in one sentence for the whole file; otherwise they
    // are refused.
    DistortionCheck(std::string file, const CameraReading& how);

    // Checks a lens. Throws Error(Unsupported) if it cannot be ignored, or is not to be ignored; Error(InvalidFile)
    // for a key of the wrong type.
    void add(const LensKeys& lens);
    // Warns of ignored lenses; call it after the last camera.
    void finish();

private:
    void found(const JsonObject& holder, const char* key, bool has_pinhole);

    std::string m_file, m_first;
    const CameraReading& m_how;
    size_t m_cameras = 0, m_distorted = 0;
};

// Reads where the axis meets the image (cx, cy). Returns the distance from there to the middle of `width` x `height`,
// in pixels right and down; 0 for a missing key. Throws Error(InvalidFile), also if cx or cy is stated but the size is
// not known (0).
struct MiddleOffset {
    double x = 0, y = 0;
};
MiddleOffset readMiddleOffset(const LensKeys& lens, uint32_t width, uint32_t height);

constexpr double kRotationTolerance = 1e-3; // files printed with six digits pass, scaled or sheared matrices do not

// Largest deviation of an entry of m^T m from `scale2` times the identity.
double orthogonalityError(const glm::dmat3& m, double scale2);

// Reads a focal length in pixels. It has bounds, beyond which the tangents of the angle of view do not fit fp32.
double readFocal(const JsonObject& object, const char* key);
double readAngle(const JsonObject& object, const char* key);   // reads an angle in radians
double readDegrees(const JsonObject& object, const char* key); // reads an angle in degrees; returns radians
// Reads an orthonormal, right-handed matrix of 3 rows into `out`, row by row. `what` names the matrix in messages.
void readRotation(const JsonObject& object, double out[9], const char* what = "camera-to-world");

// Adds a note for a lens that is possible but seldom meant: the axis lies outside the image, or the angle of view is
// close to 180 degrees.
void noteUnusual(const Camera& camera, const std::string& where, CameraNotes& notes);

// Distortion and notes found in the cameras of a file.
struct CameraFindings {
    DistortionCheck distortion;
    CameraNotes notes;

    CameraFindings(const std::string& file, const CameraReading& how) : distortion(file, how), notes(file) {}
    // Adds the warnings to `how`; call it after the last camera.
    void tell(const CameraReading& how)
    {
        distortion.finish();
        for (const std::string& text : notes.sentences())
            how.warn(text);
    }
};

// Reads each object of an array as a camera, by `read`. `what` names the objects in messages. `root`, if not null, is
// the object that holds the array. Keys of both that are not in `known` are noted.
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

// Joins several lists of keys.
template <size_t... N>
constexpr auto joinKeys(const char* const (&... lists)[N])
{
    std::array<const char*, (N + ...)> all{};
    auto end = all.begin();
    ((end = std::copy_n(lists, N, end)), ...);
    return all;
}

} // namespace gsc
