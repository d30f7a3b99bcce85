// SPDX-License-Identifier: Apache-2.0
// Models far from the world's origin: found, moved without a bit lost, and drawn as they are at the origin.
#include "runtime/model/local_model.h"
#include "tests/kernels/moved_model.h"
#include "tests/kernels/render_tools.h"

#include <doctest/doctest.h>

#include <cstring>
#include <optional>

using namespace gsc;
using namespace gsc::test;

namespace {

SyntheticOptions optionsOf(LevelRule rule)
{
    SyntheticOptions options = rule == LevelRule::None ? SyntheticOptions{} : octree(rule);
    options.anchors = 1500;
    return options;
}

// Every coordinate of every anchor.
std::vector<float> positionsOf(const ModelView& view)
{
    std::vector<float> positions;
    for (uint32_t c = 0; c < view.params->chunk_count; ++c)
        for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i) {
            const Vec3<float> p = anchorPosition(view, c, i);
            positions.insert(positions.end(), {p.x, p.y, p.z});
        }
    return positions;
}

bool inside(const float* p, const float* low, const float* high)
{
    return low[0] <= p[0] && p[0] <= high[0] && low[1] <= p[1] && p[1] <= high[1] && low[2] <= p[2] && p[2] <= high[2];
}

// Anchors outside a box that should hold them.
size_t strays(const ModelView& view)
{
    const std::vector<float> positions = positionsOf(view);
    size_t count = 0;
    for (uint32_t g = 0; g < view.params->group_count; ++g) {
        const GroupRecord& group = view.groups[g];
        const ChunkRecord& chunk = view.chunks[group.chunk];
        const LevelRecord& level = view.levels[group.level_index];
        for (uint32_t i = group.anchor_first; i < group.anchor_first + group.anchor_count; ++i) {
            const float* p = positions.data() + size_t(3) * i;
            count += !inside(p, group.anchor_min, group.anchor_max) + !inside(p, chunk.anchor_min, chunk.anchor_max) +
                     !inside(p, level.bounds_min, level.bounds_max) +
                     !inside(p, view.params->bounds_min, view.params->bounds_max);
        }
    }
    return count;
}

Image<float> shoot(Renderer& backend, const ModelView& view, const Camera& camera, FrameOptions options)
{
    backend.load(view);
    options.tier = Tier::Exact;
    return render(backend, {eyeParams(camera, view.origin)}, options)[0];
}

} // namespace

TEST_CASE("a model is far from 32 times its reach on, whatever a few strays do to its bounds")
{
    SyntheticOptions options{.anchors = 6000};
    SyntheticAnchors anchors = randomAnchors(options);
    const ModelParams params = syntheticParams(options);
    const SyntheticModel near(params, anchors, randomMlps(options), {}, 0);
    CHECK_FALSE(localOrigin(near.view()));
    const auto originAt = [&](int32_t x) {
        const int32_t cells[3] = {x, 0, -x / 2};
        const MovedModel moved(near.view(), cells);
        return localOrigin(moved.view());
    };
    // half the groups reach about as far as the model does
    const auto reach = int32_t(options.extent / params.voxel_size);
    CHECK_FALSE(originAt(int32_t(0.7 * kFarReaches) * reach));
    for (const double times : {1.3 * kFarReaches, 1e3, 2.5e4}) {
        const auto cells = int32_t(times * reach);
        const auto origin = originAt(cells);
        REQUIRE(origin);
        const double at = double(cells) * double(params.voxel_size);
        CHECK(std::abs((*origin)[0] - at) < 4);
        CHECK(std::abs((*origin)[1]) < 4);
        CHECK(std::abs((*origin)[2] + at / 2) < 4);
        for (const double coordinate : *origin)
            CHECK(double(float(coordinate)) == coordinate);
    }
    // an anchor in fifty lies anywhere between here and there
    Random random(5);
    for (size_t i = 0; i < options.anchors; ++i)
        for (size_t a = 0; a < 3; ++a)
            anchors.position[3 * i + a] += i % 50 == 0 ? random.uniform(-5000, 6000) : a == 0 ? 5000.0f : 0.0f;
    const SyntheticModel scattered(params, anchors, randomMlps(options), {}, 3);
    const auto origin = localOrigin(scattered.view());
    REQUIRE(origin);
    CHECK(std::abs((*origin)[0] - 5000) < 4);
}

TEST_CASE("positions and bounds of a far model are those it has at the origin")
{
    SyntheticOptions options{.anchors = 3000};
    ModelParams params = syntheticParams(options);
    params.grid_origin = 0;
    params.voxel_size = 0.01f; // no power of two: products round
    const SyntheticModel model(params, randomAnchors(options), randomMlps(options), {}, 4);
    int32_t cells[3];
    farCells(model.view(), cells);
    const MovedModel far(model.view(), cells);
    REQUIRE(localOrigin(far.view()));
    const std::vector<float> there = positionsOf(model.view()), rounded = positionsOf(far.view());
    double worst = 0;
    for (size_t i = 0; i < there.size(); ++i)
        worst = std::max(worst, std::abs(double(rounded[i]) - far.by()[i % 3] - double(there[i])));
    CHECK(worst > 3e-3); // error of the trainer's fp32
    const LocalModel back(far.view(), {far.by()[0], far.by()[1], far.by()[2]});
    CHECK(positionsOf(back.view()) == there);
    const LocalModel local(far.view(), *localOrigin(far.view()));
    for (const LocalModel* view : {&back, &local}) {
        CHECK(strays(view->view()) == 0);
        for (uint32_t g = 0; g < params.group_count; ++g)
            for (int a = 0; a < 3; ++a) {
                const GroupRecord &at = view->view().groups[g], &was = model.view().groups[g];
                CHECK(at.anchor_max[a] - at.anchor_min[a] < was.anchor_max[a] - was.anchor_min[a] + 0.2f);
                CHECK(at.gaussian_min[a] <= at.anchor_min[a]);
                CHECK(at.gaussian_max[a] >= at.anchor_max[a]);
            }
    }
    CHECK(chunkArrayLayout(*local.view().params, local.view().chunks[0].anchor_count).bytes ==
          local.view().chunks[0].payload_bytes);
}

TEST_CASE("float positions and zeros that are negative are moved too")
{
    SyntheticOptions options{.encoding = PositionEncoding::Float};
    SyntheticAnchors anchors = randomAnchors(options);
    for (size_t i = 0; i < anchors.position.size(); i += 3)
        anchors.position[i] += 70000;
    const SyntheticModel model(syntheticParams(options), anchors, randomMlps(options), {}, 0);
    const MovedModel floats(model.view(), {0, 0, 0});
    const auto origin = localOrigin(floats.view());
    REQUIRE(origin);
    const LocalModel local(floats.view(), *origin);
    const std::vector<float> from = positionsOf(floats.view()), to = positionsOf(local.view());
    size_t wrong = 0;
    for (size_t i = 0; i < from.size(); ++i) // the difference is exact along x, where the two are alike
        wrong += i % 3 == 0 ? double(to[i]) + (*origin)[0] != double(from[i])
                            : std::abs(double(to[i]) + (*origin)[i % 3] - double(from[i])) > 1e-6;
    CHECK(wrong == 0);
    CHECK(strays(local.view()) == 0);

    options.encoding = PositionEncoding::Grid;
    const SyntheticModel grid(options);
    ChunkArrays arrays = grid.view().arrays[0];
    std::vector<GridPosition> positions(arrays.grid_position,
                                        arrays.grid_position + grid.view().chunks[0].anchor_count);
    positions[2].flags = kNegativeZeroY;
    arrays.grid_position = positions.data();
    std::vector<ChunkArrays> all(grid.view().arrays, grid.view().arrays + grid.view().params->chunk_count);
    all[0] = arrays;
    ModelView view = grid.view();
    view.arrays = all.data();
    CHECK(anchorPosition(LocalModel(view, {0, 50, 0}).view(), 0, 2).y == -50);
}

TEST_CASE("100 km away, pictures are those of the origin, for every level rule and both rasterisers")
{
    FrameOptions options = onGrey();
    for (const RasterRules raster : {RasterRules::DiffGaussian, RasterRules::Gsplat})
        for (const LevelRule rule :
             {LevelRule::None, LevelRule::Floor, LevelRule::Round, LevelRule::Ceil, LevelRule::Progressive})
            for (const CpuPath path : {CpuPath::Fast, CpuPath::Reference}) {
                CAPTURE(int(raster));
                CAPTURE(int(rule));
                SyntheticOptions shape = optionsOf(rule);
                shape.raster_rules = raster;
                const SyntheticModel model(shape);
                int32_t cells[3];
                farCells(model.view(), cells);
                const MovedModel far(model.view(), cells);
                const auto origin = localOrigin(far.view());
                REQUIRE(origin);
                const LocalModel local(far.view(), *origin);
                const Camera camera = cameraAt(0.4f, -5, 150, 110), moved = movedCamera(camera, far.by());
                const std::unique_ptr<Renderer> backend = makeCpuRenderer(path, 1);
                const auto expected = shoot(*backend, model.view(), camera, options);
                const auto actual = shoot(*backend, local.view(), moved, options);
                const auto before = shoot(*backend, far.view(), moved, options);
                CHECK(expected.result.eyes[0].gaussians_visible > 500);
                CHECK(actual.result.eyes[0].anchors_visible == expected.result.eyes[0].anchors_visible);
                const double after_db = compare(actual.pixels, expected.pixels).psnr;
                const double before_db = compare(before.pixels, expected.pixels).psnr;
                CHECK(after_db >= 90);
                CHECK(before_db < 60);
            }
}

TEST_CASE("reuse, hysteresis and two eyes go 100 km as they go at the origin")
{
    SyntheticOptions shape = optionsOf(LevelRule::Round);
    shape.log_scale = -4;
    const SyntheticModel model(shape);
    int32_t cells[3];
    farCells(model.view(), cells);
    const MovedModel far(model.view(), cells);
    const LocalModel local(far.view(), localOrigin(far.view()).value());
    FrameOptions options;
    options.lod_hysteresis = 0.2f;
    for (const ReusePolicy policy : {ReusePolicy::None, ReusePolicy::Depth, ReusePolicy::Error})
        for (const bool hysteresis : {false, true}) {
            CAPTURE(int(policy));
            CAPTURE(hysteresis);
            options.lod_hysteresis = hysteresis ? 0.2f : 0.0f;
            options.reuse.policy = policy;
            const std::unique_ptr<Renderer> here = makeCpuRenderer(CpuPath::Fast, 1),
                                            there = makeCpuRenderer(CpuPath::Fast, 2);
            here->load(model.view());
            there->load(local.view());
            uint64_t decoded_here = 0, decoded_there = 0;
            for (int i = 0; i < 10; ++i) {
                std::vector<EyeParams> at_origin, moved;
                for (const float eye : {0.0f, 0.06f}) {
                    const Camera camera = cameraAt(0.4f + 0.01f * float(i) + eye, -5, 150, 110);
                    at_origin.push_back(eyeParams(camera, {}));
                    moved.push_back(eyeParams(movedCamera(camera, far.by()), local.view().origin));
                }
                const auto expected = render(*here, at_origin, options), actual = render(*there, moved, options);
                for (size_t e = 0; e < 2; ++e) {
                    CHECK(compare(actual[e].pixels, expected[e].pixels).psnr >= 80);
                    decoded_here += expected[e].result.eyes[e].anchors_decoded;
                    decoded_there += actual[e].result.eyes[e].anchors_decoded;
                }
            }
            CHECK(double(decoded_there) == doctest::Approx(double(decoded_here)).epsilon(0.01));
        }
}
