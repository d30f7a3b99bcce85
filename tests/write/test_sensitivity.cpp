// SPDX-License-Identifier: Apache-2.0
// Section SENS: what the kernel computes of the finished file, rounded up, whatever order it was written in.
#include <gsc/half.h>
#include "kernels/sensitivity/sensitivity.h"
#include "tests/write/memory_model.h"
#include "tests/write/model_view.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

// The next half below, or 0.
float below(uint16_t half)
{
    return half > 0 ? halfToFloat(uint16_t(half - 1)) : -1;
}

void checkSection(const Written& written)
{
    const GscView& view = written.view;
    REQUIRE(view.sensitivity.size() == view.header->anchor_count);
    std::vector<ChunkArrays> arrays;
    const ModelView model = modelView(view, arrays);
    const int32_t appearance = model.embedding != nullptr ? 0 : -1;
    SensitivityScratch scratch;
    size_t positive = 0;
    for (uint32_t c = 0; c < view.chunks.size(); ++c) {
        const ChunkRecord& chunk = view.chunks[c];
        std::vector<float> direction(chunk.anchor_count), distance(chunk.anchor_count);
        viewSensitivityCpu(model, c, 0, chunk.anchor_count, appearance, direction.data(), distance.data(), scratch);
        float most = 0;
        for (uint32_t i = 0; i < chunk.anchor_count; ++i) {
            const AnchorSensitivity& s = view.sensitivity[chunk.anchor_first + i];
            CHECK(halfToFloat(s.direction) >= direction[i]);
            CHECK(below(s.direction) < direction[i]);
            CHECK(halfToFloat(s.distance) >= distance[i]);
            CHECK(below(s.distance) < distance[i]);
            CHECK((s.distance > 0) <= takesDistance(model));
            positive += s.direction > 0;
            most = std::max(most, halfToFloat(s.direction));
        }
        CHECK(chunk.view_sensitivity == most);
    }
    CHECK(positive > view.sensitivity.size() / 2);
    for (const GroupRecord& group : view.groups) {
        float most = 0;
        for (uint32_t i = 0; i < group.anchor_count; ++i)
            most = std::max(most, halfToFloat(view.sensitivity[group.anchor_first + i].direction));
        CHECK(group.view_sensitivity == most);
    }
}

ModelShape everything(uint32_t levels)
{
    ModelShape shape;
    shape.anchors = 700;
    shape.levels = levels;
    shape.feat_dim = 12;
    shape.n_offsets = 5;
    shape.appearance_dim = 9;
    shape.appearance_rows = 4;
    shape.feature_bank = shape.distance = shape.level_input = true;
    return shape;
}

} // namespace

TEST_CASE("sensitivities are those of the finished file, rounded up, with and without levels and every input")
{
    ModelShape octree;
    octree.levels = 3;
    for (const ModelShape& shape : {ModelShape{}, octree, everything(0), everything(3)})
        for (const uint64_t chunk_anchors : {60, 16384}) {
            WriteOptions options;
            options.chunk_anchors = chunk_anchors;
            const Written written = writeModel(makeModel(shape), options);
            checkSection(written);
            CHECK(written.report.sensitivity_seconds > 0);
            CHECK(written.view.manifest.find("\"method\": \"sampled\"") != std::string::npos);
        }
}

TEST_CASE("the appearance is the first row that is kept, and the manifest names it")
{
    const MemoryModel model = makeModel(everything(3));
    const Written all = writeModel(model);
    CHECK(all.view.manifest.find("\"appearance\": 0,") != std::string::npos);
    WriteOptions options;
    options.appearance = 2;
    const Written one = writeModel(model, options);
    checkSection(one);
    const size_t at = one.view.manifest.find("\"sensitivity\": {");
    REQUIRE(at != std::string::npos);
    CHECK(one.view.manifest.find("\"appearance\": 2,", at) != std::string::npos);
    CHECK(std::memcmp(one.view.sensitivity.data(), all.view.sensitivity.data(), all.view.sensitivity.size_bytes()) !=
          0);
}

TEST_CASE("without sensitivities the file has no section and records say so")
{
    const MemoryModel model = makeModel({});
    WriteOptions options;
    options.sensitivity = SensitivityMode::None;
    const Written none = writeModel(model, options), sampled = writeModel(model);
    CHECK(none.view.sensitivity.empty());
    CHECK(none.report.sensitivity_seconds == 0);
    CHECK(none.view.manifest.find("\"sensitivity\": null") != std::string::npos);
    for (const SectionEntry& entry : none.view.sections)
        CHECK(entry.type != kSectionSensitivity);
    for (const GroupRecord& group : none.view.groups)
        CHECK(group.view_sensitivity == 0);
    for (const ChunkRecord& chunk : none.view.chunks)
        CHECK(chunk.view_sensitivity == 0);
    CHECK(none.view.header->config_hash != sampled.view.header->config_hash);
    // a reader that does not know the section may skip it
    for (const SectionEntry& entry : sampled.view.sections)
        CHECK((entry.flags == kSectionOptional) == (entry.type == kSectionSensitivity));
}
