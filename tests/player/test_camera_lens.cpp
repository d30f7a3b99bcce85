// SPDX-License-Identifier: Apache-2.0
// Principal points and lens distortion in camera files of all three kinds, and lengths with a unit.
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/length.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

// A transforms.json of two frames, 800 x 400 at 500 pixels; `file` and `frame` (the second's) are keys with a comma.
std::string transforms(const std::string& file, const std::string& frame = "")
{
    const std::string matrix = "\"transform_matrix\": [[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]";
    return "{" + file + "\"fl_x\": 500, \"fl_y\": 400, \"frames\": [{\"file_path\": \"a.png\", " + matrix +
           "}, {\"file_path\": \"b.png\", " + frame + matrix + "}]}";
}

std::string upstream(const std::string& more)
{
    return "[{\"id\": 0, \"img_name\": \"a\", " + more +
           "\"width\": 800, \"height\": 400, \"position\": [1, 2, 3], \"fx\": 500, \"fy\": 400, "
           "\"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]";
}

std::string trajectory(const std::string& file, const std::string& frame)
{
    return "{\"schema\": \"gsc.trajectory/1\", " + file + "\"frames\": [{" + frame +
           "\"fov_x\": 1, \"position\": [1, 2, 3], \"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]}]}";
}

const std::string kSize = "\"w\": 800, \"h\": 400, ";

// Options of a reading that ignores distortion and puts what it tells into `told`.
CameraReading telling(std::vector<std::string>& told)
{
    return {true, CamerasTransform::Told, &told};
}

Outcome refusal(const std::string& json, const CameraReading& how = {})
{
    return outcomeOf([&] { (void)parseCameraFile(json, "f.json", nullptr, how); });
}

bool contains(const std::string& text, const std::string& part)
{
    return text.find(part) != std::string::npos;
}

// Where the point right, down and forward of the camera lands, in pixels from the image's top left corner.
std::pair<double, double> landing(const Camera& camera, double right, double down, double forward)
{
    const EyeParams64 eye = eyeParams64(camera, {});
    double world[3] = {}, clip[4];
    for (int i = 0; i < 3; ++i) {
        const double* r = camera.rotation;
        const double* t = camera.translation;
        world[i] =
            r[3 * i] * (right - t[0]) + r[3 * i + 1] * (down - t[1]) + r[3 * i + 2] * (forward - t[2]); // R (v - t)
    }
    for (int i = 0; i < 4; ++i)
        clip[i] = eye.full_projection[4 * i] * world[0] + eye.full_projection[4 * i + 1] * world[1] +
                  eye.full_projection[4 * i + 2] * world[2] + eye.full_projection[4 * i + 3];
    return {(clip[0] / clip[3] + 1) * 0.5 * camera.width, (clip[1] / clip[3] + 1) * 0.5 * camera.height};
}

} // namespace

TEST_CASE("cx, cy: the axis meets that pixel, whether file or frame says so")
{
    const std::string centre = "\"cx\": 300, \"cy\": 250.5, ";
    const auto of_file = parseCameraFile(transforms(kSize + centre), "f.json");
    const auto of_frame = parseCameraFile(transforms(kSize + "\"cx\": 1, \"cy\": 1, ", centre), "f.json");
    const auto of_upstream = parseCameraFile(upstream(centre), "f.json");
    for (const Camera& camera : {of_file[0], of_file[1], of_frame[1], of_upstream[0]}) {
        CHECK(camera.width == 800);
        auto [x, y] = landing(camera, 0, 0, 3);
        CHECK(x == doctest::Approx(300));
        CHECK(y == doctest::Approx(250.5));
        std::tie(x, y) = landing(camera, 0.5, -0.25, 2);
        CHECK(x == doctest::Approx(300 + 500 * 0.25));
        CHECK(y == doctest::Approx(250.5 - 400 * 0.125));
    }
    const auto [x, y] = landing(of_frame[0], 0, 0, 3);
    CHECK(x == doctest::Approx(1));
    CHECK(y == doctest::Approx(1));
    // one of the two, the other is the middle
    const auto half = parseCameraFile(transforms(kSize + "\"cy\": 100, "), "f.json");
    CHECK(landing(half[0], 0, 0, 1).first == doctest::Approx(400));
    CHECK(landing(half[0], 0, 0, 1).second == doctest::Approx(100));
}

TEST_CASE("cx, cy in the middle change no bit")
{
    const Camera plain = parseCameraFile(transforms(kSize), "f.json")[0];
    for (const std::string& json :
         {transforms(kSize + "\"cx\": 400, \"cy\": 200.0, "), transforms(kSize + "\"cx\": 400, ")}) {
        const EyeParams a = eyeParams(plain, {}), b = eyeParams(parseCameraFile(json, "f.json")[0], {});
        CHECK(std::memcmp(&a, &b, sizeof(a)) == 0);
    }
    const EyeParams a = eyeParams(parseCameraFile(upstream(""), "f.json")[0], {});
    const EyeParams b = eyeParams(parseCameraFile(upstream("\"cx\": 400, \"cy\": 200, "), "f.json")[0], {});
    CHECK(std::memcmp(&a, &b, sizeof(a)) == 0);
}

TEST_CASE("cx, cy follow --size and --fov")
{
    const Camera file = parseCameraFile(transforms(kSize + "\"cx\": 300, \"cy\": 250, "), "f.json")[0];
    Camera camera = file;
    finishCamera(camera, 400, 200, 0); // half as large
    CHECK(landing(camera, 0, 0, 1).first == doctest::Approx(150));
    CHECK(landing(camera, 0, 0, 1).second == doctest::Approx(125));
    camera = file;
    finishCamera(camera, 800, 600, 0); // taller: 100 rows more at top and bottom
    CHECK(landing(camera, 0, 0, 1).first == doctest::Approx(300));
    CHECK(landing(camera, 0, 0, 1).second == doctest::Approx(350));
    CHECK(landing(camera, 0, 1, 4).second == doctest::Approx(450));
    camera = file;
    finishCamera(camera, 800, 300, 0); // flatter: three quarters as large, 100 columns more at both sides
    CHECK(landing(camera, 0, 0, 1).first == doctest::Approx(325));
    CHECK(landing(camera, 0, 0, 1).second == doctest::Approx(187.5));
    CHECK(landing(camera, 0, 1, 4).second == doctest::Approx(262.5));
    camera = file;
    finishCamera(camera, 0, 0, 1.2); // another focal length, the same pixel
    CHECK(camera.fov_x == 1.2);
    CHECK(landing(camera, 0, 0, 1).first == doctest::Approx(300));
    CHECK(landing(camera, 0, 0, 1).second == doctest::Approx(250));
    const double focal = 400 / std::tan(0.6);
    CHECK(landing(camera, 1, 0, 4).first == doctest::Approx(300 + focal / 4));
    CHECK(landing(camera, 0, 1, 4).second == doctest::Approx(250 + focal / 4));
}

TEST_CASE("cx or cy alone follow --fov, and a lens in the middle stays there")
{
    for (const auto& [cx, cy] : {std::pair<int, int>{300, 200}, {400, 250}, {400, 200}}) {
        CAPTURE(cx);
        CAPTURE(cy);
        const std::string lens = formatString("\"cx\": %d, \"cy\": %d, ", cx, cy);
        Camera camera = parseCameraFile(transforms(kSize + lens), "f.json")[0];
        finishCamera(camera, 0, 0, 1.2);
        CHECK(landing(camera, 0, 0, 1).first == doctest::Approx(cx));
        CHECK(landing(camera, 0, 0, 1).second == doctest::Approx(cy));
    }
}

TEST_CASE("cx, cy that cannot be: no size, too far away, in a trajectory")
{
    const Outcome no_size = refusal(transforms("\"cx\": 300, "));
    CHECK(no_size.code == ErrorCode::InvalidFile);
    CHECK(no_size.says("f.json: key \"cx\" is 300 and the image has no size, expected \"w\" beside it"));
    CHECK(refusal(transforms(kSize, "\"cy\": 1e7, ")).says("f.json: frame 1: key \"cy\" is 1e+07"));
    CHECK(refusal(transforms(kSize, "\"cy\": \"mid\", ")).says("f.json: frame 1: key \"cy\" is \"mid\""));
    for (const std::string& json : {trajectory("", "\"cx\": 5, "), trajectory("\"cy\": 5, ", "")}) {
        CHECK(refusal(json).code == ErrorCode::InvalidFile);
        CHECK(refusal(json).says("\"views\""));
    }
}

TEST_CASE("distortion is refused with its key and its value, or ignored and told")
{
    struct Case {
        std::string json, where;
    };
    const std::vector<Case> cases = {
        {transforms(kSize + "\"k1\": -0.05, "), "f.json: key \"k1\" is -0.05,"},
        {transforms(kSize, "\"k1\": 1e-9, "), "f.json: frame 1: key \"k1\" is 1e-09,"},
        {transforms(kSize + "\"k1\": 0, \"k6\": 2, "), "f.json: key \"k6\" is 2,"},
        {transforms(kSize + "\"k2\": 0, \"p1\": 0.5, "), "f.json: key \"p1\" is 0.5,"},
        {transforms(kSize, "\"p2\": 0.5, "), "f.json: frame 1: key \"p2\" is 0.5,"},
        {transforms("\"k3\": 0.5, "), "f.json: key \"k3\" is 0.5,"}, // without a size too
        {transforms(kSize + "\"camera_model\": \"OPENCV_FISHEYE\", "), "key \"camera_model\" is \"OPENCV_FISHEYE\","},
        {transforms(kSize + "\"ftheta_p0\": 0, \"ftheta_p1\": 0.001, "), "key \"ftheta_p1\" is 0.001,"},
        {transforms(kSize, "\"camera_model\": \"FISHEYE\", "), "f.json: frame 1: key \"camera_model\""},
        {transforms(kSize + "\"is_fisheye\": true, "), "key \"is_fisheye\" is true,"},
        {upstream("\"k1\": 0.5, "), "f.json: entry 0 (a): key \"k1\" is 0.5,"},
        {trajectory("", "\"k1\": 0.5, "), "f.json: frame 0: key \"k1\" is 0.5,"},
        {trajectory("\"camera_model\": \"FISHEYE\", ", ""), "f.json: key \"camera_model\" is \"FISHEYE\","}};
    for (const Case& c : cases) {
        CAPTURE(c.json);
        const Outcome refused = refusal(c.json);
        CHECK(refused.code == ErrorCode::Unsupported);
        CHECK(refused.says(c.where));
        CHECK(refused.says("expected a pinhole"));
        CHECK(refused.says("undistort the images"));
        CHECK(refused.says("take the lens as a pinhole"));
        std::vector<std::string> ignored;
        CHECK(parseCameraFile(c.json, "f.json", nullptr, telling(ignored)).size() >= 1);
        CHECK(ignored.size() == 1);
    }
    for (const char* keys :
         {"\"camera_model\": \"EQUIRECTANGULAR\", ", "\"camera_model\": \"orthophoto\", ",
          "\"equirectangular\": true, ", "\"orthographic\": 1, ", "\"latlong\": true, \"k1\": 0.1, "})
        for (const bool ignore : {false, true}) { // no pinhole even without distortion
            CAPTURE(keys);
            std::vector<std::string> none;
            const Outcome refused = refusal(transforms(keys), ignore ? telling(none) : CameraReading{});
            CHECK(refused.code == ErrorCode::Unsupported);
            CHECK(refused.says("expected a pinhole; such a picture is none even without"));
        }
    std::vector<std::string> ignored;
    (void)parseCameraFile(transforms(kSize + "\"k1\": 0.25, ", "\"k1\": 0, "), "f.json", nullptr, telling(ignored));
    (void)parseCameraFile(transforms(kSize + "\"k1\": 0.25, \"camera_model\": \"FISHEYE\", "), "f.json", nullptr,
                          telling(ignored));
    REQUIRE(ignored.size() == 3);
    CHECK(contains(ignored[0], "f.json: lens distortion of 1 of 2 cameras is ignored (the first says \"k1\" is 0.25)"));
    CHECK(contains(ignored[1], "f.json: frame 1: key \"k1\" is 0 and that of the whole file is 0.25; the frame's"));
    CHECK(contains(ignored[2], "of 2 of 2 cameras is ignored (the first says \"camera_model\" is \"FISHEYE\", \"k1\""));
}

TEST_CASE("a lens without distortion is a pinhole, whatever its model is called")
{
    for (const char* model : {"PINHOLE", "SIMPLE_PINHOLE", "OPENCV", "SIMPLE_RADIAL"}) {
        const std::string keys = kSize + "\"camera_model\": \"" + model +
                                 "\", \"k1\": 0, \"k2\": 0.0, \"p1\": -0.0, \"is_fisheye\": false, ";
        std::vector<std::string> ignored;
        CHECK(refusal(transforms(keys)).message.empty());
        CHECK(refusal(transforms(keys), telling(ignored)).message.empty());
        CHECK(ignored.empty());
    }
    CHECK(refusal(transforms(kSize + "\"k1\": \"none\", ")).code == ErrorCode::InvalidFile);
    CHECK(refusal(transforms(kSize + "\"camera_model\": 3, ")).code == ErrorCode::InvalidFile);
}

TEST_CASE("lengths")
{
    const auto length = [](const char* text) { return parseLength(text, "--ipd"); };
    CHECK(length("0.065").value == 0.065);
    CHECK(length("0.065").unit == LengthUnit::World);
    CHECK(length("1e-3").value == 1e-3);
    for (const char* text : {"0.064m", "64mm", "6.4cm", "6.4e1mm"}) {
        CAPTURE(text);
        CHECK(length(text).value == 0.064);
        CHECK(length(text).unit == LengthUnit::Metre);
    }
    for (const char* text : {"", "m", "0", "0m", "-1", "-64mm", "nan", "inf", "infm", "1e15", "1e999", "64 mm", "64ft",
                             "64mmm", "0x10", "1,5", "+1"}) {
        CAPTURE(text);
        const Outcome refused = outcomeOf([&] { (void)length(text); });
        CHECK(refused.code == ErrorCode::Usage);
        CHECK(refused.says(std::string("--ipd ") + text + ": no length, expected a number above 0"));
    }
}

TEST_CASE("the metre of a manifest, and manifests without one")
{
    const auto metre = metreOfManifest(R"({"model": {"metre": {"units": 0.25, "rule": "seen"}}})");
    REQUIRE(metre.has_value());
    CHECK(metre->units == 0.25);
    CHECK(metre->rule == "seen");
    for (const char* manifest :
         {"", "{}", "[]", "no JSON", R"({"model": 3})", R"({"model": {"metre": null}})", R"({"model": {"metre": 2}})",
          R"({"model": {"metre": {"units": 0, "rule": "r"}}})", R"({"model": {"metre": {"units": -1, "rule": "r"}}})",
          R"({"model": {"metre": {"units": 1e300, "rule": "r"}}})", R"({"model": {"metre": {"units": 1}}})",
          R"({"model": {"metre": {"units": "1", "rule": "r"}}})", R"({"model": {"metre": {"units": 1, "rule": 2}}})",
          R"({"model": [1, 2]})"}) {
        CAPTURE(manifest);
        CHECK_FALSE(metreOfManifest(manifest).has_value());
    }
}
