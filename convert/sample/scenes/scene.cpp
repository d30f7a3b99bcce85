// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/scenes/scene.h"

#include "convert/sample/scenes/scene_parts.h"

namespace gsc {

namespace {

struct SceneMaker {
    void (*plan)(uint64_t anchors, SceneSpec& spec);
    void (*build)(const SceneSpec& spec, uint32_t tile, SceneTile& out);
    std::vector<SourceCamera> (*cameras)(const SceneSpec& spec);
};

const SceneMaker& makerOf(SampleScene scene)
{
    static constexpr SceneMaker kMakers[] = {{planCity, buildCityTile, cityCameras},
                                             {planStreet, buildStreetTile, streetCameras},
                                             {planRoom, buildRoomTile, roomCameras}};
    return kMakers[size_t(scene)];
}

} // namespace

dvec3 sunDirection(SampleScene scene)
{
    return normalized(scene == SampleScene::Street ? dvec3{0.45, -0.5, 0.75} : dvec3{-0.62, -0.42, 0.62});
}

SceneSpec planScene(SampleScene scene, uint64_t anchors, uint64_t seed)
{
    SceneSpec spec;
    spec.scene = scene;
    spec.seed = seed;
    makerOf(scene).plan(anchors, spec);
    return spec;
}

void buildTile(const SceneSpec& spec, uint32_t tile, SceneTile& out)
{
    out = SceneTile{};
    if (tile < spec.main_tiles)
        makerOf(spec.scene).build(spec, tile, out);
    else
        addSurroundings(spec, tile - spec.main_tiles, out);
}

void addNeighbourOccluders(const SceneSpec& spec, uint32_t tile, SceneTile& out)
{
    std::vector<uint32_t> neighbours;
    const dvec3 sun = sunDirection(spec.scene);
    if (spec.scene == SampleScene::City && tile < spec.main_tiles) {
        // the highest tower casts its shadow over two blocks: adds the blocks up to two away towards the sun
        const int column = int(tile % spec.side), row = int(tile / spec.side);
        for (int j = -1; j <= 2; ++j)
            for (int i = -1; i <= 2; ++i) {
                const int c = column + (sun.x < 0 ? -i : i), r = row + (sun.y < 0 ? -j : j);
                if ((i || j) && c >= 0 && r >= 0 && c < int(spec.side) && r < int(spec.side))
                    neighbours.push_back(uint32_t(r) * spec.side + uint32_t(c));
            }
    } else if (spec.scene == SampleScene::Street && tile < spec.main_tiles) {
        for (uint32_t i = 0; i < spec.main_tiles; ++i)
            if (i != tile && std::abs(int(i / 2) - int(tile / 2)) <= 3)
                neighbours.push_back(i);
    }
    SceneTile other;
    for (const uint32_t i : neighbours) {
        buildTile(spec, i, other);
        out.boxes.insert(out.boxes.end(), other.boxes.begin(), other.boxes.end());
        out.blobs.insert(out.blobs.end(), other.blobs.begin(), other.blobs.end());
    }
}

std::vector<SourceCamera> sceneCameras(const SceneSpec& spec)
{
    return makerOf(spec.scene).cameras(spec);
}

SourceCamera photograph(dvec3 from, dvec3 to, double fov_x)
{
    return lookingAlong(from, normalized(to - from), {0, 0, 1}, 1280, 720, fov_x * kPi / 180);
}

} // namespace gsc
