// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/compare_checkpoint.h"
#include "tests/write/memory_model.h"

#include <doctest/doctest.h>

#include <cmath>
#include <functional>

using namespace gsc;
using namespace gsc::test;

namespace {

struct Change {
    const char* attribute; // nullptr = a problem instead
    uint64_t first;
    std::function<void(MemoryModel&)> apply;
};

const AttributeDifference* find(const CompareReport& report, const std::string& name)
{
    for (const AttributeDifference& a : report.attributes)
        if (a.name == name)
            return &a;
    return nullptr;
}

} // namespace

TEST_CASE("one changed bit anywhere is found, counted and located")
{
    ModelShape shape;
    shape.anchors = 700;
    shape.levels = 2;
    shape.appearance_dim = 3;
    shape.appearance_rows = 4;
    MemoryModel model = makeModel(shape);
    SourceCamera camera;
    camera.name = "a";
    camera.width = camera.height = 10;
    camera.fx = camera.fy = 7;
    camera.rotation[0] = camera.rotation[4] = camera.rotation[8] = 1;
    model.checkpoint.cameras = {camera};
    const Written written = writeModel(model);

    const auto bump = [](float& value) { value = std::nextafter(value, 1e30f); };
    const Change changes[] = {
        {"position", 600, [&](MemoryModel& m) { bump(m.anchors.position[3 * 600 + 2]); }},
        {"level", 3, [&](MemoryModel& m) { m.anchors.level[3] ^= 1; }},
        {"extra_level", 699, [&](MemoryModel& m) { bump(m.anchors.extra_level[699]); }},
        {"scale", 0, [&](MemoryModel& m) { bump(m.anchors.scale[5]); }},
        {"offset", 123, [&](MemoryModel& m) { bump(m.anchors.offset[9 * 123 + 4]); }},
        {"feature", 500, [&](MemoryModel& m) { bump(m.anchors.feature[8 * 500]); }},
        {"rotation", 500, [&](MemoryModel& m) { m.anchors.rotation[4 * 500 + 1] = -0.0f; }},
        {"opacity", 12, [&](MemoryModel& m) { bump(m.anchors.opacity[12]); }},
        {"normal", 12, [&](MemoryModel& m) { m.anchors.normal[36] = -0.0f; }},
        {"color_mlp.weight0", 9, [&](MemoryModel& m) { bump(m.checkpoint.mlps[2].layers[0].weight[9]); }},
        {"opacity_mlp.bias1", 2, [&](MemoryModel& m) { bump(m.checkpoint.mlps[0].layers[1].bias[2]); }},
        {"embedding", 7, [&](MemoryModel& m) { bump(m.checkpoint.embedding[7]); }},
        {"camera.focal", 1, [&](MemoryModel& m) { m.checkpoint.cameras[0].fy = 7.5; }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.cameras[0].name.append("b"); }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.cameras.clear(); }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.standard_dist = 11; }},
        {nullptr, 0, [&](MemoryModel& m) { bump(m.checkpoint.voxel_size); }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.fork = 3; }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.level_clamp = 2; }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.level_rule = LevelRule::Floor; }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.flags &= ~uint32_t(kModelLodHalfCell); }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.mlps[1].activation = Activation::Tanh; }},
        {nullptr, 0, [&](MemoryModel& m) { m.checkpoint.feat_dim = 9; }},
        {nullptr, 0, [&](MemoryModel& m) { m.removeAnchor(699); }},
    };
    for (const Change& change : changes) {
        MemoryModel changed = model;
        change.apply(changed);
        MemorySource source(changed);
        const CompareReport report = compareCheckpoint(changed.checkpoint, source, written.view, {});
        INFO(report.summary());
        CHECK_FALSE(report.equal);
        CHECK(report.summary() != "no difference");
        if (!change.attribute) {
            CHECK_FALSE(report.problems.empty());
            continue;
        }
        const AttributeDifference* found = find(report, change.attribute);
        REQUIRE(found);
        CHECK(found->different == 1);
        CHECK(found->first == change.first);
        CHECK(std::isfinite(found->max_abs));
        for (const AttributeDifference& other : report.attributes)
            if (&other != found)
                CHECK(other.different == 0);
    }
    MemorySource source(model);
    const CompareReport report = compareCheckpoint(model.checkpoint, source, written.view, {});
    CHECK(report.equal);
    REQUIRE(find(report, "feature"));
    CHECK(find(report, "feature")->compared == 700 * 8);
}

TEST_CASE("anchors that the file does not have are told as a number, and all others are compared")
{
    ModelShape shape;
    shape.anchors = 700;
    const MemoryModel model = makeModel(shape);
    MemoryModel less = model;
    less.removeAnchor(699);
    const Written written = writeModel(less);
    MemorySource source(model);
    const CompareReport report = compareCheckpoint(model.checkpoint, source, written.view, {});
    REQUIRE(report.problems.size() == 1);
    CHECK(report.problems[0] == "the checkpoint has 700 anchors, the file 699");
    CHECK(report.anchors == 699);
    for (const AttributeDifference& attribute : report.attributes)
        CHECK(attribute.different == 0);
    REQUIRE(find(report, "feature"));
    CHECK(find(report, "feature")->compared == 699 * 8);
}

TEST_CASE("models of another shape are told apart and not compared anchor by anchor")
{
    ModelShape shape;
    shape.anchors = 100;
    shape.appearance_dim = 3;
    shape.appearance_rows = 4;
    const MemoryModel model = makeModel(shape);
    const Written written = writeModel(model);
    const std::function<void(Checkpoint&)> changes[] = {
        [](Checkpoint& c) { c.feat_dim = 9; }, [](Checkpoint& c) { c.n_offsets = 4; },
        [](Checkpoint& c) { c.appearance_dim = 2; }, [](Checkpoint& c) { c.mlps.pop_back(); }};
    for (const auto& change : changes) {
        MemoryModel changed = model;
        change(changed.checkpoint);
        MemorySource source(changed);
        const CompareReport report = compareCheckpoint(changed.checkpoint, source, written.view, {});
        CHECK(report.problems.size() == 1);
        CHECK(report.attributes.empty());
    }
}
