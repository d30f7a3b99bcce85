// SPDX-License-Identifier: Apache-2.0
#include "convert/sample/scenes/scene.h"

namespace gsc {

Vec3 sunDirection(SampleScene scene)
{
    return normalized(scene == SampleScene::Street ? Vec3{0.45, -0.5, 0.75} : Vec3{-0.62, -0.42, 0.62});
}

SceneSpec planScene(const SampleOptions& options)
{
    switch (options.scene) {
    case SampleScene::City:
        return planCity(options);
    case SampleScene::Street:
        return planStreet(options);
    case SampleScene::Room:
        return planRoom(options);
    }
    return {};
}

void buildTile(const SceneSpec& spec, uint32_t tile, SceneTile& out)
{
    out = SceneTile{};
    switch (spec.scene) {
    case SampleScene::City:
        buildCityTile(spec, tile, out);
        break;
    case SampleScene::Street:
        buildStreetTile(spec, tile, out);
        break;
    case SampleScene::Room:
        buildRoomTile(spec, tile, out);
        break;
    }
    out.own_boxes = out.boxes.size();
}

void addNeighbourOccluders(const SceneSpec& spec, uint32_t tile, SceneTile& out)
{
    std::vector<uint32_t> neighbours;
    const Vec3 sun = sunDirection(spec.scene);
    if (spec.scene == SampleScene::City && tile < spec.main_tiles) {
        // the highest tower throws its shadow over two blocks
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

SceneCameras sceneCameras(const SceneSpec& spec)
{
    switch (spec.scene) {
    case SampleScene::City:
        return cityCameras(spec);
    case SampleScene::Street:
        return streetCameras(spec);
    case SampleScene::Room:
        return roomCameras(spec);
    }
    return {};
}

} // namespace gsc
