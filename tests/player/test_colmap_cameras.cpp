// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/colmap_cameras.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstdint>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <numbers>
#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::string kCameras = "# Camera list\n1 PINHOLE 800 400 500 600 390 210\n7 SIMPLE_RADIAL 100 50 70 50 25 0\n";
// the first turned by 90 degrees about y; names out of order, one in a folder and with blanks
const std::string kImages = "# Image list\n"
                            "1 0.7071067811865476 0 0.7071067811865476 0 1 2 3 1 frames/b two.png\n"
                            "10.5 20.5 -1 3 4 5\n"
                            "2 1 0 0 0 -4 5 6 7 a.jpg\n"
                            "\n";

template <typename T>
void put(std::string& to, T value)
{
    to.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

// The model of kCameras and kImages in COLMAP's binary form.
void asBinary(std::string& cameras, std::string& images)
{
    put<uint64_t>(cameras, 2);
    put<int32_t>(cameras, 1);
    put<int32_t>(cameras, 1);
    put<uint64_t>(cameras, 800);
    put<uint64_t>(cameras, 400);
    for (const double v : {500., 600., 390., 210.})
        put(cameras, v);
    put<int32_t>(cameras, 7);
    put<int32_t>(cameras, 2);
    put<uint64_t>(cameras, 100);
    put<uint64_t>(cameras, 50);
    for (const double v : {70., 50., 25., 0.})
        put(cameras, v);
    put<uint64_t>(images, 2);
    put<uint32_t>(images, 1);
    for (const double v : {0.7071067811865476, 0., 0.7071067811865476, 0., 1., 2., 3.})
        put(images, v);
    put<uint32_t>(images, 1);
    images.append("frames/b two.png", 17);
    put<uint64_t>(images, 2);
    images.append(48, 'x');
    put<uint32_t>(images, 2);
    for (const double v : {1., 0., 0., 0., -4., 5., 6.})
        put(images, v);
    put<uint32_t>(images, 7);
    images.append("a.jpg", 6);
    put<uint64_t>(images, 0);
}

void check(const std::vector<Camera>& cameras)
{
    REQUIRE(cameras.size() == 2);
    const Camera &a = cameras[0], &b = cameras[1];
    CHECK(a.name == "a");
    CHECK(b.name == "b two");
    CHECK(a.width == 100);
    CHECK(std::tan(a.fov_x / 2) == doctest::Approx(50.0 / 70).epsilon(1e-9));
    CHECK(a.tan_mid_x == 0);
    CHECK(a.translation[0] == -4);
    CHECK(a.rotation[0] == 1);
    CHECK(b.height == 400);
    CHECK(std::tan(b.fov_y / 2) == doctest::Approx(200.0 / 600).epsilon(1e-9));
    CHECK(b.tan_mid_x == doctest::Approx(10.0 / 500).epsilon(1e-9)); // the middle lies right of the axis
    CHECK(b.tan_mid_y == doctest::Approx(-10.0 / 600).epsilon(1e-9));
    CHECK(b.translation[2] == 3);
    // the camera looks along -x, its right is z
    CHECK(b.rotation[2] == doctest::Approx(-1).epsilon(1e-9)); // forward, x
    CHECK(b.rotation[6] == doctest::Approx(1).epsilon(1e-9));  // right, z
    CHECK(b.rotation[4] == doctest::Approx(1).epsilon(1e-9));
}

ErrorCode refusal(const std::string& cameras, const std::string& images, bool binary = false)
{
    return outcomeOf([&] { (void)parseColmapCameras(cameras, images, binary, "m", {}); }).code;
}

std::string with(std::string text, const std::string& from, const std::string& to)
{
    const size_t at = text.find(from);
    REQUIRE(at != std::string::npos);
    return text.replace(at, from.size(), to);
}

} // namespace

TEST_CASE("COLMAP: text and binary give the same cameras, by name")
{
    check(parseColmapCameras(kCameras, kImages, false, "m", {}));
    std::string cameras, images;
    asBinary(cameras, images);
    check(parseColmapCameras(cameras, images, true, "m", {}));

    namespace fs = std::filesystem;
    const fs::path folder = fs::temp_directory_path() / "gsc_test_colmap_cameras";
    fs::create_directories(folder);
    std::ofstream(folder / "cameras.bin", std::ios::binary) << cameras;
    std::ofstream(folder / "images.bin", std::ios::binary) << images;
    CHECK(findCameras(folder.string(), {})[0].form == CameraForm::ModelInBinary);
    check(readCameraFile(folder.string()));
    check(readCameraFile((folder / "images.bin").string()));
    fs::remove_all(folder);
    CHECK(findCameras(folder.string(), {})[0].form == CameraForm::Json); // a file that is not there
}

TEST_CASE("COLMAP: distortion is refused by name, or ignored and told")
{
    const std::string radial = with(kCameras, "70 50 25 0", "70 50 25 0.1");
    const Outcome refused = outcomeOf([&] { (void)parseColmapCameras(radial, kImages, false, "m", {}); });
    CHECK(refused.code == ErrorCode::Unsupported);
    CHECK(refused.says("a.jpg, SIMPLE_RADIAL"));
    std::vector<std::string> ignored;
    check(parseColmapCameras(radial, kImages, false, "m", {true, CamerasTransform::Told, &ignored}));
    REQUIRE(ignored.size() == 1);
    CHECK(ignored[0].find("1 of 2 cameras") != std::string::npos);
    CHECK(refusal(with(kCameras, "SIMPLE_RADIAL", "RADIAL_FISHEYE"), kImages) ==
          ErrorCode::InvalidFile); // a value short
    CHECK(refusal(with(kCameras, "SIMPLE_RADIAL", "SIMPLE_RADIAL_FISHEYE"), kImages) == ErrorCode::Unsupported);
}

TEST_CASE("COLMAP: what is damaged is refused")
{
    CHECK(refusal(with(kCameras, "PINHOLE", "PANORAMA"), kImages) == ErrorCode::Unsupported);
    CHECK(refusal(with(kCameras, "800 400", "0 400"), kImages) == ErrorCode::InvalidFile);
    CHECK(refusal(with(kCameras, "500 600", "nan 600"), kImages) == ErrorCode::InvalidFile);
    CHECK(refusal(with(kCameras, "7 SIMPLE", "8 SIMPLE"), kImages) == ErrorCode::InvalidFile);
    CHECK(refusal(kCameras, with(kImages, "2 1 0 0 0", "2 0 0 0 0")) == ErrorCode::InvalidFile);
    CHECK(refusal(kCameras, with(kImages, " 7 a.jpg", "")) == ErrorCode::InvalidFile);
    CHECK(refusal(kCameras, "# nothing\n") == ErrorCode::InvalidFile);
    std::string cameras, images;
    asBinary(cameras, images);
    for (size_t size = 0; size < images.size(); ++size)
        if (refusal(cameras, images.substr(0, size), true) != ErrorCode::InvalidFile)
            FAIL("images cut to ", size);
    for (size_t size = 0; size < cameras.size(); ++size)
        if (refusal(cameras.substr(0, size), images, true) != ErrorCode::InvalidFile)
            FAIL("cameras cut to ", size);
    std::memset(images.data() + 8 + 4 + 56 + 4 + 17, 0xff, 8); // 2^64 - 1 points
    CHECK(refusal(cameras, images, true) == ErrorCode::InvalidFile);
}
