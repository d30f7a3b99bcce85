// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/compare_checkpoint.h"
#include "convert/bake/grid_fit.h"
#include "tests/bake/memory_model.h"
#include "tests/support/checkpoints.h"

#include <doctest/doctest.h>

using namespace gsc;
using namespace gsc::test;

TEST_CASE("trap 13: every anchor of every trained model is on its grid, bit for bit")
{
    for (const std::string& path : trainedModels()) {
        CAPTURE(path);
        const Checkpoint checkpoint = readCheckpoint(path, {});
        const auto source = openAnchors(checkpoint);
        std::vector<GridSample> all;
        AnchorBatch batch;
        while (source->next(batch, kAnchorPlacement, 4096))
            for (size_t i = 0; i < 3 * batch.count; ++i)
                all.push_back({batch.position[i], batch.level[i / 3]});
        for (const float voxel_size : {checkpoint.voxel_size, 0.0f}) {
            std::vector<GridSample> samples = all;
            const auto grid =
                fitGrid(samples, {voxel_size, checkpoint.fork, (checkpoint.flags & kModelHasLevels) != 0});
            REQUIRE(grid);
            size_t misses = 0;
            for (const GridSample& s : all)
                misses += locateOnGrid(s.value, levelQuantum(grid->voxel_size, checkpoint.fork, s.level), grid->origin)
                              ? 0
                              : 1;
            CHECK(misses == 0);
        }
    }
}

TEST_CASE("trained models bake exactly, the same with one thread and two")
{
    for (const std::string& path : trainedModels()) {
        CAPTURE(path);
        const Checkpoint checkpoint = readCheckpoint(path, {});
        const TemporaryFolder folder;
        BakeOptions options;
        options.output = folder / "one.gsc";
        options.threads = 1;
        const BakeReport report = bake(checkpoint, options, {});
        CHECK(report.exact_grid);
        CHECK(report.warnings.empty());
        CHECK(report.anchors == checkpoint.anchor_count);
        const std::string one = openBaked(options.output).bytes();
        const CompareReport comparison = compareCheckpoint(checkpoint, options.output, {});
        INFO(comparison.summary());
        CHECK(comparison.equal);
        CHECK(comparison.anchors == checkpoint.anchor_count);

        options.output = folder / "two.gsc";
        options.threads = 2;
        options.memory_budget = 1 << 20;
        bake(checkpoint, options, {});
        CHECK(openBaked(options.output).bytes() == one);
    }
}
