// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/trainer_cameras.h"
#include "tests/player/golden_cameras.h"
#include "tests/support/checkpoints.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <fstream>
#include <initializer_list>
#include <iterator>
#include <numbers>
#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::string kUpstream = R"([{"id": 3, "img_name": "a", "width": 3200, "height": 1801, "position": [1, 2, 3],
    "rotation": [[0, 0, 1], [1, 0, 0], [0, 1, 0]], "fx": 1600, "fy": 900.5}])";
const std::string kTrajectory = R"({"schema": "gsc.trajectory/1", "name": "t", "fps": 30, "frames": [
    {"name": "a", "width": 20, "height": 10, "fx": 10, "fy": 5, "position": [1, 2, 3], "appearance": 4, "time": 0.5,
     "rotation": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]},
    {"fov_x": 1.5, "translation": [1, 2, 3], "rotation": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]})";
const std::string kTransforms = R"({"camera_angle_x": 1.0, "w": 800, "h": 400, "aabb": [NaN, Infinity, -Infinity],
    "frames": [{"file_path": "./train/r_0.extra.png",
    "transform_matrix": [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]}]})";

// The message of the Error(InvalidFile) that parsing must throw; empty if it throws none.
std::string refusal(const std::string& json)
{
    const Outcome refused = outcomeOf([&] { (void)parseCameraFile(json, "f.json"); });
    CHECK(refused.code == (refused.message.empty() ? ErrorCode::Ok : ErrorCode::InvalidFile));
    return refused.message;
}

// `text` with its first `from` replaced.
std::string with(std::string text, const std::string& from, const std::string& to)
{
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

} // namespace

TEST_CASE("T22, T23: upstream's cameras.json: camera-to-world rotation, source size, the -r -1 rule")
{
    const std::vector<SourceCamera> raw = parseUpstreamCameras(kUpstream, "f.json");
    REQUIRE(raw.size() == 1);
    CHECK(raw[0].id == 3);
    CHECK(raw[0].width == 3200);
    CHECK(raw[0].rotation[2] == 1);

    const std::vector<Camera> cameras = parseCameraFile(kUpstream, "f.json");
    REQUIRE(cameras.size() == 1);
    const Camera& camera = cameras[0];
    CHECK(camera.name == "a");
    CHECK(camera.width == 1600); // above 1600 wide: scaled, both axes truncated
    CHECK(camera.height == 900);
    CHECK(std::tan(camera.fov_x / 2) == doctest::Approx(1.0)); // angle at the source size
    CHECK(std::tan(camera.fov_y / 2) == doctest::Approx(1.0));
    CHECK(camera.appearance == -1); // the id is not the embedding row
    // t = -R^T p
    CHECK(camera.translation[0] == -2);
    CHECK(camera.translation[1] == -3);
    CHECK(camera.translation[2] == -1);

    const Camera small = cameraOf([&] {
        SourceCamera c = raw[0];
        c.width = 1600;
        c.height = 1801;
        return c;
    }());
    CHECK(small.width == 1600);
    CHECK(small.height == 1801);
}

TEST_CASE("our trajectory: positions, translations, lenses, defaults")
{
    TrajectoryFacts eyes;
    eyes.ipd = -1;
    eyes.views.resize(1);
    (void)parseCameraFile(kTrajectory, "f.json", &eyes);
    CHECK(eyes.ipd == 0); // none stated
    CHECK(eyes.views.empty());
    std::string stated = kTrajectory;
    stated.replace(stated.find("\"fps\": 30"), 9, "\"ipd\": 0.25");
    (void)parseCameraFile(stated, "f.json", &eyes);
    CHECK(eyes.ipd == 0.25);
    const std::vector<Camera> cameras = parseCameraFile(kTrajectory, "f.json");
    REQUIRE(cameras.size() == 2);
    CHECK(cameras[0].translation[0] == -2);
    CHECK(cameras[0].appearance == 4);
    CHECK(std::tan(cameras[0].fov_x / 2) == doctest::Approx(1.0));
    CHECK(std::tan(cameras[0].fov_y / 2) == doctest::Approx(1.0));
    CHECK(cameras[1].name == "0001");
    CHECK(cameras[1].translation[2] == 3);
    CHECK(cameras[1].width == 0); // --size decides
    CHECK(cameras[1].fov_x == 1.5);
}

TEST_CASE("a trajectory and nerfstudio's camera_path.json are paths, photographs are none")
{
    const std::string to_world = "[1,0,0,0,0,1,0,0,0,0,1,0,0,0,0,1]";
    for (const auto& [text, is_path] :
         std::initializer_list<std::pair<std::string, bool>>{{kTrajectory, true},
                                                             {R"({"camera_path":[{"camera_to_world":)" + to_world +
                                                                  R"(,"fov":60}],"render_width":4,"render_height":3})",
                                                              true},
                                                             {kTransforms, false},
                                                             {kUpstream, false}}) {
        CAPTURE(text);
        TrajectoryFacts facts;
        facts.is_path = !is_path;
        (void)parseCameraFile(text, "f.json", &facts);
        CHECK(facts.is_path == is_path);
    }
}

TEST_CASE("our trajectory: eyes as OpenXR describes them")
{
    const std::string eye = R"({"fov": {"left": -0.9, "right": 0.7, "up": 0.75, "down": -0.85},
        "pose": {"position": [-0.032, 0.001, 0.002], "rotation": [[0, 0, 1], [1, 0, 0], [0, 1, 0]]}})";
    const std::string one = with(kTrajectory, "\"fps\": 30", "\"views\": [" + eye + "]");
    const std::string two = with(kTrajectory, "\"fps\": 30", "\"views\": [" + eye + ", " + eye + "]");
    TrajectoryFacts eyes;
    CHECK(parseCameraFile(two, "f.json", &eyes).size() == 2);
    CHECK(eyes.views.size() == 2);
    CHECK(parseCameraFile(one, "f.json", &eyes).size() == 2);
    REQUIRE(eyes.views.size() == 1);
    const EyeView& view = eyes.views[0];
    CHECK(view.left == -0.9);
    CHECK(view.right == 0.7);
    CHECK(view.up == 0.75);
    CHECK(view.down == -0.85);
    CHECK(view.position[0] == -0.032);
    CHECK(view.position[2] == 0.002);
    CHECK(view.rotation[2] == 1);
    CHECK(eyes.ipd == 0);

    // who does not ask for the eyes must not draw the frames as if they were cameras
    const Outcome refused = outcomeOf([&] { (void)parseCameraFile(one, "f.json"); });
    CHECK(refused.code == ErrorCode::Unsupported);
    CHECK(refused.says("f.json: \"views\""));

    for (const auto& [from, to, part] : std::initializer_list<std::array<const char*, 3>>{
             {"\"left\": -0.9", "\"left\": 0.7", "more than left, which is 0.7"},
             {"\"up\": 0.75", "\"up\": -0.9", "more than down, which is -0.85"},
             {"\"right\": 0.7", "\"right\": 1.6", "within a right angle"},
             {"\"down\": -0.85", "\"dawn\": -0.85", "\"down\""},
             {"[[0, 0, 1], [1, 0, 0], [0, 1, 0]]}}", "[[0, 0, 2], [1, 0, 0], [0, 1, 0]]}}", "eye-to-head"},
             {"[-0.032, 0.001, 0.002]", "[-0.032, 0.001]", "view 0: pose"},
             {"\"fov\":", "\"fow\":", "f.json: view 0"},
             {"\"views\": [", "\"views\": [3, ", "f.json: view 0"},
             {"\"views\":", "\"ipd\": 0.06, \"views\":", "one of them"}}) {
        CAPTURE(to);
        CHECK(contains(refusal(with(one, from, to)), part));
    }
    CHECK(contains(refusal(with(kTrajectory, "\"fps\": 30", "\"views\": []")), "one or two"));
    CHECK(contains(refusal(with(two, "\"views\": [", "\"views\": [" + eye + ", ")), "one or two"));
    CHECK(contains(refusal(with(kTrajectory, "\"fps\": 30", "\"views\": {}")), "one or two"));
}

TEST_CASE("transforms.json: OpenGL axes turned, angles, sizes, NaN where nobody looks")
{
    const std::vector<Camera> cameras = parseCameraFile(kTransforms, "f.json");
    REQUIRE(cameras.size() == 1);
    const Camera& camera = cameras[0];
    CHECK(camera.name == "r_0");
    CHECK(camera.width == 800);
    CHECK(camera.fov_x == doctest::Approx(1.0));
    CHECK(std::tan(camera.fov_y / 2) == doctest::Approx(std::tan(0.5) / 2));
    // OpenGL looks along -z with y up: right stays, down and forward are turned
    CHECK(camera.rotation[0] == 1);
    CHECK(camera.rotation[4] == -1);
    CHECK(camera.rotation[8] == -1);
    CHECK(camera.translation[0] == -4);
    CHECK(camera.translation[1] == 5);
    CHECK(camera.translation[2] == 6);

    SUBCASE("a focal length per frame wins over none, a frame's angle over the file's")
    {
        const auto focal = parseCameraFile(
            with(with(kTransforms, "\"camera_angle_x\": 1.0, ", ""), "\"frames\": [{", "\"frames\": [{\"fl_x\": 400,"),
            "f.json");
        CHECK(std::tan(focal[0].fov_x / 2) == doctest::Approx(1.0));
        CHECK(std::tan(focal[0].fov_y / 2) == doctest::Approx(0.5));
        const auto angle =
            parseCameraFile(with(kTransforms, "\"frames\": [{", "\"frames\": [{\"camera_angle_x\": 0.5,"), "f.json");
        CHECK(angle[0].fov_x == doctest::Approx(0.5));
    }
    SUBCASE("without a size the command line must give one")
    {
        auto open = parseCameraFile(with(kTransforms, "\"w\": 800, \"h\": 400, ", ""), "f.json");
        CHECK(open[0].width == 0);
        CHECK_THROWS_AS(finishCamera(open[0], 0, 0, 0), Error);
        finishCamera(open[0], 100, 100, 0);
        CHECK(open[0].fov_y == doctest::Approx(1.0));
    }
    SUBCASE("a uniformly scaled matrix, as MatrixCity writes, is inverted like upstream does")
    {
        const auto scaled = parseCameraFile(with(kTransforms, "[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6]",
                                                 "[[0.01, 0, 0, 4], [0, 0.01, 0, 5], [0, 0, 0.01, 6]"),
                                            "f.json");
        CHECK(scaled[0].rotation[0] == doctest::Approx(100));
        CHECK(scaled[0].translation[0] == doctest::Approx(-400));
        CHECK(double(eyeParams(scaled[0], {}).center[1]) == doctest::Approx(5));
        Camera left, right;
        stereoPair(scaled[0], 0.5, left, right);
        CHECK(double(eyeParams(right, {}).center[0] - eyeParams(left, {}).center[0]) == doctest::Approx(0.5));
    }
}

TEST_CASE("what is wrong is refused with the entry and the key")
{
    struct Case {
        std::string json, part, part2;
    };
    const Case cases[] = {
        {with(kUpstream, "\"fx\": 1600", "\"fx\": \"wide\""), "entry 0 (a)", "\"fx\""},
        {with(kUpstream, "\"fx\": 1600,", ""), "\"fx\" is missing", "entry 0"},
        {with(kUpstream, "1600", "NaN"), "\"fx\" is not finite", ""},
        {with(kUpstream, "1600", "-5"), "\"fx\" is -5", "a number above 0"},
        {with(kUpstream, "1600", "0"), "\"fx\" is 0", "a number above 0"},
        {with(kUpstream, "1600", "1e999"), "not valid JSON", ""},
        {with(kUpstream, "1600", "1e300"), "\"fx\" is 1e+300", "at most 1e15"},
        {with(kUpstream, "1600", "1e-9"), "\"fx\" is", "focal length"},
        {with(kUpstream, "[1, 2, 3]", "[1, 2]"), "\"position\" is an array of 2", ""},
        {with(kUpstream, "[1, 2, 3]", "[1, NaN, 3]"), "\"position\"", "index 1"},
        {with(kUpstream, "[1, 2, 3]", "[1, 1e200, 3]"), "\"position\"", "index 1"},
        {with(kUpstream, "[1, 0, 0]", "[2, 0, 0]"), "\"rotation\" is no rotation", ""},
        {with(kUpstream, "[1, 0, 0]", "[-1, 0, 0]"), "determinant -1", ""},
        {with(kUpstream, "[1, 0, 0]", "[1.003, 0, 0]"), "\"rotation\" is no rotation", ""},
        {with(kTransforms, "[0, 1, 0, 5]", "[0, 1.003, 0, 5]"), "no rotation", ""},
        {with(kUpstream, "[1, 0, 0]", "[1, 0]"), "\"rotation\"", "row 1"},
        {with(kUpstream, "3200", "3200.5"), "\"width\" is 3200.5", ""},
        {with(kUpstream, "3200", "0"), "\"width\" is 0", ""},
        {with(kUpstream, "3200", "99999999999999999999"), "\"width\"", ""},
        {with(kUpstream, "\"a\"", "7"), "\"img_name\" is 7", "a string"},
        {"[7]", "entry 0: is 7", "an object"},
        {"[]", "holds no camera", ""},
        {"{}", "no camera file", "gsc.trajectory/1"},
        {"7", "expected an object", ""},
        {"", "not valid JSON", ""},
        {"[", "not valid JSON", ""},
        {"nonsense", "not valid JSON", ""},
        {with(kTrajectory, "gsc.trajectory/1", "gsc.trajectory/2"), "\"schema\" is", "newer"},
        {with(kTrajectory, "\"fps\": 30, \"frames\": [", "\"frames\": 7, \"x\": ["), "\"frames\" is", ""},
        {with(kTrajectory, "\"position\": [1, 2, 3],", ""), "none of \"position\"", "frame 0"},
        {with(kTrajectory, "\"translation\"", "\"position\": [0, 0, 0], \"translation\""), "each of", "frame 1"},
        {with(kTrajectory, "\"width\": 20, ", ""), "\"width\" is missing", "frame 0"},
        {with(kTrajectory, "\"width\": 20, \"height\": 10, ", ""), "without width and height", ""},
        {with(kTrajectory, "\"fx\": 10", "\"fx\": 10, \"fov_x\": 1"), "together with a field of view", ""},
        {with(kTrajectory, "1.5", "3.2"), "\"fov_x\" is 3.2", "radians"},
        {with(kTrajectory, "\"appearance\": 4", "\"appearance\": -4"), "\"appearance\"", ""},
        {with(kTrajectory, "\"time\": 0.5", "\"time\": []"), "\"time\"", ""},
        {with(kTransforms, "\"camera_angle_x\": 1.0, ", ""), "neither \"camera_angle_x\" nor \"fl_x\"", "frame 0"},
        {with(kTransforms, "\"file_path\"", "\"path\""), "\"file_path\" is missing", "frame 0"},
        {with(kTransforms, "[0, 0, 0, 1]", "[0, 0, 0, 0]"), "last row", ""},
        {with(kTransforms, "[0, 1, 0, 5]", "[0, 2, 0, 5]"), "no rotation", ""},
        {with(kTransforms, "\"h\": 400", "\"h\": null"), "\"h\" is null", ""},
    };
    CHECK(refusal(with(kUpstream, "[1, 2, 3]", "[1, 1e15, -1e15]")).empty());
    for (const Case& c : cases) {
        CAPTURE(c.json);
        const std::string message = refusal(c.json);
        CAPTURE(message);
        CHECK(contains(message, "f.json"));
        CHECK(contains(message, c.part));
        CHECK(contains(message, c.part2));
    }
}

TEST_CASE("nesting as deep as memory is refused, not followed")
{
    CHECK(contains(refusal(std::string(1000000, '[')), "nested deeper than"));
    std::string deep;
    for (int i = 0; i < 100000; ++i)
        deep += "{\"a\":";
    CHECK(contains(refusal(deep), "nested deeper than"));
    // brackets and NaN inside strings are only text
    const auto cameras = parseCameraFile(with(kUpstream, "\"a\"", "\"NaN[[[[\\\"\""), "f.json");
    CHECK(cameras[0].name == "NaN[[[[\"");
}

TEST_CASE("every prefix of a good file is refused")
{
    for (const std::string& text : {kUpstream, kTrajectory, kTransforms})
        for (size_t size = 0; size < text.size(); ++size) {
            // a fresh block of the exact size, so that a sanitizer sees a read past the end
            const std::string prefix(text.data(), size);
            CHECK_FALSE(refusal(prefix).empty());
        }
}

TEST_CASE("a missing file is an I/O error")
{
    const Outcome refused = outcomeOf([&] { (void)readCameraFile("no/such/file.json"); });
    CHECK(refused.code == ErrorCode::Io);
    CHECK(refused.says("no/such/file.json"));
}

TEST_CASE("a trajectory carries the golden cameras exactly, and upstream's own files are read")
{
    for (const std::string& model : test::trainedModels()) {
        CAPTURE(model);
        for (const test::GoldenCamera& golden : test::readGoldenCameras(model)) {
            const Camera& c = golden.camera;
            const double* r = c.rotation;
            const nlohmann::json frame = {{"name", c.name},
                                          {"width", c.width},
                                          {"height", c.height},
                                          {"fov_x", c.fov_x},
                                          {"fov_y", c.fov_y},
                                          {"translation", c.translation},
                                          {"rotation", {{r[0], r[1], r[2]}, {r[3], r[4], r[5]}, {r[6], r[7], r[8]}}},
                                          {"appearance", c.appearance}};
            const nlohmann::json trajectory = {{"schema", "gsc.trajectory/1"}, {"frames", {frame}}};
            const std::vector<Camera> read = parseCameraFile(trajectory.dump(), "t.json");
            REQUIRE(read.size() == 1);
            CHECK(std::memcmp(read[0].rotation, c.rotation, sizeof(c.rotation)) == 0);
            CHECK(std::memcmp(read[0].translation, c.translation, sizeof(c.translation)) == 0);
            CHECK(read[0].fov_x == c.fov_x);
            CHECK(read[0].fov_y == c.fov_y);
            CHECK(read[0].appearance == c.appearance);
            const EyeParams eye = eyeParams(read[0], {});
            CHECK(std::memcmp(eye.full_projection, golden.full_projection, sizeof(eye.full_projection)) == 0);
        }
        const std::vector<Camera> cameras = readCameraFile(model + "/cameras.json");
        CHECK(cameras.size() > 20);
        CHECK(cameras[0].name == test::readGoldenCameras(model)[0].camera.name);
        CHECK(cameras[0].fov_x == doctest::Approx(test::readGoldenCameras(model)[0].camera.fov_x));
    }
}

TEST_CASE("camera_path.json: nerfstudio's matrices and vertical angles")
{
    const std::string path = R"({"camera_type": "perspective", "render_width": 800, "render_height": 400, "fps": 24,
        "camera_path": [{"camera_to_world": [1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6, 0, 0, 0, 1], "fov": 90, "aspect": 2}]})";
    const std::vector<Camera> cameras = parseCameraFile(path, "f.json");
    REQUIRE(cameras.size() == 1);
    CHECK(cameras[0].width == 800);
    CHECK(cameras[0].height == 400);
    CHECK(std::tan(cameras[0].fov_y / 2) == doctest::Approx(1).epsilon(1e-9));
    CHECK(std::tan(cameras[0].fov_x / 2) == doctest::Approx(2).epsilon(1e-9));
    CHECK(cameras[0].rotation[4] == -1);
    CHECK(cameras[0].translation[1] == 5);
    CHECK_THROWS_AS((void)parseCameraFile(with(path, "perspective", "fisheye"), "f.json"), Error);
    CHECK(refusal(with(path, ", 0, 0, 0, 1]", "]")).find("\"camera_to_world\"") != std::string::npos);
    CHECK(refusal(with(path, "\"fov\": 90", "\"fov\": 190")).find("\"fov\"") != std::string::npos);
}
