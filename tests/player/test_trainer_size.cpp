// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/trainer_cameras.h"

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

const std::string kCamera = R"([{"id": 0, "img_name": "a", "width": 3200, "height": 1801, "position": [1, 2, 3],
    "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], "fx": 1600, "fy": 900.5}])";

// A cameras.json alone, gone with the test.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("gsc_test_trainer_size_" + std::to_string(::getpid()));
    Folder()
    {
        fs::create_directories(path);
        std::ofstream(path / "cameras.json") << kCamera;
    }
    ~Folder() { fs::remove_all(path); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    // With such settings beside it.
    [[nodiscard]] std::vector<std::string> told(const char* name, const std::string& settings) const
    {
        std::ofstream(path / name) << settings;
        std::vector<std::string> said;
        const Camera camera =
            readCameraFile((path / "cameras.json").string(), nullptr, {false, CamerasTransform::Told, &said})[0];
        CHECK(camera.width == 1600); // whatever they say
        CHECK(camera.height == 900);
        CHECK(std::tan(camera.fov_x / 2) == doctest::Approx(1)); // angle of the photograph, whatever its size
        CHECK(std::tan(camera.fov_y / 2) == doctest::Approx(1));
        fs::remove(path / name);
        return said;
    }
};

} // namespace

TEST_CASE("sizes of a trainer's pictures for every kind of -r")
{
    struct Case {
        uint32_t width, height;
        double resolution;
        uint32_t expected_width, expected_height;
    };
    for (const Case& c : {Case{400, 300, 4, 100, 75},
                          {3200, 1801, 1, 3200, 1801},
                          {3200, 1801, -1, 1600, 900},
                          {1600, 901, -1, 1600, 901},
                          {401, 303, 2, 200, 152},
                          {403, 301, 2, 202, 150},
                          {405, 301, 8, 51, 38},
                          {1000, 747, 640, 640, 478},
                          {640, 480, 1280, 1280, 960},
                          {3, 2, 8, 1, 1}}) {
        CAPTURE(c.resolution);
        CAPTURE(c.width);
        const TrainedSize size = trainerSize(c.width, c.height, c.resolution);
        CHECK(size.width == c.expected_width); // round(x.5) is the even one, as in Python
        CHECK(size.height == c.expected_height);
    }
}

TEST_CASE("a resolution that no trainer takes is told")
{
    for (const double odd : {0.0, -2.0, 0.5, 1e9}) {
        std::vector<std::string> said;
        CHECK(checkedResolution(odd, "cfg_args", {false, CamerasTransform::Told, &said}) == -1);
        REQUIRE(said.size() == 1);
        CHECK(said[0].find(formatString("resolution is %g,", odd)) != std::string::npos);
    }
}

TEST_CASE("settings beside a cameras.json are not applied, and told where they may state a size")
{
    const Folder folder;
    for (const char* text :
         {"Namespace(resolution=4)", "Namespace(resolution = 4)", "Namespace(\nresolution=4)",
          "Namespace(\tresolution=4)", "Namespace(resolution=(4))", "Namespace(**{'resolution': 4})",
          "Namespace(a=1, # it's\nresolution=4)", "Namespace(resolution=1_00)", "Namespace(resolution=-1.5)",
          "Namespace(resolution=-1*2)", "Namespace(resolution=-1, resolution=8)", "Namespace(resolution=None)",
          "Namespace(resolution=", "resolution"}) {
        CAPTURE(text);
        const auto said = folder.told("cfg_args", text);
        REQUIRE(said.size() == 1);
        CHECK(said[0].find("cfg_args: its resolution is not applied") != std::string::npos);
        CHECK(said[0].find("--cameras stored") != std::string::npos);
    }
    for (const char* text :
         {"model_params:\n  resolution : 4\n", "model_params:\n  \"resolution\": 4\n",
          "model_params: {resolution: 4}\n", "model_params:\n  resolution: &r 4\n", "model_params:\n  resolution:\t4\n",
          "model_params:\n  resolution: -1\nviewer:\n  resolution: 2\n"}) {
        CAPTURE(text);
        CHECK(folder.told("config.yaml", text).size() == 1);
    }
    CHECK(folder.told("config.yaml", "resolution: -1\n" + std::string(1u << 20, ' ')).size() == 1); // not read
    for (const char* text :
         {"Namespace(resolution=-1, eval=True)", "Namespace(resolution = -1)", "Namespace(eval=True)",
          "Namespace(train_resolution=4, resolution_scales=[1.0])", "", "model_params:\n  resolution: -1\n",
          "{\"resolution\": -1}", "Namespace(images='images', source_path='my_images')",
          "Namespace(images='images_2024')", "Namespace(images='images_1')"}) {
        CAPTURE(text);
        CHECK(folder.told("cfg_args", text).empty());
        CHECK(folder.told("config.yaml", text).empty());
    }
    const auto images = folder.told("cfg_args", "Namespace(images='images_4', resolution=-1)");
    REQUIRE(images.size() == 1);
    CHECK(images[0].find("images is 'images_4', which may be photographs 1/4") != std::string::npos);
}
