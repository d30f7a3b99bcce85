// SPDX-License-Identifier: Apache-2.0
// Content of a file at a point, against every anchor looked at.
#include "convert/grids/locate.h"
#include "tests/write/memory_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <random>

using namespace gsc;
using namespace gsc::test;

namespace {

const IssueSink kNoIssue = [](const Issue& issue) { FAIL(issue.info->name); };

double distanceTo(const std::array<double, 3>& point, const float (&position)[3])
{
    double squared = 0;
    for (size_t i = 0; i < 3; ++i)
        squared += (double(position[i]) - point[i]) * (double(position[i]) - point[i]);
    return std::sqrt(squared);
}

uint32_t sourceOf(const GscView& view, const ChunkRecord& chunk, uint32_t local)
{
    return *reinterpret_cast<const uint32_t*>(storedValue(view, chunk, ChunkArray::SourceIndex, local));
}

} // namespace

TEST_CASE("at an anchor: its own voxel, leaf, chunk and group, and the anchor itself is nearest")
{
    for (const uint32_t levels : {0u, 2u}) {
        ModelShape shape;
        shape.anchors = 2000;
        shape.levels = levels;
        shape.origin = -5.3f;
        WriteOptions options;
        options.chunk_anchors = 200;
        const Written written = writeModel(makeModel(shape), options);
        const GscView& view = written.view;
        for (size_t c = 0; c < view.chunks.size(); ++c)
            for (uint32_t i = 0; i < view.chunks[c].anchor_count; i += 7) {
                const ChunkRecord& chunk = view.chunks[c];
                float position[3];
                storedPosition(view, chunk, i, position);
                const std::array<double, 3> point{double(position[0]), double(position[1]), double(position[2])};
                const std::vector<PlaceInLevel> places = locate(view, point, kNoIssue);
                REQUIRE(places.size() == view.levels.size());
                const PlaceInLevel& place = places[chunk.level_index];
                CHECK(place.occupied);
                CHECK(place.anchors_in_voxel >= 1);
                REQUIRE(place.chunk == c);
                REQUIRE(place.leaf.has_value());
                const LeafRecord& leaf = view.leaves[*place.leaf];
                const uint32_t anchor = chunk.anchor_first + i, group = chunk.group_first + i / kGroupSize;
                CHECK(anchor - leaf.anchor_first < leaf.anchor_count);
                CHECK(group - place.group_first < place.group_count);
                CHECK(view.groups[place.group_first].anchor_first <= leaf.anchor_first);
                REQUIRE(place.nearest.has_value());
                CHECK(place.nearest->distance == 0);
                // several anchors may lie in one place
                CHECK(view.index[place.nearest->source] == place.nearest->anchor);
                if (place.anchors_in_voxel == 1) {
                    CHECK(place.nearest->anchor == anchor);
                    CHECK(place.nearest->source == sourceOf(view, chunk, i));
                    CHECK(place.nearest->group == group);
                }
            }
    }
}

TEST_CASE("at any point: the nearest anchor of each level, and a leaf where the voxel is occupied")
{
    ModelShape shape;
    shape.anchors = 1500;
    shape.levels = 3;
    shape.spread = 12;
    WriteOptions options;
    options.chunk_anchors = 100;
    const Written written = writeModel(makeModel(shape), options);
    const GscView& view = written.view;
    std::mt19937 random(5);
    std::uniform_real_distribution<double> inside(-0.15, 0.15), outside(-2, 2);
    uint32_t leaves = 0, none = 0;
    for (int n = 0; n < 150; ++n) {
        std::array<double, 3> point{};
        for (double& x : point)
            x = n % 2 ? inside(random) : outside(random);
        for (const PlaceInLevel& place : locate(view, point, kNoIssue)) {
            const LevelRecord& level = view.levels[place.level_index];
            double best = INFINITY;
            for (uint64_t c = level.chunk_first; c < level.chunk_first + level.chunk_count; ++c)
                for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i) {
                    float position[3];
                    storedPosition(view, view.chunks[c], i, position);
                    best = std::min(best, distanceTo(point, position));
                }
            REQUIRE(place.nearest.has_value());
            CHECK(place.nearest->distance == best);
            CHECK(place.occupied == (place.anchors_in_voxel > 0));
            CHECK((!place.occupied || place.leaf.has_value()));
            CHECK((!place.leaf || place.chunk.has_value()));
            ++(place.leaf ? leaves : none);
        }
    }
    CHECK(leaves > 10);
    CHECK(none > 50);
    for (const PlaceInLevel& place : locate(view, {1e30, 0, 0}, kNoIssue)) {
        CHECK_FALSE(place.voxel.has_value());
        CHECK(place.nearest->distance == doctest::Approx(1e30));
    }
}
