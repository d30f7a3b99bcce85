// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/colmap_model.h"

#include "format/numbers/count_text.h"
#include <gsc/error.h>

#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

constexpr uint32_t kMaxSide = 32768; // largest width and height of an image, pixels
constexpr double kUnitError = 0.01; // largest error of the length of a quaternion, which may be printed with few digits
// limit of the axis's place, pixels; after a crop it may lie outside the image, but not so far
constexpr double kMaxMiddle = 1e6;

constexpr LensModel kModels[] = {{"SIMPLE_PINHOLE", 3, false, LensKind::Pinhole, 0},
                                 {"PINHOLE", 4, true, LensKind::Pinhole, 0},
                                 {"SIMPLE_RADIAL", 4, false, LensKind::Pinhole, 1},
                                 {"RADIAL", 5, false, LensKind::Pinhole, 2},
                                 {"OPENCV", 8, true, LensKind::Pinhole, 4},
                                 {"OPENCV_FISHEYE", 8, true, LensKind::Fisheye, 4},
                                 {"FULL_OPENCV", 12, true, LensKind::Pinhole, 8},
                                 {"FOV", 5, true, LensKind::Pinhole, 1},
                                 {"SIMPLE_RADIAL_FISHEYE", 4, false, LensKind::Fisheye, 1},
                                 {"RADIAL_FISHEYE", 5, false, LensKind::Fisheye, 2},
                                 {"THIN_PRISM_FISHEYE", 12, true, LensKind::Fisheye, 8},
                                 {"RAD_TAN_THIN_PRISM_FISHEYE", 16, true, LensKind::Fisheye, 12},
                                 {"SIMPLE_DIVISION", 4, false, LensKind::Pinhole, 1},
                                 {"DIVISION", 5, true, LensKind::Pinhole, 1},
                                 {"SIMPLE_FISHEYE", 3, false, LensKind::Fisheye, 0},
                                 {"FISHEYE", 4, true, LensKind::Fisheye, 0},
                                 {"EUCM", 6, true, LensKind::Pinhole, 1}, // alpha; without it beta does nothing
                                 {"EQUIRECTANGULAR", 2, false, LensKind::Panorama, 0}};

long long shown(int64_t id)
{
    return static_cast<long long>(id);
}

Camera cameraOfPose(const ColmapLens& lens, const ColmapPose& pose, double length)
{
    Camera camera;
    camera.name = imageName(pose.name);
    const auto& q = pose.rotation;
    // the columns of the world-to-camera rotation are the rows of the camera-to-world rotation
    const glm::dmat3 to_camera = glm::mat3_cast(glm::dquat(q[0], q[1], q[2], q[3]) / length);
    std::copy_n(glm::value_ptr(to_camera), 9, camera.rotation);
    std::copy_n(pose.translation, 3, camera.translation);
    const double fx = lens.values[0], fy = lens.values[lens.focals() - 1];
    const double* middle = lens.values.data() + lens.focals();
    camera.width = uint32_t(lens.width);
    camera.height = uint32_t(lens.height);
    camera.fov_x = angleOf(lens.width, fx);
    camera.fov_y = angleOf(lens.height, fy);
    camera.tan_mid_x = (lens.width / 2 - middle[0]) / fx;
    camera.tan_mid_y = (lens.height / 2 - middle[1]) / fy;
    return camera;
}

} // namespace

std::span<const LensModel> lensModels()
{
    return kModels;
}

bool ColmapLens::distorts() const
{
    const double* const first = values.data() + focals() + 2;
    return model->kind != LensKind::Pinhole ||
           std::any_of(first, first + model->coefficients, [](double v) { return v != 0; });
}

void ColmapModel::fail(const std::string& found, const std::string& expected) const
{
    throw Error(ErrorCode::InvalidFile, m_name, found, expected, "export the model from COLMAP again");
}

void ColmapModel::addLens(int64_t id, const ColmapLens& lens)
{
    const auto side = [](double pixels) { return pixels >= 1 && pixels <= kMaxSide && pixels == std::floor(pixels); };
    if (!side(lens.width) || !side(lens.height))
        fail(formatString("camera %lld is %g x %g", shown(id), lens.width, lens.height),
             formatString("1 to %u pixels, whole ones", kMaxSide));
    if (lens.model->kind != LensKind::Panorama) {
        for (size_t i = 0; i < lens.focals(); ++i)
            if (!(lens.values[i] >= 1e-3 && lens.values[i] <= 1e9))
                fail(formatString("camera %lld has a focal length of %g", shown(id), lens.values[i]),
                     "0.001 to 1e9 pixels");
        for (size_t i = lens.focals(); i < lens.focals() + 2; ++i)
            if (!(std::abs(lens.values[i]) <= kMaxMiddle))
                fail(formatString("camera %lld has a principal point at %g", shown(id), lens.values[i]),
                     "-1e6 to 1e6 pixels");
    }
    if (m_unknown.contains(id) || !m_lenses.emplace(id, lens).second)
        fail(formatString("camera %lld is there twice", shown(id)), "each number once");
}

void ColmapModel::addUnknown(int64_t id, const std::string& model)
{
    if (m_lenses.contains(id) || !m_unknown.emplace(id, model).second)
        fail(formatString("camera %lld is there twice", shown(id)), "each number once");
}

void ColmapModel::refuseUnknown(const std::string& what, const std::string& model) const
{
    throw Error(ErrorCode::Unsupported, m_name,
                formatString("%s is of the model %s, which is not known here", what.c_str(), model.c_str()),
                "one of COLMAP 4.0's such as PINHOLE",
                "undistort the images (colmap image_undistorter), or correct the name");
}

void ColmapModel::addPose(const ColmapPose& pose)
{
    if (const auto unknown = m_unknown.find(pose.camera); unknown != m_unknown.end())
        refuseUnknown("the camera of image " + pose.name.substr(0, 60), unknown->second);
    const auto lens = m_lenses.find(pose.camera);
    if (lens == m_lenses.end())
        fail(formatString("image %.60s is of camera %lld, which is not there", pose.name.c_str(), shown(pose.camera)),
             "one of the cameras file");
    if (!m_images.insert(pose.image).second)
        fail(formatString("image %lld is there twice, %.60s the second time", shown(pose.image), pose.name.c_str()),
             "each number once");
    const auto& q = pose.rotation;
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 1e-9 && length < 1e9))
        fail(formatString("image %.60s has a quaternion of length %g", pose.name.c_str(), length), "1");
    if (std::abs(length - 1) > kUnitError)
        m_notes.add("length", m_name + ": image " + pose.name.substr(0, 60),
                    formatString("its quaternion has the length %g and not 1; it is normalised", length));
    for (const double t : pose.translation)
        if (!(std::abs(t) <= 1e15)) // also fails for NaN
            fail(formatString("image %.60s is nowhere", pose.name.c_str()), "a finite place");
    if (lens->second.distorts())
        distorted(lens->second, pose.name);
    m_cameras.push_back(cameraOfPose(lens->second, pose, length));
    noteUnusual(m_cameras.back(), m_name + ": image " + pose.name.substr(0, 60), m_notes);
}

void ColmapModel::checkCount(const char* file, uint64_t stated, bool of_images) const
{
    const size_t found = of_images ? m_cameras.size() : m_lenses.size() + m_unknown.size();
    if (stated != found)
        m_how.warn(formatString("%s: %s says that it has %s and has %s; those are taken", m_name.c_str(), file,
                                formatCount(stated, of_images ? "image" : "camera").c_str(),
                                formatCount(found).c_str()));
}

std::vector<Camera> ColmapModel::finish()
{
    if (m_cameras.empty())
        fail("no image", "at least one");
    if (m_distorted > 0)
        m_how.warn(formatString("%s: lens distortion of %s of %s is ignored (the first is %s)", m_name.c_str(),
                                formatCount(m_distorted).c_str(), formatCount(m_cameras.size(), "camera").c_str(),
                                m_first.c_str()));
    for (const std::string& text : m_notes.sentences())
        m_how.warn(text);
    std::stable_sort(m_cameras.begin(), m_cameras.end(),
                     [](const Camera& a, const Camera& b) { return a.name < b.name; });
    return std::move(m_cameras);
}

void ColmapModel::distorted(const ColmapLens& lens, const std::string& image)
{
    const std::string what = image.substr(0, 60) + ", " + lens.model->name;
    if (lens.model->kind == LensKind::Panorama)
        throw Error(ErrorCode::Unsupported, m_name, "image " + what + " is a panorama", "a pinhole",
                    "cut it into pinhole pictures, or undistort the images and export the model again");
    if (!m_how.ignore_distortion)
        throw Error(ErrorCode::Unsupported, m_name, "image " + what + " states lens distortion", "a pinhole",
                    "undistort the images (colmap image_undistorter), or take the lens as a pinhole")
            .with({Setting::LensDistortion});
    if (m_distorted++ == 0)
        m_first = what;
}

} // namespace gsc
