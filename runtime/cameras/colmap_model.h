// SPDX-License-Identifier: Apache-2.0
// The cameras of a COLMAP model while the files are parsed: lens models by number and name, and checks.
#pragma once

#include "runtime/cameras/camera_fields.h"

#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <set>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gsc {

// Projection of a lens model if all of its coefficients are 0.
enum class LensKind : uint8_t { Pinhole, Fisheye, Panorama };

struct LensModel {
    const char* name;
    size_t values;
    bool two_focals; // true: the values begin with fx, fy; false: with one focal length for both axes
    LensKind kind;
    size_t coefficients; // number of coefficients, which follow cx, cy; if all are 0, `kind` is the projection
};

// Returns the lens models; the index is COLMAP's number (src/colmap/sensor/models.h of 4.0).
std::span<const LensModel> lensModels();

struct ColmapLens {
    const LensModel* model = nullptr;
    double width = 0, height = 0;
    std::array<double, 16> values{};

    [[nodiscard]] size_t focals() const { return model->two_focals ? 2 : 1; }
    [[nodiscard]] bool distorts() const;
};

struct ColmapPose {
    double rotation[4], translation[3]; // world to camera; rotation as a quaternion w, x, y, z
    int64_t image = 0, camera = 0;
    std::string name;
};

class ColmapModel {
public:
    // `name` names the model in messages.
    ColmapModel(std::string name, const CameraReading& how) : m_name(std::move(name)), m_how(how), m_notes(m_name) {}

    [[nodiscard]] const std::string& name() const { return m_name; }
    [[nodiscard]] const CameraReading& how() const { return m_how; }
    [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

    // The functions below throw Error(InvalidFile), or Error(Unsupported) for a lens with distortion that is not to be
    // ignored.
    void addLens(int64_t id, const ColmapLens& lens);
    void addPose(const ColmapPose& pose);
    // Adds a camera with a lens model that is not in lensModels(). It is refused as Unsupported once an image uses it.
    void addUnknown(int64_t id, const std::string& model);
    [[noreturn]] void refuseUnknown(const std::string& what, const std::string& model) const;
    [[nodiscard]] bool hasLens(int64_t id) const { return m_lenses.contains(id) || m_unknown.contains(id); }
    // Checks the number of cameras or images that `file` states. Precondition: all have been added.
    void checkCount(const char* file, uint64_t stated, bool of_images) const;
    // Returns the cameras in the order of their names. Throws if there is none.
    std::vector<Camera> finish();

private:
    void distorted(const ColmapLens& lens, const std::string& image);

    std::string m_name, m_first;
    const CameraReading& m_how;
    std::map<int64_t, ColmapLens> m_lenses;
    std::map<int64_t, std::string> m_unknown;
    CameraNotes m_notes;
    std::set<int64_t> m_images;
    std::vector<Camera> m_cameras;
    size_t m_distorted = 0;
};

} // namespace gsc
