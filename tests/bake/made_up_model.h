// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "convert/bake/bake.h"
#include "convert/write/write_gsc.h"
#include "sample/sample_tools.h"

#include <doctest/doctest.h>

#include <string>

namespace gsc::test {

// A made-up model as a file, and what is made of it.
struct MadeUpModel {
    explicit MadeUpModel(SampleScene scene = SampleScene::Room, SampleModel kind = SampleModel::Scaffold)
    {
        SampleOptions options = sampleOptions(scene, kind, 1500, folder / "model");
        options.everything_on = kind == SampleModel::Octree;
        REQUIRE(tryMake(options).code == ErrorCode::Ok);
        WriteOptions bake_options;
        bake_options.output = whole();
        Checkpoint checkpoint = readCheckpoint(folder / "model", {});
        for (size_t k = 0; k < 2; ++k) // slots that are alive nowhere
            checkpoint.mlps[0].layers[1].bias[k] = -100;
        (void)writeGsc(checkpoint, bake_options, {});
    }

    [[nodiscard]] std::string whole() const { return folder / "whole.gsc"; }

    [[nodiscard]] BakeOptions options(const char* output, int threads = 2) const
    {
        BakeOptions result;
        result.input = result.name = whole();
        result.output = folder / output;
        result.threads = threads;
        result.limits = {12, 4, 4, 20'000};
        result.device = {"cpu"};
        return result;
    }

    TemporaryFolder folder;
};

} // namespace gsc::test
