// SPDX-License-Identifier: Apache-2.0
// COLMAP models and folders as other programs write them.
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "runtime/cameras/colmap_cameras.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

using namespace gsc;
using namespace gsc::test;
namespace fs = std::filesystem;

namespace {

const std::string kPinhole = "1 PINHOLE 200 150 150 120 100 75\n";
const std::string kPoints = "10.5 20.5 -1 3 4 5\n";

struct Model {
    std::vector<Camera> cameras;
    std::vector<std::string> told;

    [[nodiscard]] bool tells(const std::string& part) const
    {
        return std::ranges::any_of(told, [&](const auto& text) { return text.find(part) != std::string::npos; });
    }
};

Model parse(const std::string& cameras, const std::string& images, bool ignore = false, bool binary = false)
{
    Model model;
    model.cameras = parseColmapCameras(cameras, images, binary, "m", {ignore, CamerasTransform::Told, &model.told});
    return model;
}

Model readPath(const fs::path& path)
{
    Model model;
    model.cameras = readCameraFile(path.string(), nullptr, {false, CamerasTransform::Told, &model.told});
    return model;
}

std::string refusal(const std::string& cameras, const std::string& images, ErrorCode code, bool ignore = false,
                    bool binary = false)
{
    try {
        (void)parse(cameras, images, ignore, binary);
    } catch (const Error& e) {
        CHECK(e.code() == code);
        return e.what();
    }
    FAIL("not refused");
    return "";
}

std::string image(int number, const std::string& name)
{
    return formatString("%d 1 0 0 0 0.%d 0 0 1 ", number, number) + name + "\n";
}

template <typename T>
void put(std::string& to, T value)
{
    to.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

struct Models {
    int number;
    const char* name;
    size_t values;
    bool pinhole; // without coefficients
};
constexpr Models kNewer[] = {{11, "RAD_TAN_THIN_PRISM_FISHEYE", 16, false},
                             {12, "SIMPLE_DIVISION", 4, true},
                             {13, "DIVISION", 5, true},
                             {14, "SIMPLE_FISHEYE", 3, false},
                             {15, "FISHEYE", 4, false},
                             {16, "EUCM", 6, true},
                             {17, "EQUIRECTANGULAR", 2, false}};

// One camera of a model, 200 x 150, and its image; focal lengths 150 and middle 100, 75, then `more`.
std::string lensText(const Models& model, const char* more)
{
    const bool one_focal = std::string(model.name).starts_with("SIMPLE");
    std::string text = "1 " + std::string(model.name) + " 200 150";
    for (size_t i = 0; i < model.values; ++i) {
        const size_t at = one_focal && i > 0 ? i + 1 : i;
        text += std::string(" ") + (at < 2 ? "150" : at == 2 ? "100" : at == 3 ? "75" : more);
    }
    return text + "\n";
}

std::string lensBytes(const Models& model, double more)
{
    const bool one_focal = std::string(model.name).starts_with("SIMPLE");
    std::string bytes;
    put<uint64_t>(bytes, 1);
    put<int32_t>(bytes, 1);
    put<int32_t>(bytes, model.number);
    put<uint64_t>(bytes, 200);
    put<uint64_t>(bytes, 150);
    for (size_t i = 0; i < model.values; ++i) {
        const size_t at = one_focal && i > 0 ? i + 1 : i;
        put<double>(bytes, at < 2 ? 150 : at == 2 ? 100 : at == 3 ? 75 : more);
    }
    return bytes;
}

std::string imageBytes()
{
    std::string bytes;
    put<uint64_t>(bytes, 1);
    put<uint32_t>(bytes, 1);
    for (const double v : {1., 0., 0., 0., 0., 0., 0.})
        put(bytes, v);
    put<uint32_t>(bytes, 1);
    bytes.append("a.png", 6);
    put<uint64_t>(bytes, 0);
    return bytes;
}

// Gone with the test.
struct Folder {
    fs::path path = fs::temp_directory_path() / ("gsc_test_colmap_variants_" + std::to_string(::getpid()));
    Folder() { fs::create_directories(path); }
    ~Folder() { fs::remove_all(path); }
    Folder(const Folder&) = delete;
    Folder& operator=(const Folder&) = delete;

    void write(const std::string& name, const std::string& text) const
    {
        fs::create_directories((path / name).parent_path());
        std::ofstream(path / name, std::ios::binary) << text;
    }
    void model(const std::string& name, const std::string& images) const
    {
        write(name + "/cameras.txt", kPinhole);
        write(name + "/images.txt", images);
    }
};

} // namespace

TEST_CASE("COLMAP's models since 3.10: lenses that are refused as such, by name and by number")
{
    const std::string images = "1 1 0 0 0 0 0 0 1 a.png\n\n";
    for (const Models& model : kNewer) {
        CAPTURE(model.name);
        for (const std::string& said :
             {refusal(lensText(model, "0.01"), images, ErrorCode::Unsupported),
              refusal(lensBytes(model, 0.01), imageBytes(), ErrorCode::Unsupported, false, true)}) {
            CHECK(said.find(model.name) != std::string::npos);
            CHECK(said.find("undistort") != std::string::npos);
        }
        if (model.number == 17) { // has no focal length
            (void)refusal(lensText(model, ""), images, ErrorCode::Unsupported, true);
            continue;
        }
        for (const Model& ignored :
             {parse(lensText(model, "0.01"), images, true), parse(lensBytes(model, 0.01), imageBytes(), true, true)}) {
            CHECK(ignored.told.size() == 1);
            CHECK(std::tan(ignored.cameras[0].fov_x / 2) == doctest::Approx(100 / 150.0));
            CHECK(std::tan(ignored.cameras[0].fov_y / 2) == doctest::Approx(75 / 150.0));
        }
        if (model.pinhole)
            CHECK(parse(lensText(model, "0"), images).told.empty());
        else
            (void)refusal(lensText(model, "0"), images, ErrorCode::Unsupported);
    }
    CHECK(parse("1 FOV 200 150 150 150 100 75 0\n", images).told.empty());
    (void)refusal("1 FOV 200 150 150 150 100 75 0.9\n", images, ErrorCode::Unsupported);
    for (const std::string& said :
         {refusal("1 PINHOLES 200 150 150 150 100 75\n", images, ErrorCode::Unsupported, true),
          refusal(lensBytes({18, "", 4, true}, 0), imageBytes(), ErrorCode::Unsupported, true, true)})
        CHECK(said.find("undistort") != std::string::npos);
    CHECK(parse("# Number of cameras: 2\n2 OF_TOMORROW 200 150 1\n" + kPinhole, images).told.empty()); // no image's
    (void)refusal("1 OF_TOMORROW 200 150 1\n" + kPinhole, images, ErrorCode::InvalidFile);
    const std::string said =
        refusal(lensBytes({-1, "", 4, true}, 0), imageBytes(), ErrorCode::InvalidFile, false, true);
    CHECK(said.find("camera 1 of model -1, expected a model from 0 to 17") != std::string::npos);
}

TEST_CASE("images.txt without lines of points: no image vanishes")
{
    const std::string a = image(1, "a.png"), b = image(2, "b.png"), c = image(3, "c.png"), d = image(4, "d.png");
    for (const std::string& images :
         {a + b + c + d, "# Image list\n" + a + b + "# more\n" + c + d.substr(0, d.size() - 1),
          a + "\n" + b + "\n" + c + "\n" + d + "\n", a + "\n\n" + b + kPoints + "\n" + c + "\n" + d,
          image(1, "0001") + image(2, "0002") + image(3, "0003") + image(4, "a b")}) {
        CAPTURE(images);
        const Model model = parse(kPinhole, images);
        CHECK(model.cameras.size() == 4);
        CHECK(model.told.empty());
    }
    for (const std::string& images :
         {a + kPoints + b + c + kPoints + d, a + b + "\n" + c + d, a + b + kPoints + c + "\n" + d}) {
        CAPTURE(images);
        const Model model = parse(kPinhole, images);
        CHECK(model.cameras.size() == 4);
        CHECK(model.told.size() == 1);
        CHECK(model.tells("no line of points"));
    }
    // points whose first word looks like an image's number
    CHECK(parse(kPinhole, a + "1 2 3 4 5 6 7 8 9 10 11 12\n" + b + "1 2 -1\n").cameras.size() == 2);
    (void)refusal(kPinhole, a + "1 2 3 four\n" + b, ErrorCode::InvalidFile);
}

TEST_CASE("images.txt without lines of points: an image without a name, or called by three numbers, is never points")
{
    const std::string a = image(1, "a.png"), c = image(3, "c.png");
    for (const char* nameless : {"2 1 0 0 0 .1 0 0 1\n", "2 1 0 0 0 0 0 0 1\n", "2 1 0 0 0 7 0 0 1\n"}) {
        CAPTURE(nameless);
        (void)refusal(kPinhole, a + nameless + c, ErrorCode::InvalidFile);
    }
    (void)refusal(kPinhole, a + "2 1 0 0 0 0 0 0 1 1 2 3\n" + c, ErrorCode::InvalidFile); // or is it points?
    const Model named = parse(kPinhole, a + "2 1 0 0 0 .1 0 0 1 1 2 3\n" + c);
    CHECK(named.cameras.size() == 3);
    CHECK(named.told.empty());
    for (const char* points : {"1 2\n", "1 2 0.5\n", "1 2 -2\n", "1 2 3 4\n"}) {
        CAPTURE(points);
        (void)refusal(kPinhole, a + points + c, ErrorCode::InvalidFile);
    }
    std::string many;
    for (int i = 0; i < 100; ++i)
        many += formatString("%d.5 %d.25 %d ", i, i, i % 3 - 1);
    for (const std::string& points : {many, std::string("0.5 0.5 7 0.5 0.5 -1 0 0 1"), std::string("1 1 0 0 0 0 0 0 9"),
                                      std::string("1 2 18446744073709551615")}) {
        CAPTURE(points);
        CHECK(parse(kPinhole, a + points + "\n" + c).cameras.size() == 2);
    }
}

TEST_CASE("text with the blanks, ends and marks of other programs")
{
    const std::string good = image(1, "a.png") + "\n" + image(2, "dir one/b two.png") + kPoints;
    const auto with = [](std::string text, char from, const std::string& to) {
        for (size_t at = 0; (at = text.find(from, at)) != std::string::npos; at += to.size())
            text.replace(at, 1, to);
        return text;
    };
    for (const auto& [cameras, images] :
         {std::pair{with(kPinhole, '\n', "\r\n"), with(good, '\n', "\r\n")},
          {with(kPinhole, '\n', "\r"), with(good, '\n', "\r")},
          {with(kPinhole, '\n', "\r\r\n"), with(good, '\n', "\r\r\n")},
          {"\xef\xbb\xbf" + kPinhole, "\xef\xbb\xbf" + good},
          {with(kPinhole, ' ', "\t"), with(image(1, "a.png"), ' ', "\t") + "\n" + image(2, "b two.png")},
          {"\n  # note\n  1   PINHOLE 200 150  1.5e2 +120 1e2 7.5e+1 \n\n", "  " + good},
          {"1 PINHOLE 200.0 150.0 150 120 100 75", good}}) {
        CAPTURE(cameras);
        CAPTURE(images);
        const Model model = parse(cameras, images);
        REQUIRE(model.cameras.size() == 2);
        CHECK(model.told.empty());
        CHECK(model.cameras[0].name == "a");
        CHECK(model.cameras[1].name == "b two");
        CHECK(std::tan(model.cameras[0].fov_y / 2) == doctest::Approx(75 / 120.0));
        CHECK(model.cameras[0].tan_mid_x == 0);
    }
}

TEST_CASE("what a model says twice, or of another count, is told or refused")
{
    const std::string images = image(1, "a.png") + "\n" + image(2, "b.png") + "\n";
    const std::string counted = "# Number of images: 3, mean observations per image: 0\n" + images;
    CHECK(parse(kPinhole, counted).tells("images.txt says that it has 3 images and has 2"));
    CHECK(
        parse("# Number of cameras: 2\n" + kPinhole, images).tells("cameras.txt says that it has 2 cameras and has 1"));
    CHECK(parse("# Number of cameras: 1\n" + kPinhole, "# Number of images: 2, mean\n" + images).told.empty());
    (void)refusal(kPinhole + kPinhole, images, ErrorCode::InvalidFile);
    (void)refusal(kPinhole, images + image(2, "c.png") + "\n", ErrorCode::InvalidFile);
    (void)refusal("1 PINHOLE 200 150 150 120 100 75 0.1\n", images, ErrorCode::InvalidFile);
    (void)refusal("1 PINHOLE 200 150 150 120 100\n", images, ErrorCode::InvalidFile);
    (void)refusal("1 PINHOLE 200.5 150 150 120 100 75\n", images, ErrorCode::InvalidFile);
    (void)refusal("1 PINHOLE 200 150 150 120 100 7,5\n", images, ErrorCode::InvalidFile);
    (void)refusal("1 PINHOLE 200 150 150 120 1e9 75\n", images, ErrorCode::InvalidFile);
    (void)refusal("2 PINHOLE 200 150 150 120 100 75\n", images, ErrorCode::InvalidFile);
    (void)refusal(kPinhole, "1.5 1 0 0 0 0 0 0 1 a.png\n", ErrorCode::InvalidFile);
    (void)refusal(kPinhole, "1 1 0 0 0 0 0 1 a.png\n", ErrorCode::InvalidFile);
    (void)refusal(kPinhole, "1 1 0 0 0 0 0 1e200 1 a.png\n", ErrorCode::InvalidFile);
    // a quaternion that was printed with few digits
    CHECK(parse(kPinhole, "1 0.707 0 0.707 0 0 0 0 1 a.png\n").cameras[0].rotation[6] == doctest::Approx(1));
    CHECK(parse(kPinhole, "1 0.707 0 0.707 0 0 0 0 1 a.png\n").told.empty());
    // others say a direction too
    const Model longer = parse(kPinhole, "1 2 0 2 0 0 0 0 1 a.png\n");
    CHECK(longer.cameras[0].rotation[6] == doctest::Approx(1));
    CHECK(longer.tells("image a.png: its quaternion has the length 2.82843 and not 1; it is normalised"));
    (void)refusal(kPinhole, "1 0 0 0 0 0 0 0 1 a.png\n", ErrorCode::InvalidFile);
    CHECK(
        parse("1 PINHOLE 200 150 150 120 -1 75\n", image(1, "a.png")).tells("image a.png: the axis (cx, cy) meets no"));
    CHECK(parse("1 PINHOLE 200 150 5 120 100 75\n", image(1, "a.png")).tells("image a.png: sees 174."));
    CHECK(parse(lensBytes({1, "PINHOLE", 4, true}, 0) + "xyz", imageBytes() + "12", false, true).told.size() == 2);
}

TEST_CASE("the folder of a data set: the model that the trainers take, and a word about the others")
{
    const Folder folder;
    const fs::path& path = folder.path;
    CHECK_THROWS_AS((void)readPath(path), Error);
    folder.model("one/sparse/0", image(1, "a.png"));
    CHECK(readPath(path / "one").told.empty());
    CHECK(readPath(path / "one").cameras[0].name == "a");
    CHECK(readPath(path / "one" / "sparse").cameras.size() == 1);
    CHECK(readPath(path / "one" / "sparse/0/cameras.txt").cameras.size() == 1);

    folder.model("one/sparse/1", image(1, "a.png") + image(2, "b.png"));
    folder.model("one/sparse/10", image(1, "a.png"));
    for (const char* name : {"one", "one/sparse"}) {
        const Model several = readPath(path / name);
        CHECK(several.cameras.size() == 1);
        REQUIRE(several.told.size() == 1);
        CHECK(several.tells(name == std::string("one") ? "sparse/1, sparse/10 is there too" : "1, 10 is there too"));
    }
    folder.model("flat/sparse", image(1, "a.png"));
    CHECK(readPath(path / "flat").told.empty());
    folder.model("nerfstudio/colmap/sparse/0", image(1, "a.png"));
    CHECK(readPath(path / "nerfstudio").cameras.size() == 1);
    folder.write("nerfstudio/transforms.json", "{}");
    CHECK(readPath(path / "nerfstudio").tells("transforms.json is there too"));

    const auto transforms = [](const char* name) {
        return formatString("{\"camera_angle_x\": 1, \"w\": 8, \"h\": 8, \"frames\": [{\"file_path\": \"%s\", "
                            "\"transform_matrix\": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}]}",
                            name);
    };
    folder.write("blender/transforms_train.json", transforms("./train/r_0"));
    folder.write("blender/transforms_test.json", transforms("./test/r_1"));
    const Model blender = readPath(path / "blender");
    REQUIRE(blender.cameras.size() == 2);
    CHECK(blender.told.empty());
    CHECK(blender.cameras[0].name == "r_1"); // the test's first, as in a trainer's cameras.json
    folder.write("blender/transforms_val.json", transforms("./val/r_2"));
    CHECK(readPath(path / "blender").tells("transforms_val.json is there too"));
    folder.write("plain/transforms.json", transforms("a"));
    CHECK(readPath(path / "plain").cameras.size() == 1);
    const char* const trained =
        "[{\"id\": 0, \"img_name\": \"t\", \"width\": 8, \"height\": 8, \"position\": [0, 0, 0], "
        "\"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], \"fx\": 4, \"fy\": 4}]";
    folder.write("plain/cameras.json", trained);
    CHECK(readPath(path / "plain").tells("cameras.json is there too"));
    folder.write("trained/cameras.json", trained);
    CHECK(readPath(path / "trained").told.empty());
    CHECK(readPath(path / "trained").cameras[0].name == "t");
    folder.write("trained/cfg_args", "Namespace(resolution=4)");
    CHECK(readPath(path / "trained").tells("cfg_args: its resolution is not applied"));

    folder.write("half/cameras.txt", kPinhole);
    fs::create_directories(path / "empty");
    for (const auto& [name, found] : {std::pair("half", "a folder with a COLMAP model's cameras but not its images"),
                                      {"empty", "a folder without cameras, expected cameras.json"}}) {
        CAPTURE(name);
        const Outcome refused = outcomeOf([&] { (void)readPath(path / name); });
        CHECK(refused.code == ErrorCode::Io);
        CHECK(refused.says(found));
    }
}

TEST_CASE("text and binary side by side: the binary one, and a word where they differ")
{
    const Folder folder;
    folder.write("cameras.bin", lensBytes({1, "PINHOLE", 4, true}, 0));
    folder.write("images.bin", imageBytes());
    folder.write("cameras.txt", "1 PINHOLE 200 150 150 150 100 75\n");
    CHECK(readPath(folder.path).told.empty()); // no model without images.txt
    folder.write("images.txt", "1 1 0 0 0 0 0 0 1 a.png\n");
    CHECK(readPath(folder.path).told.empty());
    for (const char* other : {"1 1 0 0 0 0 0 0.5 1 a.png\n", "1 1 0 0 0 0 0 0 1 b.png\n", "1 1 0 0\n",
                              "1 1 0 0 0 0 0 0 1 a.png\n2 1 0 0 0 0 0 0 1 b.png\n"}) {
        folder.write("images.txt", other);
        const Model model = readPath(folder.path);
        CHECK(model.cameras.size() == 1);
        CHECK(model.told.size() == 1);
        CHECK(model.tells("the binary files are taken"));
    }
    folder.write("images.txt", "1 1 0 0 0 0 0 0.5 1 b.png\n");
    CHECK(readPath(folder.path / "images.txt").cameras[0].name == "b");
    fs::remove(folder.path / "cameras.bin"); // half a binary model beside a whole one of text
    CHECK(readPath(folder.path).cameras[0].name == "b");
}
