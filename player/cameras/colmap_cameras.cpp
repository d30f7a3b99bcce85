// SPDX-License-Identifier: Apache-2.0
#include "player/cameras/colmap_cameras.h"

#include "format/error.h"
#include "format/file/read_file.h"

#include <glm/gtc/quaternion.hpp>
#include <glm/gtc/type_ptr.hpp>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <map>
#include <sstream>

namespace gsc {

namespace fs = std::filesystem;

namespace {

constexpr uint64_t kMaxModelBytes = uint64_t(8) << 30; // images.bin also lists the points of every image
constexpr uint32_t kMaxSide = 32768;                   // pixels

struct LensModel {
    const char* name;
    size_t values;
    bool two_focals; // fx, fy; otherwise one for both
    bool fisheye;
};

// By COLMAP's number. After the focal lengths come cx and cy, then what no pinhole shows.
constexpr LensModel kModels[] = {{"SIMPLE_PINHOLE", 3, false, false},
                                 {"PINHOLE", 4, true, false},
                                 {"SIMPLE_RADIAL", 4, false, false},
                                 {"RADIAL", 5, false, false},
                                 {"OPENCV", 8, true, false},
                                 {"OPENCV_FISHEYE", 8, true, true},
                                 {"FULL_OPENCV", 12, true, false},
                                 {"FOV", 5, true, true},
                                 {"SIMPLE_RADIAL_FISHEYE", 4, false, true},
                                 {"RADIAL_FISHEYE", 5, false, true},
                                 {"THIN_PRISM_FISHEYE", 12, true, true}};

struct Lens {
    const LensModel* model = nullptr;
    double width = 0, height = 0;
    std::array<double, 12> values{};

    [[nodiscard]] bool distorts() const
    {
        return model->fisheye ||
               std::any_of(values.begin() + (model->two_focals ? 4 : 3), values.begin() + std::ptrdiff_t(model->values),
                           [](double v) { return v != 0; });
    }
};

struct Pose {
    double rotation[4], translation[3]; // world to camera, w x y z
    int64_t camera = 0;
    std::string name;
};

class Parser {
public:
    Parser(std::string name, std::vector<std::string>* ignored) : m_name(std::move(name)), m_ignored(ignored) {}

    [[noreturn]] void fail(const std::string& found, const std::string& expected) const
    {
        throw Error(ErrorCode::InvalidFile,
                    m_name + ": " + found + ", expected " + expected + "; export the model from COLMAP again");
    }

    void addLens(int64_t id, const Lens& lens)
    {
        const bool whole = lens.width >= 1 && lens.width <= kMaxSide && lens.height >= 1 && lens.height <= kMaxSide;
        if (!whole)
            fail(formatString("camera %lld is %g x %g", static_cast<long long>(id), lens.width, lens.height),
                 formatString("1 to %u pixels", kMaxSide));
        for (size_t i = 0; i < (lens.model->two_focals ? 2u : 1u); ++i)
            if (!(lens.values[i] >= 1e-3 && lens.values[i] <= 1e9))
                fail(formatString("camera %lld has a focal length of %g", static_cast<long long>(id), lens.values[i]),
                     "0.001 to 1e9 pixels");
        m_lenses[id] = lens;
    }

    void addPose(const Pose& pose)
    {
        const auto lens = m_lenses.find(pose.camera);
        if (lens == m_lenses.end())
            fail(formatString("image %.60s is of camera %lld, which is not there", pose.name.c_str(),
                              static_cast<long long>(pose.camera)),
                 "one of the cameras file");
        const auto& q = pose.rotation;
        const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
        if (!(length > 0.99 && length < 1.01))
            fail(formatString("image %.60s has a quaternion of length %g", pose.name.c_str(), length), "1");
        for (const double t : pose.translation)
            if (!std::isfinite(t))
                fail(formatString("image %.60s is nowhere", pose.name.c_str()), "a finite place");
        if (lens->second.distorts())
            distorted(lens->second, pose.name);
        m_cameras.push_back(cameraOf(lens->second, pose, length));
    }

    std::vector<Camera> finish()
    {
        if (m_cameras.empty())
            fail("no image", "at least one");
        if (m_distorted > 0)
            m_ignored->push_back(
                formatString("%s: %zu of %zu cameras state lens distortion (the first is %s), which is "
                             "ignored",
                             m_name.c_str(), m_distorted, m_cameras.size(), m_first.c_str()));
        std::stable_sort(m_cameras.begin(), m_cameras.end(),
                         [](const Camera& a, const Camera& b) { return a.name < b.name; });
        return std::move(m_cameras);
    }

private:
    void distorted(const Lens& lens, const std::string& image)
    {
        const std::string what = image.substr(0, 60) + ", " + lens.model->name;
        if (m_ignored == nullptr)
            throw Error(ErrorCode::Unsupported,
                        formatString("%s: image %s states lens distortion, expected a pinhole; undistort the images "
                                     "(colmap image_undistorter), or pass --ignore-distortion",
                                     m_name.c_str(), what.c_str()));
        if (m_distorted++ == 0)
            m_first = what;
    }

    static Camera cameraOf(const Lens& lens, const Pose& pose, double length)
    {
        Camera camera;
        const std::string file = pose.name.substr(pose.name.find_last_of("/\\") + 1);
        camera.name = file.substr(0, file.find('.', 1));
        const auto& q = pose.rotation;
        // its columns, world to camera, are the rows of camera to world
        const glm::dmat3 to_camera = glm::mat3_cast(glm::dquat(q[0], q[1], q[2], q[3]) / length);
        std::copy_n(glm::value_ptr(to_camera), 9, camera.rotation);
        std::copy_n(pose.translation, 3, camera.translation);
        const double fx = lens.values[0], fy = lens.values[lens.model->two_focals ? 1 : 0];
        const double* middle = lens.values.data() + (lens.model->two_focals ? 2 : 1);
        camera.width = uint32_t(lens.width);
        camera.height = uint32_t(lens.height);
        camera.fov_x = 2 * std::atan(lens.width / (2 * fx));
        camera.fov_y = 2 * std::atan(lens.height / (2 * fy));
        camera.tan_mid_x = (lens.width / 2 - middle[0]) / fx;
        camera.tan_mid_y = (lens.height / 2 - middle[1]) / fy;
        return camera;
    }

    std::string m_name, m_first;
    std::vector<std::string>* m_ignored;
    std::map<int64_t, Lens> m_lenses;
    std::vector<Camera> m_cameras;
    size_t m_distorted = 0;
};

void parseText(std::string_view cameras, std::string_view images, Parser& parser)
{
    std::istringstream lines{std::string(cameras)};
    for (std::string line; std::getline(lines, line);) {
        std::istringstream words(line);
        std::string model;
        int64_t id = 0;
        Lens lens;
        if (line.empty() || line[0] == '#')
            continue;
        words >> id >> model >> lens.width >> lens.height;
        const LensModel* const found =
            std::ranges::find_if(kModels, [&](const LensModel& known) { return model == known.name; });
        if (!words || found == std::end(kModels))
            parser.fail("a camera that starts with \"" + line.substr(0, 40) + "\"",
                        "its number, model, width and height");
        lens.model = found;
        for (size_t i = 0; i < found->values; ++i)
            words >> lens.values[i];
        if (!words)
            parser.fail("a camera with too few values: \"" + line.substr(0, 40) + "\"",
                        formatString("%zu for %s", found->values, found->name));
        parser.addLens(id, lens);
    }
    lines = std::istringstream{std::string(images)};
    for (std::string line; std::getline(lines, line);) {
        if (line.empty() || line[0] == '#')
            continue;
        std::istringstream words(line);
        int64_t id = 0;
        Pose pose{};
        words >> id;
        for (double& q : pose.rotation)
            words >> q;
        for (double& t : pose.translation)
            words >> t;
        words >> pose.camera >> std::ws;
        if (!words || !std::getline(words, pose.name) || pose.name.empty())
            parser.fail("an image that starts with \"" + line.substr(0, 40) + "\"",
                        "its number, quaternion, translation, camera and name");
        parser.addPose(pose);
        std::getline(lines, line); // its points, or an empty line
    }
}

// Little-endian values one after the other.
class Bytes {
public:
    Bytes(std::string_view data, const Parser& parser) : m_data(data), m_parser(parser) {}

    template <typename T>
    T take()
    {
        T value{};
        std::memcpy(&value, need(sizeof(T)), sizeof(T));
        return value;
    }
    std::string takeName()
    {
        const size_t end = m_data.find('\0');
        if (end == std::string_view::npos)
            m_parser.fail("a name without end", "a zero behind it");
        std::string name(m_data.substr(0, end));
        m_data.remove_prefix(end + 1);
        return name;
    }
    // `count` records of `each` bytes.
    void skip(uint64_t count, size_t each)
    {
        if (count > m_data.size() / each)
            m_parser.fail(formatString("%llu points of an image in %zu bytes", static_cast<unsigned long long>(count),
                                       m_data.size()),
                          "as many as the file holds");
        (void)need(size_t(count) * each);
    }

private:
    const char* need(size_t bytes)
    {
        if (bytes > m_data.size())
            m_parser.fail("the end of the file too early", "whole records");
        const char* const at = m_data.data();
        m_data.remove_prefix(bytes);
        return at;
    }

    std::string_view m_data;
    const Parser& m_parser;
};

void parseBinary(std::string_view cameras, std::string_view images, Parser& parser)
{
    Bytes lenses(cameras, parser);
    for (auto count = lenses.take<uint64_t>(); count > 0; --count) {
        const auto id = lenses.take<int32_t>(), model = lenses.take<int32_t>();
        if (model < 0 || size_t(model) >= std::size(kModels))
            parser.fail(formatString("camera %d of model %d", id, model),
                        formatString("a model from 0 to %zu", std::size(kModels) - 1));
        Lens lens;
        lens.model = kModels + model;
        lens.width = double(lenses.take<uint64_t>());
        lens.height = double(lenses.take<uint64_t>());
        for (size_t i = 0; i < lens.model->values; ++i)
            lens.values[i] = lenses.take<double>();
        parser.addLens(id, lens);
    }
    Bytes poses(images, parser);
    for (auto count = poses.take<uint64_t>(); count > 0; --count) {
        (void)poses.take<uint32_t>();
        Pose pose{};
        for (double& q : pose.rotation)
            q = poses.take<double>();
        for (double& t : pose.translation)
            t = poses.take<double>();
        pose.camera = int32_t(poses.take<uint32_t>());
        pose.name = poses.takeName();
        poses.skip(poses.take<uint64_t>(), 24);
        parser.addPose(pose);
    }
}

bool hasImages(const fs::path& folder, const char* ending)
{
    std::error_code ignored;
    return fs::is_regular_file(folder / (std::string("images") + ending), ignored);
}

} // namespace

bool isColmapModel(const std::string& path)
{
    std::error_code ignored;
    if (fs::is_directory(path, ignored))
        return hasImages(path, ".bin") || hasImages(path, ".txt");
    const std::string name = fs::path(path).filename().string();
    return name == "images.bin" || name == "images.txt";
}

std::vector<Camera> readColmapCameras(const std::string& path, std::vector<std::string>* ignored)
{
    std::error_code none;
    const bool folder = fs::is_directory(path, none);
    const fs::path in = folder ? fs::path(path) : fs::path(path).parent_path();
    const bool binary = folder ? hasImages(in, ".bin") : fs::path(path).extension() == ".bin";
    const std::string ending = binary ? ".bin" : ".txt";
    const auto read = [&](const char* name) {
        return readInputText((in / (name + ending)).string(), kMaxModelBytes, "a file of a COLMAP model");
    };
    return parseColmapCameras(read("cameras"), read("images"), binary, path, ignored);
}

std::vector<Camera> parseColmapCameras(std::string_view cameras, std::string_view images, bool binary,
                                       const std::string& name, std::vector<std::string>* ignored)
{
    Parser parser(name, ignored);
    (binary ? parseBinary : parseText)(cameras, images, parser);
    return parser.finish();
}

} // namespace gsc
