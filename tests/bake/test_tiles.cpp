// SPDX-License-Identifier: Apache-2.0
// Tiles that are cut and joined again give the same file, and files that cannot be joined are refused by name.
#include "convert/bake/bake.h"
#include "convert/bake/tiles/tiles.h"
#include "convert/write/write_gsc.h"
#include <gsc/error.h>
#include <gsc/gsc_file.h>
#include "runtime/cameras/scene_cameras.h"
#include "runtime/cpu/renderer_cpu.h"
#include <gsc/scene.h>
#include "sample/sample_tools.h"
#include "tests/bake/opened.h"

#include <doctest/doctest.h>
#include "runtime/frames/shot.h"

#include <algorithm>

using namespace gsc;
using namespace gsc::test;

namespace {

constexpr double kFar = 1e30;

void convertTo(const std::string& model, const std::string& output, const WriteOptions& how = {}, float bias = 0)
{
    Checkpoint checkpoint = readCheckpoint(model, {});
    checkpoint.mlps[0].layers[1].bias[0] = -100; // a slot that is alive nowhere
    checkpoint.mlps[1].layers[1].bias[2] += bias;
    WriteOptions options = how;
    options.output = output;
    (void)writeGsc(checkpoint, options, {});
}

struct Model {
    explicit Model(SampleModel kind = SampleModel::Scaffold)
    {
        SampleOptions options = sampleOptions(SampleScene::Street, kind, 1500, source());
        options.everything_on = kind == SampleModel::Octree;
        REQUIRE(tryMake(options).code == ErrorCode::Ok);
        convertTo(source(), folder / "whole.gsc");
    }

    [[nodiscard]] std::string source() const { return folder / "model"; }
    [[nodiscard]] std::string bytes(const std::string& name) const { return readText(folder / name); }

    [[nodiscard]] TileReport join(const std::vector<std::string>& names, const std::string& output,
                                  const std::optional<CropBox>& crop = {}, int threads = 2) const
    {
        TileOptions options;
        for (const std::string& name : names)
            options.inputs.push_back(folder / name);
        options.names = names;
        options.output = folder / output;
        options.crop = crop;
        options.threads = threads;
        return joinTiles(options, {});
    }

    TemporaryFolder folder;
};

// Message of the Error that joining them throws; empty if they were joined.
std::string refusal(const Model& model, const std::vector<std::string>& names, ErrorCode expected,
                    const std::optional<CropBox>& crop = {})
{
    const size_t before = model.folder.names().size();
    try {
        (void)model.join(names, "refused.gsc", crop);
    } catch (const Error& error) {
        CHECK(error.code() == expected);
        CHECK(model.folder.names().size() == before);
        return error.what();
    }
    return "";
}

// Boxes that meet in the middle of the anchors. Returns those that hold some.
std::vector<std::string> cutInEight(const Model& model, const std::string& name)
{
    const Opened whole(model.folder / name);
    const ModelParams& p = *whole.view.params;
    std::vector<std::string> tiles;
    for (int octant = 0; octant < 8; ++octant) {
        CropBox box;
        for (size_t axis = 0; axis < 3; ++axis) {
            const double middle = 0.5 * (double(p.bounds_min[axis]) + double(p.bounds_max[axis]));
            box.from[axis] = octant >> axis & 1 ? middle : -kFar;
            box.to[axis] = octant >> axis & 1 ? kFar : middle;
        }
        const std::string tile = "tile" + std::to_string(octant) + ".gsc";
        try {
            const TileReport report = model.join({name}, tile, box);
            CHECK(report.whole_anchors == whole.view.header->anchor_count);
            CHECK(!report.is_whole);
            tiles.push_back(tile);
        } catch (const Error& error) {
            CHECK(error.code() == ErrorCode::Usage); // empty
        }
    }
    REQUIRE(tiles.size() >= 3);
    return tiles;
}

} // namespace

TEST_CASE("a model that was cut in boxes and joined again is the same file")
{
    for (const SampleModel kind : {SampleModel::Scaffold, SampleModel::Octree}) {
        CAPTURE(int(kind));
        const Model model(kind);
        std::vector<std::string> tiles = cutInEight(model, "whole.gsc");
        std::ranges::reverse(tiles); // in any order
        const TileReport report = model.join(tiles, "again.gsc");
        CHECK(report.is_whole);
        CHECK(model.bytes("again.gsc") == model.bytes("whole.gsc"));

        // some of them, then the rest
        const std::vector<std::string> some(tiles.begin(), tiles.begin() + 2), rest(tiles.begin() + 2, tiles.end());
        CHECK(!model.join(some, "some.gsc").is_whole);
        (void)model.join(rest, "rest.gsc", {}, 1);
        (void)model.join(rest, "rest3.gsc", {}, 3);
        CHECK(model.bytes("rest.gsc") == model.bytes("rest3.gsc"));
        CHECK(model.join({"some.gsc", "rest.gsc"}, "both.gsc").is_whole);
        CHECK(model.bytes("both.gsc") == model.bytes("whole.gsc"));
    }
}

TEST_CASE("masked slots and what bake said of a file stay")
{
    const Model model;
    BakeOptions options;
    options.input = options.name = model.folder / "whole.gsc";
    options.output = model.folder / "baked.gsc";
    options.limits = {12, 4, 4, 20'000};
    options.device = {"cpu"};
    CHECK(bake(options, {}).slots_masked > 0);
    const std::vector<std::string> tiles = cutInEight(model, "baked.gsc");
    CHECK(model.join(tiles, "again.gsc").is_whole);
    CHECK(model.bytes("again.gsc") == model.bytes("baked.gsc"));
    const Opened tile(model.folder / tiles[0]);
    CHECK((tile.view.params->flags & kModelMaskedSlots) != 0);
    CHECK(tile.view.manifest.find("\"reduction\"") != std::string_view::npos);
    CHECK(tile.view.manifest.find("\"crop\"") != std::string_view::npos);
}

TEST_CASE("a tile knows the rows of its model, and a tile of a tile too")
{
    const Model model;
    const Opened whole(model.folder / "whole.gsc");
    const float low = whole.view.params->bounds_min[0], high = whole.view.params->bounds_max[0];
    const auto slab = [&](double from, double to) {
        return CropBox{{double(low) + from * double(high - low), -kFar, -kFar},
                       {double(low) + to * double(high - low), kFar, kFar}};
    };
    const uint64_t wide = model.join({"whole.gsc"}, "wide.gsc", slab(0.2, 0.8)).anchors;
    const TileReport narrow = model.join({"wide.gsc"}, "narrow.gsc", slab(0.4, 2));
    CHECK(narrow.anchors < wide);
    const Opened tile(model.folder / "narrow.gsc");
    REQUIRE(tile.view.tile != nullptr);
    CHECK(tile.view.tile->whole == whole.view.header->header_checksum);
    CHECK(tile.view.manifest.find("\"whole_anchors\": 1500") != std::string_view::npos);
    // every row is that of the model: the same place in space
    for (size_t i = 0; i < tile.view.tile_rows.size(); ++i) {
        CHECK(tile.view.tile_rows[i] < 1500);
        CHECK((i == 0 || tile.view.tile_rows[i] > tile.view.tile_rows[i - 1]));
    }
    (void)model.join({"whole.gsc"}, "direct.gsc", slab(0.4, 0.8));
    const Opened direct(model.folder / "direct.gsc");
    CHECK(std::ranges::equal(direct.view.tile_rows, tile.view.tile_rows));
    // all of it in one box: not a tile
    CHECK(model.join({"whole.gsc"}, "all.gsc", CropBox{{-kFar, -kFar, -kFar}, {kFar, kFar, kFar}}).is_whole);
}

TEST_CASE("what cannot be joined is refused, saying which and what")
{
    const Model model;
    const Opened whole(model.folder / "whole.gsc");
    const double middle = 0.5 * (double(whole.view.params->bounds_min[0]) + double(whole.view.params->bounds_max[0]));
    (void)model.join({"whole.gsc"}, "left.gsc", CropBox{{-kFar, -kFar, -kFar}, {middle, kFar, kFar}});
    CHECK(refusal(model, {"left.gsc", "whole.gsc"}, ErrorCode::Difference).find("whole.gsc: row ") == 0);
    convertTo(model.source(), model.folder / "other.gsc", {}, 1);
    const std::string networks = refusal(model, {"left.gsc", "other.gsc"}, ErrorCode::Difference);
    CHECK(networks.find("other.gsc: network cov_mlp: bias of layer 1[2] is ") == 0);
    CHECK(networks.find("as in left.gsc") != std::string::npos);
    REQUIRE(tryMake(sampleOptions(SampleScene::Street, SampleModel::Octree, 500, model.folder / "octree")).code ==
            ErrorCode::Ok);
    convertTo(model.folder / "octree", model.folder / "octree.gsc");
    CHECK(
        refusal(model, {"left.gsc", "octree.gsc"}, ErrorCode::Difference).find("octree.gsc: family is 2, expected 0") ==
        0);
    CHECK(refusal(model, {"left.gsc"}, ErrorCode::Usage, CropBox{{middle, -kFar, -kFar}, {kFar, kFar, kFar}})
              .find("--crop: no anchor of left.gsc lies in the box") == 0);
}

TEST_CASE("tiles that were never one file follow each other")
{
    const Model model;
    WriteOptions how;
    how.chunk_anchors = 64; // another file, so another model as far as anybody knows
    convertTo(model.source(), model.folder / "more.gsc", how);
    const TileReport report = model.join({"whole.gsc", "more.gsc"}, "twice.gsc");
    CHECK(report.anchors == 3000);
    CHECK(report.whole_anchors == 0);
    CHECK(!report.in_source_order);
    const Opened twice(model.folder / "twice.gsc"), once(model.folder / "whole.gsc");
    CHECK(twice.view.tile == nullptr);
    CHECK(twice.view.cameras.size() == once.view.cameras.size()); // those of both are the same
    CHECK(twice.view.manifest.find("\"tiles\"") != std::string_view::npos);
}

TEST_CASE("a tile draws what the whole does where nothing else is seen")
{
    const Model model(SampleModel::Octree);
    const std::vector<std::string> tiles = cutInEight(model, "whole.gsc");
    (void)model.join({tiles.begin() + 1, tiles.end()}, "rest.gsc");
    std::vector<std::vector<float>> pictures;
    for (const std::string& name : {std::string("whole.gsc"), tiles[0], std::string("rest.gsc")}) {
        const std::shared_ptr<const Scene> scene = Scene::open(model.folder / name);
        const auto renderer = makeCpuRenderer(CpuPath::Fast, 2);
        renderer->load(scene);
        std::vector<float>& all = pictures.emplace_back();
        for (Camera camera : sceneCameras(*scene, "stored", {})) {
            camera.width = 96;
            camera.height = 64;
            std::vector<float> pixels(size_t(3) * camera.width * camera.height);
            float* image = pixels.data();
            const EyeParams eye = eyeParams(camera, scene->view().origin);
            (void)render(*renderer, {&eye, 1}, exactOptionsFor(*scene, camera), &image);
            all.insert(all.end(), pixels.begin(), pixels.end());
        }
    }
    size_t alone = 0, differ = 0;
    for (size_t i = 0; i < pictures[0].size(); ++i) {
        if (pictures[2][i] != 0) // something else
            continue;
        alone += pictures[1][i] != 0;
        differ += pictures[0][i] != pictures[1][i];
    }
    CHECK(alone > 100);
    CHECK(differ == 0);
}
