// SPDX-License-Identifier: Apache-2.0
// The cameras of a COLMAP model while its files are parsed: lens models by number and name, and checks.
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

// Projection of a lens model where all of its coefficients are 0.
enum class LensKind : uint8_t { Pinhole, Fisheye, Panorama };

struct LensModel {
    const char* name;
    size_t values;
    bool two_focals; // fx, fy; otherwise one for both
    LensKind kind;
    size_t coefficients; // the first so many behind cx, cy; if all are 0, `kind` says which lens it is
};

// By COLMAP's number (src/colmap/sensor/models.h of 4.0).
std::span<const LensModel> lensModels();

struct ColmapLens {
    const LensModel* model = nullptr;
    double width = 0, height = 0;
    std::array<double, 16> values{};

    [[nodiscard]] size_t focals() const { return model->two_focals ? 2 : 1; }
    [[nodiscard]] bool distorts() const;
};

struct ColmapPose {
    double rotation[4], translation[3]; // world to camera, w x y z
    int64_t image = 0, camera = 0;
    std::string name;
};

class ColmapModel {
public:
    // `name` is used in messages.
    ColmapModel(std::string name, const CameraReading& how) : m_name(std::move(name)), m_how(how), m_notes(m_name) {}

    [[nodiscard]] const std::string& name() const { return m_name; }
    [[nodiscard]] const CameraReading& how() const { return m_how; }
    [[noreturn]] void fail(const std::string& found, const std::string& expected) const;

    // All throw Error(InvalidFile), a lens that is not ignored Error(Unsupported).
    void addLens(int64_t id, const ColmapLens& lens);
    void addPose(const ColmapPose& pose);
    // A camera of a model that is not in lensModels(): refused as Unsupported once an image is of it.
    void addUnknown(int64_t id, const std::string& model);
    [[noreturn]] void refuseUnknown(const std::string& what, const std::string& model) const;
    [[nodiscard]] bool hasLens(int64_t id) const { return m_lenses.contains(id) || m_unknown.contains(id); }
    // `file` states how many cameras or images it has. Precondition: all are added.
    void checkCount(const char* file, uint64_t stated, bool of_images) const;
    // Finds by name. Throws if there is none.
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
