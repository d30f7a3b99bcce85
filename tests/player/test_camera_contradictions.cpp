// SPDX-License-Identifier: Apache-2.0
// Camera files that say a thing twice, or more than is read: honoured, or named in a warning with what was taken.
#include <gsc/error.h>
#include "runtime/cameras/camera_file.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::string kMatrix = "[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]";
const std::string kSize = "\"w\": 200, \"h\": 150, ";

// A transforms.json of two frames; `file` and `frame` (the second's) are keys with a comma.
std::string transforms(const std::string& file, const std::string& frame = "", const std::string& matrix = kMatrix)
{
    return "{" + file + "\"frames\": [{\"file_path\": \"a.png\", \"transform_matrix\": " + kMatrix +
           "}, {\"file_path\": \"b.png\", " + frame + "\"transform_matrix\": " + matrix + "}]}";
}

std::string angle(double focal, double side)
{
    return formatString("%.17g", 2 * std::atan(side / (2 * focal)));
}

struct Read {
    std::vector<Camera> cameras;
    std::vector<std::string> told;

    // How many warnings hold all of `parts`.
    [[nodiscard]] long tells(const std::vector<std::string>& parts) const
    {
        return std::ranges::count_if(told, [&](const std::string& text) {
            return std::ranges::all_of(parts, [&](const auto& part) { return text.find(part) != std::string::npos; });
        });
    }
};

Read read(const std::string& json, CamerasTransform transform = CamerasTransform::Told)
{
    Read result;
    result.cameras = parseCameraFile(json, "f.json", nullptr, {false, transform, &result.told});
    return result;
}

ErrorCode refusal(const std::string& json, CamerasTransform transform = CamerasTransform::Told)
{
    return outcomeOf([&] { (void)read(json, transform); }).code;
}

// Focal lengths in pixels as the picture has them.
void checkFocal(const Camera& camera, double fx, double fy)
{
    CHECK(camera.width / (2 * std::tan(camera.fov_x / 2)) == doctest::Approx(fx).epsilon(1e-9));
    CHECK(camera.height / (2 * std::tan(camera.fov_y / 2)) == doctest::Approx(fy).epsilon(1e-9));
}

} // namespace

TEST_CASE("both axes of a lens are honoured, whatever they are stated in")
{
    const std::string x = "\"camera_angle_x\": " + angle(150, 200) + ", ";
    const std::string y = "\"camera_angle_y\": " + angle(120, 150) + ", ";
    const std::string degrees = formatString("\"y_fov\": %.17g, ", 2 * std::atan(150 / 240.0) * 180 / std::numbers::pi);
    for (const std::string& keys :
         {x + y, x + "\"fl_x\": 150, \"fl_y\": 120, ", x + "\"fl_y\": 120, ", "\"fl_x\": 150, " + y,
          std::string("\"fl_x\": 150, \"fl_y\": 120, "), x + degrees, "\"fl_x\": 150, " + degrees}) {
        CAPTURE(keys);
        const Read found = read(transforms(kSize + keys));
        CHECK(found.told.empty());
        for (const Camera& camera : found.cameras)
            checkFocal(camera, 150, 120);
    }
    // without a size: angles are angles of whatever picture is asked for, focal lengths are pixels of it
    Camera camera = read(transforms("\"camera_angle_x\": 1, \"camera_angle_y\": 0.5, ")).cameras[0];
    finishCamera(camera, 300, 300, 0);
    CHECK(camera.fov_x == doctest::Approx(1));
    CHECK(camera.fov_y == doctest::Approx(0.5));
    camera = read(transforms("\"fl_x\": 150, \"fl_y\": 120, ")).cameras[0];
    finishCamera(camera, 200, 150, 0);
    checkFocal(camera, 150, 120);
    const Read mixed = read(transforms("\"camera_angle_x\": 1, \"fl_y\": 120, "));
    CHECK(mixed.tells({"\"fl_y\"", "no size", "square", "so in 2 places"}) == 1);
    CHECK(read(transforms("\"fl_x\": 100, \"camera_angle_y\": 1, ")).tells({"\"camera_angle_y\"", "ignored"}) == 1);
}

TEST_CASE("one axis alone means square pixels")
{
    for (const std::string& keys : {std::string("\"fl_y\": 120, "), "\"camera_angle_y\": " + angle(120, 150) + ", ",
                                    std::string("\"fl_x\": 120, "), "\"camera_angle_x\": " + angle(120, 200) + ", "}) {
        CAPTURE(keys);
        const Read found = read(transforms(kSize + keys));
        CHECK(found.told.empty());
        checkFocal(found.cameras[0], 120, 120);
    }
}

TEST_CASE("keys that do not say the same: the frame's, and the focal length, with both values told")
{
    const std::string x = "\"camera_angle_x\": " + angle(150, 200) + ", ";
    const Read units = read(transforms(kSize + x + "\"fl_x\": 170, "));
    checkFocal(units.cameras[0], 170, 170);
    CHECK(units.told.size() == 1);
    CHECK(units.tells(
              {"f.json: frame 0", "\"fl_x\" of the whole file (170) and \"camera_angle_x\"", "so in 2 places"}) == 1);
    CHECK(read(transforms(kSize + x + "\"fl_x\": 150.1, ")).told.empty()); // rounded
    CHECK(read(transforms(kSize + x + "\"fl_x\": 150.2, ")).told.size() == 1);
    // BlenderNeRF: the vertical angle is the sensor's, 36 x 24 mm, and the picture is 16 : 9
    const Read blender =
        read(transforms("\"w\": 192, \"h\": 108, \"fl_x\": 266.667, \"fl_y\": 266.667, \"camera_angle_x\": " +
                        angle(50, 36) + ", \"camera_angle_y\": " + angle(50, 24) + ", "));
    checkFocal(blender.cameras[0], 266.667, 266.667);
    CHECK(blender.told.size() == 1);
    CHECK(blender.tells({"\"fl_y\" of the whole file (266.667) and \"camera_angle_y\"", "the first is taken"}) == 1);
    // without a size the angle holds for every picture
    Camera any = read(transforms(x + "\"fl_x\": 170, ")).cameras[0];
    finishCamera(any, 200, 150, 0);
    checkFocal(any, 150, 150);

    const Read places = read(transforms(kSize + "\"fl_x\": 150, ", "\"fl_x\": 170, "));
    checkFocal(places.cameras[0], 150, 150);
    checkFocal(places.cameras[1], 170, 170);
    CHECK(places.told.size() == 1);
    CHECK(places.tells({"f.json: frame 1", "\"fl_x\" (170)", "whole file (150)", "the first is taken"}) == 1);

    const Read across = read(transforms(kSize + x, "\"fl_x\": 170, "));
    checkFocal(across.cameras[1], 170, 170);
    CHECK(across.tells({"\"fl_x\" (170)", "\"camera_angle_x\" of the whole file"}) == 1);

    for (const char* keys : {"\"w\": 100, ", "\"h\": 100, ", "\"cx\": 90, ", "\"cy\": 70, ", "\"k1\": 0.0, ",
                             "\"camera_model\": \"PINHOLE\", "}) {
        CAPTURE(keys);
        const std::string file =
            kSize + "\"fl_x\": 150, \"cx\": 100, \"cy\": 75, \"k1\": 0, \"camera_model\": \"OPENCV\", ";
        const Read frame = read(transforms(file, keys));
        const bool same = std::string(keys).find("k1") != std::string::npos;
        CHECK(frame.tells({"frame 1: key", "of the whole file is", "the frame's is taken"}) == (same ? 0 : 1));
        CHECK(frame.told.size() == (same ? 0 : 1));
    }
    const Read half = read(transforms("\"w\": 200, \"fl_x\": 150, "));
    CHECK(half.cameras[0].width == 0);
    CHECK(half.tells({"\"w\" is there without \"h\""}) == 1);
}

TEST_CASE("null, as Python writes None, is as if the key were not there; NaN is not")
{
    const char* const kNone =
        "\"k1\": null, \"camera_model\": null, \"distortion_params\": null, \"is_fisheye\": null, ";
    CHECK(
        read(transforms(kSize + kNone + "\"fl_x\": 150, \"applied_transform\": null, \"applied_scale\": null, ", kNone))
            .told.empty());
    CHECK(refusal(transforms(kSize + "\"fl_x\": 150, \"k1\": 0.5, ", kNone)) == ErrorCode::Unsupported); // the file's
    for (const char* key : {"\"k1\": NaN, ", "\"cx\": NaN, ", "\"applied_scale\": Infinity, "})
        CHECK(refusal(transforms(kSize + "\"fl_x\": 150, " + key)) == ErrorCode::InvalidFile);
    const std::string path = "\"render_width\": 200, \"render_height\": 100, \"camera_path\": [{\"fov\": 90, "
                             "\"camera_to_world\": [1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6, 0, 0, 0, 1]}]}";
    CHECK(read("{\"camera_type\": null, " + path).told.empty());
}

TEST_CASE("lenses that are seldom meant are kept and told once")
{
    const Read outside = read(transforms(kSize + "\"fl_x\": 150, \"cx\": 201, \"cy\": 75, "));
    CHECK(outside.told.size() == 1);
    CHECK(outside.tells({"f.json: frame 0: the axis (cx, cy) meets no pixel", "so in 2 places"}) == 1);
    const Read wide = read(transforms(kSize + "\"fl_x\": 1.39, "));
    CHECK(wide.told.size() == 1);
    CHECK(wide.tells({"frame 0: sees 178", "so in 2 places"}) == 1);
    CHECK(read(transforms(kSize + "\"fl_x\": 15, \"cx\": 200, \"cy\": 0, ")).told.empty());
    CHECK(
        read(
            "[{\"id\": 0, \"img_name\": \"a\", \"width\": 200, \"height\": 150, \"position\": [1, 2, 3], \"rotation\": "
            "[[1, 0, 0], [0, 1, 0], [0, 0, 1]], \"fx\": 2, \"fy\": 2}]")
            .tells({"entry 0 (a): sees 177"}) == 1);
}

TEST_CASE("a key that an object has twice is refused, wherever it stands")
{
    CHECK(refusal(transforms(kSize + "\"fl_x\": 150, \"fl_x\": 170, ")) == ErrorCode::InvalidFile);
    CHECK(refusal(transforms(kSize + "\"fl_x\": 150, ", "\"cx\": 1, \"cx\": 1, ")) == ErrorCode::InvalidFile);
    CHECK(refusal("[{\"id\": 0, \"id\": 1}]") == ErrorCode::InvalidFile);
}

TEST_CASE("keys of other programs: silent where they say nothing of poses and lenses, else named")
{
    for (const char* keys :
         {"\"aabb_scale\": 16, \"ply_file_path\": \"sparse_pc.ply\", \"up\": [0, 0, 1], \"n_frames\": 2, ",
          "\"enable_depth_loading\": true, \"integer_depth_scale\": 0.001, \"aabb\": [[0, 0, 0], [1, 1, 1]], ",
          "\"k1\": 0, \"k2\": 0, \"p1\": 0, \"p2\": 0, \"distortion_params\": [0, 0, 0, 0, 0, 0], \"is_fisheye\": 0, ",
          "\"camera_model\": \"opencv\", \"fisheye_crop_radius\": 100, "})
        CHECK(read(transforms(kSize + keys + "\"fl_x\": 150, ")).told.empty());
    CHECK(read(transforms(kSize + "\"fl_x\": 150, ", "\"sharpness\": 2, \"mask_path\": \"m\", \"rotation\": 0.1, "
                                                     "\"colmap_im_id\": 3, \"depth_file_path\": \"d\", "))
              .told.empty());
    const Read named = read(transforms(kSize + "\"fl_x\": 150, \"scale\": 0.3, \"from_mitsuba\": true, "
                                               "\"orientation_override\": \"none\", \"test_filenames\": [], ",
                                       "\"rolling_shutter\": [0, 0, 1, 0], "));
    CHECK(named.told.size() == 1);
    CHECK(named.tells({"f.json: has \"from_mitsuba\", \"orientation_override\", \"rolling_shutter\", \"scale\", "
                       "\"test_filenames\""}) == 1);
    CHECK(read(transforms(kSize + "\"fl_x\": 150, \"n_frames\": 1, "))
              .tells({"\"n_frames\" is 1 and the file has 2 frames"}) == 1);
    for (const char* keys : {"\"distortion_params\": [0.1, 0, 0, 0, 0, 0], ", "\"equirectangular\": true, ",
                             "\"latlong\": true, ", "\"s1\": 0.1, ", "\"camera_model\": \"fisheye\", "})
        CHECK(refusal(transforms(kSize + keys + "\"fl_x\": 150, ")) == ErrorCode::Unsupported);

    const std::string entry =
        "{\"id\": 0, \"img_name\": \"a\", \"width\": 200, \"height\": 150, \"position\": [1, 2, 3], "
        "\"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]], \"fy\": 120, ";
    const Read upstream = read("[" + entry + "\"fx\": 150}, " + entry + "\"fx\": 150, \"FoVx\": 1}]");
    checkFocal(upstream.cameras[0], 150, 120);
    CHECK(upstream.tells({"\"FoVx\""}) == 1);
    CHECK(upstream.tells({"has 1 name of more than one camera (the first is a)"}) == 1);

    const std::string frame = "{\"fov_x\": 1, \"position\": [1, 2, 3], \"rotation\": [[1, 0, 0], [0, 1, 0], [0, 0, 1]]";
    const std::string head = "{\"schema\": \"gsc.trajectory/1\", \"fps\": 30, \"metre\": 1, ";
    CHECK(read(head + "\"frames\": [" + frame + "}]}").told.empty());
    CHECK(read(head + "\"fov_x\": 2, \"frames\": [" + frame + ", \"fov\": 3}]}").tells({"\"fov\", \"fov_x\""}) == 1);

    const std::string path =
        "{\"render_width\": 200, \"render_height\": 100, \"fps\": 24, \"seconds\": 1, \"keyframes\": "
        "[], \"is_cycle\": false, \"smoothness_value\": 0, \"crop\": null, \"default_fov\": 50, ";
    const auto entries = [](const char* more) {
        return std::string(
                   "\"camera_path\": [{\"fov\": 90, \"camera_to_world\": [1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6, 0, "
                   "0, 0, 1]") +
               more + "}]}";
    };
    CHECK(read(path + entries(", \"aspect\": 2, \"render_time\": 0")).told.empty());
    CHECK(read(path + entries(", \"aspect\": 1.5")).tells({"entry 0", "\"aspect\" is 1.5", "200 x 100"}) == 1);
    CHECK(read(path + entries(", \"camera_type\": \"fisheye\"")).tells({"\"camera_type\""}) == 1);
    CHECK(read("{\"render_width\": 2, \"render_height\": 1, \"crop\": {}, " + entries("")).tells({"\"crop\""}) == 1);
}

TEST_CASE("poses as somebody inverted or printed them")
{
    const std::string file = kSize + "\"fl_x\": 150, ";
    const Camera exact = read(transforms(file)).cameras[1];
    for (const char* matrix :
         {"[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6]]", "[1, 0, 0, 4, 0, 1, 0, 5, 0, 0, 1, 6, 0, 0, 0, 1]",
          "[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [1e-17, 0, -3e-9, 1]]",
          "[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0, 0, 0.99999994]]",
          "[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [-0.0, 1e-6, 0, 1.000001]]"}) {
        CAPTURE(matrix);
        const Read found = read(transforms(file, "", matrix));
        CHECK(found.told.empty());
        CHECK(std::ranges::equal(found.cameras[1].translation, exact.translation));
        CHECK(std::ranges::equal(found.cameras[1].rotation, exact.rotation));
    }
    const Camera rounded =
        read(transforms(file, "", "[[0.9998, 1e-4, 0, 4], [0, 1.0002, 0, 5], [0, 0, 1, 6], [0, 0, 0, 1]]")).cameras[1];
    CHECK(rounded.translation[0] == doctest::Approx(exact.translation[0]).epsilon(1e-3));
    CHECK(refusal(transforms(file, "", "[[1, 0, 0, 4], [0, 1, 0, 5], [0, 0, 1, 6], [0, 0.01, 0, 1]]")) ==
          ErrorCode::InvalidFile);
    CHECK(refusal(transforms(file, "", "[1, 0, 0, 4]")) == ErrorCode::InvalidFile);
}

TEST_CASE("applied_transform and applied_scale: kept and told, or undone")
{
    // the second frame's pose of transforms(), moved: axes in turn, a shift, all places twice as far
    const std::string moved = "[[0, 0, 1, 14], [1, 0, 0, 10], [0, 1, 0, 8], [0, 0, 0, 1]]";
    const std::string applied = "\"applied_transform\": [[0, 0, 1, 1], [1, 0, 0, 1], [0, 1, 0, -1]], ";
    const std::string lens = kSize + "\"fl_x\": 150, ";
    const std::string file = transforms(lens + applied + "\"applied_scale\": 2, ", "", moved);
    const Camera original = read(transforms(lens)).cameras[1];

    const Read kept = read(file);
    CHECK(kept.told.size() == 1);
    CHECK(kept.tells({"f.json: \"applied_transform\", \"applied_scale\"", "--cameras-transform undo"}) == 1);
    CHECK(kept.tells({"gsc-play"}) == 0); // gsc export and others have the option too
    const Read asked = read(file, CamerasTransform::Keep);
    CHECK(asked.told.empty());
    for (const Read* as_it_stands : {&kept, &asked})
        CHECK(as_it_stands->cameras[1].translation[0] == doctest::Approx(-10));

    const Read undone = read(file, CamerasTransform::Undo);
    CHECK(undone.told.empty());
    for (int i = 0; i < 9; ++i)
        CHECK(undone.cameras[1].rotation[i] == doctest::Approx(original.rotation[i]));
    for (int i = 0; i < 3; ++i)
        CHECK(undone.cameras[1].translation[i] == doctest::Approx(original.translation[i]));

    // four rows; a scale within the transform moves places alone
    const Camera scaled = read(transforms(lens + "\"applied_transform\": [[2, 0, 0, 0], [0, 2, 0, 0], [0, 0, 2, 0], "
                                                 "[0, 0, 0, 1]], ",
                                          "", "[[1, 0, 0, 8], [0, 1, 0, 10], [0, 0, 1, 12], [0, 0, 0, 1]]"),
                               CamerasTransform::Undo)
                              .cameras[1];
    CHECK(scaled.translation[0] == doctest::Approx(original.translation[0]));
    CHECK(scaled.rotation[0] == doctest::Approx(1));

    CHECK(read(transforms(lens + "\"applied_scale\": 0.5, ")).tells({"f.json: \"applied_scale\": "}) == 1);
    CHECK(read(transforms(lens + "\"applied_scale\": 1.0, \"applied_transform\": [[1, 0, 0, 0], [0, 1, 0, 0], "
                                 "[0, 0, 1, 0]], "))
              .told.empty());
    CHECK(read(transforms(lens), CamerasTransform::Undo).tells({"\"applied_transform\"", "to undo"}) == 1);
    const std::string mirror = transforms(lens + "\"applied_transform\": [[0, 1, 0, 0], [1, 0, 0, 0], [0, 0, 1, 0]], ");
    CHECK(refusal(mirror, CamerasTransform::Undo) == ErrorCode::Unsupported);
    CHECK(refusal(mirror) == ErrorCode::Ok);
    CHECK(refusal(transforms(lens + "\"applied_transform\": 3, ")) == ErrorCode::InvalidFile);
    CHECK(refusal(transforms(lens + "\"applied_scale\": 0, ")) == ErrorCode::InvalidFile);
}
