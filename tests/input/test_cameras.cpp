// SPDX-License-Identifier: Apache-2.0
#include "convert/input/checkpoint_cameras.h"
#include "tests/input/model_fixture.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <algorithm>

using namespace gsc;
using namespace gsc::test;

namespace {

// As upstream lists them: the held-out images of a sorted set first, then the others.
std::vector<SourceCamera> cameraList(size_t count, size_t every)
{
    std::vector<SourceCamera> cameras;
    for (const bool test : {true, false})
        for (size_t i = 0; i < count; ++i)
            if ((every != 0 && i % every == 0) == test) {
                SourceCamera camera;
                camera.name = "img_" + std::to_string(100 + i);
                camera.id = int(cameras.size());
                cameras.push_back(camera);
            }
    return cameras;
}

size_t heldOut(const std::vector<SourceCamera>& cameras)
{
    size_t count = 0;
    for (const SourceCamera& camera : cameras)
        count += camera.is_test;
    return count;
}

std::string camerasJson(size_t count)
{
    std::string json = "[";
    for (size_t i = 0; i < count; ++i)
        json += std::string(i ? ", " : "") + "{\"id\": " + std::to_string(i) + ", \"img_name\": \"img_" +
                std::to_string(100 + i) +
                "\", \"width\": 640, \"height\": 480, \"position\": [1.5, 2, 3], \"rotation\": [[0, -1, 0], [1, 0, "
                "0], [0, 0, 1]], \"fy\": 500.25, \"fx\": 501.5}";
    return json + "]";
}

} // namespace

TEST_CASE("cameras, traps 23 and 24: ids run test-first and are not embedding rows")
{
    std::vector<SourceCamera> cameras = cameraList(20, 8); // 3 test, 17 train
    std::vector<std::string> warnings;
    assignSplit(cameras, 17, 1, 0, warnings);
    CHECK(warnings.empty());
    CHECK(heldOut(cameras) == 3);
    CHECK(cameras[0].is_test);
    CHECK(cameras[2].appearance == 2); // the training camera with the same ordinal
    CHECK_FALSE(cameras[3].is_test);
    CHECK(cameras[3].appearance == 0);
    CHECK(cameras[19].appearance == 16);
}

TEST_CASE("cameras, trap 24: a test list longer than the embedding has no row left")
{
    std::vector<SourceCamera> cameras = cameraList(10, 0);
    std::vector<std::string> warnings;
    assignSplit(cameras, 3, 1, 0, warnings); // 7 test, 3 train
    CHECK(cameras[2].appearance == 2);
    CHECK(cameras[3].appearance == -1);
    CHECK(cameras[7].appearance == 0);
}

TEST_CASE("cameras: without an embedding, eval and the order of the list decide")
{
    std::vector<std::string> warnings;
    std::vector<SourceCamera> cameras = cameraList(20, 8);
    assignSplit(cameras, 0, 1, 0, warnings);
    CHECK(heldOut(cameras) == 3);
    CHECK(cameras[0].appearance == -1);

    cameras = cameraList(20, 8);
    assignSplit(cameras, 0, 0, 0, warnings); // eval=False: everything was trained on
    CHECK(heldOut(cameras) == 0);
    CHECK(warnings.empty());

    cameras = cameraList(20, 8);
    assignSplit(cameras, 0, -1, 0, warnings); // no cfg_args
    CHECK(heldOut(cameras) == 0);
    REQUIRE(warnings.size() == 1);
    CHECK(warnings[0].find("no settings state 'eval'") != std::string::npos); // a config.yaml may be there

    cameras = cameraList(20, 0); // eval=True, but the list is not split by 8
    assignSplit(cameras, 0, 1, 0, warnings);
    CHECK(heldOut(cameras) == 0);

    // Scaffold-GS --lod n: below 50 the first n + 1 are test, from 50 on the first n + 1 are train
    cameras = cameraList(20, 0);
    assignSplit(cameras, 0, 1, 4, warnings);
    CHECK(heldOut(cameras) == 5);
}

TEST_CASE("cameras: lists that contradict the model are reported, not guessed")
{
    std::vector<std::string> warnings;
    std::vector<SourceCamera> cameras = cameraList(5, 0);
    assignSplit(cameras, 6, 1, 0, warnings);
    CHECK(warnings.size() == 1);
    CHECK(cameras[0].appearance == -1);
    cameras = cameraList(5, 0);
    cameras[3].id = 9;
    assignSplit(cameras, 5, 1, 0, warnings);
    CHECK(warnings.size() == 2);
    CHECK(cameras[0].appearance == -1);
}

TEST_CASE("cameras.json: beside the model, else in --scene-dir, else a warning")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.widths.appearance_rows = 4;
    spec.widths.appearance_columns = 2;
    writeModel(folder.path() / "model", spec);
    writeFile(folder.path() / "scene" / "cameras.json", camerasJson(6));
    const std::string model = (folder.path() / "model").string();

    const Checkpoint none = readCheckpoint(model, {});
    CHECK(none.cameras.empty());
    CHECK(none.warnings.back().find("--scene-dir") != std::string::npos);

    CheckpointOptions options;
    options.scene_dir = (folder.path() / "scene").string();
    const Checkpoint scene = readCheckpoint(model, options);
    REQUIRE(scene.cameras.size() == 6);
    const SourceCamera& camera = scene.cameras[3];
    CHECK(camera.name == "img_103");
    CHECK(camera.width == 640);
    CHECK(camera.height == 480);
    CHECK(camera.fx == 501.5);
    CHECK(camera.fy == 500.25);
    CHECK(camera.position[0] == 1.5);
    CHECK(camera.rotation[1] == -1); // row-major, camera-to-world
    CHECK(camera.appearance == 1);
    CHECK(heldOut(scene.cameras) == 2);

    writeFile(folder.path() / "model" / "cameras.json", camerasJson(5));
    CHECK(readCheckpoint(model, options).cameras.size() == 5);
    writeFile(folder.path() / "model" / "cameras.json", std::string("[{]"));
    CHECK(outcomeOf([&] { (void)readCheckpoint(model, options); }).code == ErrorCode::InvalidFile);
}

TEST_CASE("lenses that a file cannot hold are kept as centred pinholes, and told")
{
    const TemporaryFolder folder;
    writeModel(folder.path(), {});
    const auto transforms = [](const char* keys) {
        return formatString("{\"fl_x\": 500, \"w\": 600, \"h\": 400, %s \"frames\": [{\"file_path\": \"r_0\", "
                            "\"transform_matrix\": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]}",
                            keys);
    };
    const auto warningsOf = [&](const char* keys) {
        writeFile(folder.path() / "transforms.json", transforms(keys));
        const Checkpoint checkpoint = readCheckpoint(folder.path().string(), {});
        REQUIRE(checkpoint.cameras.size() == 1);
        CHECK(checkpoint.cameras[0].fx == doctest::Approx(500));
        CHECK(checkpoint.cameras[0].width == 600);
        std::vector<std::string> told;
        for (const std::string& warning : checkpoint.warnings)
            if (warning.find("ignored") != std::string::npos)
                told.push_back(warning);
        return told;
    };
    CHECK(warningsOf("").empty());
    CHECK(warningsOf("\"k1\": 0, \"cx\": 300, \"cy\": 200,").empty());
    std::vector<std::string> told = warningsOf("\"k1\": 0.5, \"camera_model\": \"OPENCV_FISHEYE\",");
    REQUIRE(told.size() == 1);
    CHECK(told[0].find("transforms.json: lens distortion of 1 of 1 camera is ignored (the first says \"camera_model\" "
                       "is \"OPENCV_FISHEYE\", \"k1\" is 0.5); a .gsc stores pinholes") != std::string::npos);
    told = warningsOf("\"cx\": 310,");
    REQUIRE(told.size() == 1);
    CHECK(told[0].find("transforms.json: cx, cy of 1 of 1 camera ") != std::string::npos);

    writeFile(folder.path() / "cameras.json",
              std::string("[{\"id\": 0, \"img_name\": \"a\", \"width\": 600, \"height\": 400, \"k2\": 1, \"cx\": 1, "
                          "\"position\": [1, 2, 3], \"fx\": 500, \"fy\": 500, \"rotation\": [[1, 0, 0], [0, 1, 0], "
                          "[0, 0, 1]]}]"));
    CHECK(warningsOf("").size() == 2);
}

TEST_CASE("transforms: used where there is no cameras.json, left out with a warning where they do not fit")
{
    const TemporaryFolder folder;
    ModelSpec spec;
    spec.widths.appearance_rows = 2;
    spec.widths.appearance_columns = 2;
    writeModel(folder.path(), spec);
    const auto frames = [](int count, const char* size, double scale) {
        std::string json = formatString("{\"camera_angle_x\": 1.2870022175866, %s\"frames\": [", size);
        for (int i = 0; i < count; ++i)
            json +=
                formatString("%s{\"file_path\": \"train/r_%d\", \"transform_matrix\": [[%g, 0, 0, %d], [0, 0, %g, 5], "
                             "[0, %g, 0, 7], [0, 0, 0, 1]]}",
                             i ? ", " : "", i, scale, i, -scale, scale);
        return json + "]}";
    };
    const char* size = "\"w\": 600, \"h\": 400, ";
    writeFile(folder.path() / "transforms_train.json", frames(2, size, 1));
    writeFile(folder.path() / "transforms_test.json", frames(1, size, 1));
    const Checkpoint checkpoint = readCheckpoint(folder.path().string(), {});
    REQUIRE(checkpoint.cameras.size() == 3);
    CHECK(heldOut(checkpoint.cameras) == 1);
    CHECK(checkpoint.cameras[0].is_test);
    CHECK(checkpoint.cameras[2].appearance == 1);
    const SourceCamera& camera = checkpoint.cameras[2];
    const double position[3] = {1, 5, 7};
    for (int i = 0; i < 3; ++i)
        CHECK(camera.position[i] == doctest::Approx(position[i]));
    CHECK(camera.fx == doctest::Approx(400).epsilon(1e-6)); // 600 / (2 tan(half of 1.287)), tan = 3 / 4
    CHECK(camera.fy == doctest::Approx(camera.fx));
    CHECK(camera.rotation[3 + 2] == doctest::Approx(1)); // looks along +y, as OpenGL's -z column says

    const auto told = [&](const char* part) {
        const Checkpoint read = readCheckpoint(folder.path().string(), {});
        return std::ranges::count_if(read.warnings,
                                     [&](const auto& text) { return text.find(part) != std::string::npos; });
    };
    writeFile(folder.path() / "transforms_train.json", frames(2, "\"w\": 600, \"h\": 400, \"applied_scale\": 2, ", 1));
    CHECK(told("else keep; gsc convert has no such option") == 1); // has no such option
    writeFile(folder.path() / "transforms_train.json", frames(2, "\"w\": 600, \"h\": 400, \"latlong\": true, ", 1));
    CHECK(told("key \"latlong\" is true, expected a pinhole") == 1);
    CHECK(readCheckpoint(folder.path().string(), {}).cameras.empty());

    for (const std::string& json : {frames(2, "", 1), frames(2, size, 3), std::string("{\"frames\": 3}")}) {
        writeFile(folder.path() / "transforms_train.json", json);
        const Checkpoint without = readCheckpoint(folder.path().string(), {});
        CHECK(without.cameras.empty());
        CHECK(without.warnings.size() == 2);
    }
}

TEST_CASE("stored cameras are as large as the trainer's pictures (cfg_args resolution)")
{
    const TemporaryFolder folder;
    writeModel(folder.path(), {});
    writeFile(folder.path() / "cameras.json", camerasJson(2)); // 640 x 480, focal lengths 501.5 and 500.25
    struct Case {
        const char* settings;
        uint32_t width, height;
        size_t told;
    };
    for (const Case& c : {Case{"resolution=-1", 640, 480, 0},
                          {"resolution=1", 640, 480, 0},
                          {"resolution=2", 320, 240, 0},
                          {"resolution=4", 160, 120, 0},
                          {"resolution=8", 80, 60, 0},
                          {"resolution=300", 300, 225, 0},
                          {"resolution=1280", 1280, 960, 0},
                          {"resolution=3200", 3200, 2400, 1},
                          {"resolution=None", 640, 480, 0},
                          {"resolution=0", 640, 480, 1},
                          {"images='images_4', resolution=1", 640, 480, 1},
                          {"images='images_2024', resolution=1", 640, 480, 0},
                          {"resolution = 4", 160, 120, 0},
                          {"**{'resolution': (4)}", 160, 120, 0},
                          {"resolution=2, resolution_scales=[1.0, 2.0]", 320, 240, 1}}) {
        CAPTURE(c.settings);
        writeFile(
            folder.path() / "cfg_args",
            formatString("Namespace(voxel_size=0.25, eval=False, fork=2, dist2level='round', add_level=False, %s)",
                         c.settings));
        const Checkpoint checkpoint = readCheckpoint(folder.path().string(), {});
        REQUIRE(checkpoint.cameras.size() == 2);
        const SourceCamera& camera = checkpoint.cameras[1];
        CHECK(camera.width == c.width);
        CHECK(camera.height == c.height);
        CHECK(camera.fx / camera.width == doctest::Approx(501.5 / 640)); // angles stay
        CHECK(camera.fy / camera.height == doctest::Approx(500.25 / 480));
        size_t told = 0;
        for (const std::string& warning : checkpoint.warnings)
            told += warning.find("cfg_args: ") != std::string::npos;
        CHECK(told == c.told);
    }
    for (const char* settings : {"resolution=2*2", "resolution='4'", "resolution=[4]"}) { // never guessed
        CAPTURE(settings);
        writeFile(folder.path() / "cfg_args",
                  formatString("Namespace(voxel_size=0.25, eval=False, fork=2, dist2level='round', %s)", settings));
        const Outcome refused = outcomeOf([&] { (void)readCheckpoint(folder.path().string(), {}); });
        CHECK(refused.code == ErrorCode::Unsupported);
        CHECK(refused.says("'resolution'"));
    }
}
