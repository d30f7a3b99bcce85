// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/colmap_cameras.h"

#include <gsc/error.h>
#include <gsc/file/read_file.h>
#include "runtime/cameras/colmap_model.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>

namespace gsc {

namespace fs = std::filesystem;

namespace {

constexpr uint64_t kMaxModelBytes = uint64_t(8) << 30; // images.bin also lists the points of every image

// Little-endian values one after the other.
class Bytes {
public:
    Bytes(std::string_view data, const ColmapModel& model) : m_data(data), m_model(model) {}

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
            m_model.fail("a name without end", "a zero behind it");
        std::string name(m_data.substr(0, end));
        m_data.remove_prefix(end + 1);
        return name;
    }
    // `count` records of `each` bytes.
    void skip(uint64_t count, size_t each)
    {
        if (count > m_data.size() / each)
            m_model.fail(formatString("%llu points of an image in %zu bytes", static_cast<unsigned long long>(count),
                                      m_data.size()),
                         "as many as the file holds");
        (void)need(size_t(count) * each);
    }

    void warnOfRest(const char* file) const
    {
        if (!m_data.empty())
            m_model.how().warn(formatString("%s: %s has %zu bytes behind its last record, which are not read",
                                            m_model.name().c_str(), file, m_data.size()));
    }

private:
    const char* need(size_t bytes)
    {
        if (bytes > m_data.size())
            m_model.fail("the end of the file too early", "whole records");
        const char* const at = m_data.data();
        m_data.remove_prefix(bytes);
        return at;
    }

    std::string_view m_data;
    const ColmapModel& m_model;
};

void parseColmapBinary(std::string_view cameras, std::string_view images, ColmapModel& model)
{
    Bytes lenses(cameras, model);
    for (auto count = lenses.take<uint64_t>(); count > 0; --count) {
        const auto id = lenses.take<int32_t>(), number = lenses.take<int32_t>();
        if (number < 0)
            model.fail(formatString("camera %d of model %d", id, number),
                       formatString("a model from 0 to %zu", lensModels().size() - 1));
        if (size_t(number) >= lensModels().size()) // how many values follow is not known, so nothing behind it is
            model.refuseUnknown(formatString("camera %d", id), std::to_string(number));
        ColmapLens lens;
        lens.model = &lensModels()[size_t(number)];
        lens.width = double(lenses.take<uint64_t>());
        lens.height = double(lenses.take<uint64_t>());
        for (size_t i = 0; i < lens.model->values; ++i)
            lens.values[i] = lenses.take<double>();
        model.addLens(id, lens);
    }
    lenses.warnOfRest("cameras.bin");
    Bytes poses(images, model);
    for (auto count = poses.take<uint64_t>(); count > 0; --count) {
        ColmapPose pose{};
        pose.image = poses.take<uint32_t>();
        for (double& q : pose.rotation)
            q = poses.take<double>();
        for (double& t : pose.translation)
            t = poses.take<double>();
        pose.camera = int32_t(poses.take<uint32_t>());
        pose.name = poses.takeName();
        poses.skip(poses.take<uint64_t>(), 24);
        model.addPose(pose);
    }
    poses.warnOfRest("images.bin");
}

bool hasFile(const fs::path& folder, const std::string& name)
{
    std::error_code none;
    return fs::is_regular_file(folder / name, none);
}

bool hasBoth(const fs::path& folder, const std::string& ending)
{
    return hasFile(folder, "cameras" + ending) && hasFile(folder, "images" + ending);
}

std::vector<Camera> readForm(const fs::path& folder, bool binary, const std::string& name, const CameraReading& how)
{
    const auto read = [&](const char* file) {
        return readInputText((folder / (file + std::string(binary ? ".bin" : ".txt"))).string(), kMaxModelBytes,
                             "a file of a COLMAP model");
    };
    return parseColmapCameras(read("cameras"), read("images"), binary, name, how);
}

// To the digits that a text file may have been printed with.
bool sameCameras(const std::vector<Camera>& a, const std::vector<Camera>& b)
{
    const auto near = [](double x, double y) { return std::abs(x - y) <= 1e-4 * std::max(1.0, std::abs(x)); };
    return std::ranges::equal(a, b, [&](const Camera& x, const Camera& y) {
        return x.name == y.name && x.width == y.width && x.height == y.height && near(x.fov_x, y.fov_x) &&
               near(x.fov_y, y.fov_y) && near(x.tan_mid_x, y.tan_mid_x) && near(x.tan_mid_y, y.tan_mid_y) &&
               std::ranges::equal(x.rotation, y.rotation, near) &&
               std::ranges::equal(x.translation, y.translation, near);
    });
}

// A folder may hold the model in both forms, one of them from before it was changed.
void compareForms(const fs::path& folder, const std::vector<Camera>& binary, const std::string& name,
                  const CameraReading& how)
{
    CameraReading quiet = how;
    quiet.warnings = nullptr;
    std::string what = "differ from";
    try {
        if (sameCameras(binary, readForm(folder, false, name, quiet)))
            return;
    } catch (const Error&) {
        what = "cannot be read beside";
    }
    how.warn(
        formatString("%s: cameras.txt and images.txt %s cameras.bin and images.bin; the binary files are taken, pass "
                     "the path of images.txt for the others",
                     name.c_str(), what.c_str()));
}

} // namespace

bool isColmapModel(const std::string& path)
{
    std::error_code ignored;
    if (fs::is_directory(path, ignored))
        return hasFile(path, "images.bin") || hasFile(path, "images.txt");
    const std::string name = fs::path(path).filename().string();
    return name == "images.bin" || name == "images.txt" || name == "cameras.bin" || name == "cameras.txt";
}

std::vector<Camera> readColmapCameras(const std::string& path, const CameraReading& how)
{
    std::error_code none;
    if (!fs::is_directory(path, none))
        return readForm(fs::path(path).parent_path(), fs::path(path).extension() == ".bin", path, how);
    const bool text = hasBoth(path, ".txt"), binary = hasBoth(path, ".bin") || (!text && hasFile(path, "images.bin"));
    const std::vector<Camera> cameras = readForm(path, binary, path, how);
    if (binary && text)
        compareForms(path, cameras, path, how);
    return cameras;
}

std::vector<Camera> parseColmapCameras(std::string_view cameras, std::string_view images, bool binary,
                                       const std::string& name, const CameraReading& how)
{
    ColmapModel model(name, how);
    (binary ? parseColmapBinary : parseColmapText)(cameras, images, model);
    return model.finish();
}

} // namespace gsc
