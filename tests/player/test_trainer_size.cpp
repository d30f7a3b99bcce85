// SPDX-License-Identifier: Apache-2.0
#include "player/cameras/camera_file.h"
#include "player/cameras/trainer_size.h"

#include <doctest/doctest.h>

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

using namespace gsc;
namespace fs = std::filesystem;

namespace {

struct Said {
    std::optional<TrainerResolution> resolution;
    std::vector<std::string> told;
};

Said settings(const std::string& text)
{
    Said said;
    CameraReading how;
    how.warnings = &said.told;
    said.resolution = trainerResolutionOf(text, "cfg_args", how);
    return said;
}

} // namespace

TEST_CASE("sizes of a trainer's pictures for every kind of -r")
{
    struct Case {
        uint32_t width, height;
        TrainerResolution resolution;
        uint32_t expected_width, expected_height;
    };
    for (const Case& c : {Case{400, 300, {4, 1}, 100, 75},
                          {3200, 1801, {1, 1}, 3200, 1801},
                          {3200, 1801, {-1, 1}, 1600, 900},
                          {1600, 901, {-1, 1}, 1600, 901},
                          {401, 303, {2, 1}, 200, 152},
                          {403, 301, {2, 1}, 202, 150},
                          {405, 301, {8, 1}, 51, 38},
                          {1000, 747, {640, 1}, 640, 478},
                          {640, 480, {1280, 1}, 1280, 960},
                          {400, 300, {2, 2}, 100, 75},
                          {400, 300, {-1, 2}, 200, 150},
                          {3, 2, {8, 1}, 1, 1}}) {
        CAPTURE(c.resolution.divisor);
        CAPTURE(c.width);
        const ImageSize size = trainerSize(c.width, c.height, c.resolution);
        CHECK(size.width == c.expected_width); // round(x.5) is the even one, as in Python
        CHECK(size.height == c.expected_height);
    }
}

TEST_CASE("the resolution that a cfg_args states")
{
    CHECK(settings("Namespace(images='images', resolution=4, eval=True)").resolution->divisor == 4);
    CHECK(settings("Namespace(resolution=-1)").resolution->isDefault());
    CHECK(settings("Namespace(resolution = 4)").resolution.has_value() == false);
    CHECK(settings("\xef\xbb\xbfNamespace(resolution=2.0, resolution_scales=[1.0])").resolution->divisor == 2);
    CHECK(settings("Namespace(model_path='a, resolution=8', resolution=2)").resolution->divisor == 2);
    CHECK(settings("Namespace(a=\"it's\", b='x\\', resolution=8', resolution=2)").resolution->divisor == 2);
    CHECK_FALSE(settings("Namespace(train_resolution=4)").resolution.has_value());
    CHECK_FALSE(settings("Namespace(resolution=None)").resolution.has_value());
    CHECK_FALSE(settings("").resolution.has_value());
    const Said scales = settings("Namespace(resolution=2, resolution_scales=[2.0, 4.0])");
    CHECK(scales.resolution->scale == 2);
    CHECK(scales.told.size() == 1);
    for (const char* text : {"Namespace(resolution=0)", "Namespace(resolution=-2)", "Namespace(resolution=1e9)",
                             "Namespace(resolution=2, resolution_scales=[0])"}) {
        const Said odd = settings(text);
        CHECK(odd.resolution->isDefault());
        REQUIRE(odd.told.size() == 1);
        CHECK(odd.told[0].find("resolution") != std::string::npos);
    }
    CHECK(settings("Namespace(images='images_4', resolution=1)").told.size() == 1);
    CHECK(settings("Namespace(images='my_images', resolution=1)").told.empty());
}

TEST_CASE("a cameras.json is drawn as large as the settings beside it say")
{
    const fs::path folder = fs::temp_directory_path() / ("gsc_test_trainer_size_" + std::to_string(::getpid()));
    fs::create_directories(folder);
    std::ofstream(folder / "cameras.json")
        << R"([{"id": 0, "img_name": "a", "width": 3200, "height": 1801, "position": [1, 2, 3],
               "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 1600, "fy": 900.5}])";
    const auto size = [&](const fs::path& path) {
        const Camera camera = readCameraFile(path.string())[0];
        CHECK(std::tan(camera.fov_x / 2) == doctest::Approx(1)); // of the photograph, whatever its size
        CHECK(std::tan(camera.fov_y / 2) == doctest::Approx(1));
        return std::pair(camera.width, camera.height);
    };
    CHECK(size(folder / "cameras.json") == std::pair(1600u, 900u));
    std::ofstream(folder / "config.yaml") << "model_params:\n  images: images\n  resolution: 2\n";
    CHECK(size(folder / "cameras.json") == std::pair(1600u, 900u));
    for (const auto& [r, width, height] : {std::tuple("1", 3200u, 1801u),
                                           {"4", 800u, 450u},
                                           {"8", 400u, 225u},
                                           {"-1", 1600u, 900u},
                                           {"1000", 1000u, 562u}}) {
        std::ofstream(folder / "cfg_args") << "Namespace(resolution=" << r << ")";
        CHECK(size(folder / "cameras.json") == std::pair(width, height));
    }
    fs::remove(folder / "cfg_args");
    std::ofstream(folder / "config.yaml") << "model_params:\n  resolution: 8\n";
    CHECK(size(folder / "cameras.json") == std::pair(400u, 225u));
    fs::remove_all(folder);
}
