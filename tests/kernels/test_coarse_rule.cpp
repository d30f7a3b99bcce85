// SPDX-License-Identifier: Apache-2.0
// The rule of detail, and how a CPU joins the Gaussians of a group.
#include "kernels/coarse/coarse_cpu.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

using namespace gsc;
using namespace gsc::test;

namespace {

CoarseView viewAt(float x, float y, float z, float detail = 2)
{
    return {{x, y, z}, 0.01f, detail * 0.01f, 0, 0, {x, y, z}, kMostCloser, kMostFurther, 0, {{0, 0, 1}, {0, 0, 1}}};
}

// Gaussians of a group whose box is the unit cube, seen from z = -100: there a pixel is 1 wide.
struct Joined {
    std::vector<float> values[14];
    std::vector<uint16_t> origins;
    GaussianBlock block{};
    GroupRecord record{};
    std::vector<VisibleAnchor> anchors;
    std::vector<uint32_t> sources;
    JoinScratch scratch;
    std::vector<float> tiles;
    uint32_t count = 0;
    bool far = false;

    void add(float x, float y, float z, float sigma, float opacity, float shade)
    {
        const float own[14] = {x, y, z, sigma, sigma, sigma, 1, 0, 0, 0, opacity, shade, shade, shade};
        for (int i = 0; i < 14; ++i)
            values[i].push_back(own[i]);
        origins.push_back(uint16_t(origins.size()));
    }
    void join(const CoarseView& view, float cell)
    {
        block.count = uint32_t(origins.size());
        for (auto& row : values)
            row.resize(row.size() + kMaxLanes);
        origins.resize(origins.size() + kMaxLanes);
        for (size_t i = 0; i < 3; ++i) {
            block.position[i] = values[i].data();
            block.scale[i] = values[3 + i].data();
            block.color[i] = values[11 + i].data();
            record.gaussian_max[i] = 1;
        }
        for (size_t i = 0; i < 4; ++i)
            block.rotation[i] = values[6 + i].data();
        block.opacity = values[10].data();
        block.origin = origins.data();
        for (uint32_t i = 0; i < block.count; ++i) {
            anchors.push_back({0, i, 1, {1, 1}});
            sources.push_back(block.count - i); // against the order in which they come
        }
        reserveJoin(10, scratch);
        count = joinGroupCpu(view, record, cell, block, {anchors.data(), sources.data(), 1}, scratch, far);
        tiles.resize((count + kMaxLanes) / kMaxLanes * kTileValues);
        storeCopy(scratch, count, tiles.data());
    }
    [[nodiscard]] float at(uint32_t i, uint32_t row) const
    {
        return tiles[i / kMaxLanes * kTileValues + row * kMaxLanes + i % kMaxLanes];
    }
};

} // namespace

TEST_CASE("detail: cells are powers of two that a pixel's size is followed by")
{
    CHECK(cellExponent(1) == 0);
    CHECK(cellExponent(1.99f) == 0);
    CHECK(cellExponent(2) == 1);
    CHECK(cellExponent(0.3f) == -2);
    const float low[3] = {-1, -1, 10}, high[3] = {1, 1, 14};
    CHECK(boxDistance(low, high, viewAt(0, 0, 0).center) == 10);
    CHECK(wantedCell(viewAt(0, 0, 0), low, high).edge == doctest::Approx(0.2));
    CHECK(wantedCell(viewAt(0, 0, 0, 4), low, high).edge == doctest::Approx(0.4));
    CHECK(wantedCell(viewAt(0, 0, 12), low, high).edge == 0);
}

TEST_CASE("detail: with foveation cells grow with the angle from where an eye looks")
{
    EyeParams eyes[2] = {};
    for (EyeParams& eye : eyes)
        for (int i = 0; i < 3; ++i)
            eye.world_to_view[5 * i] = 1;
    const float gaze[2][3] = {{0, 0, 1}, {0, 0.6f, 0.8f}};
    const auto grownAt = [&](uint32_t eye_count, float degrees, float half = 0.01f) { // upwards, 10 away
        CoarseView view = viewAt(0, 0, 0);
        foveate(eyes, eye_count, gaze, 4, view);
        const float angle = degrees * 0.01745329f, y = 10 * std::sin(angle), z = 10 * std::cos(angle);
        const float low[3] = {-half, y - half, z - half}, high[3] = {half, y + half, z + half};
        CHECK(wantedCell(view, low, high).edge ==
              doctest::Approx(0.02f * boxDistance(low, high, view.center) * cellGrowth(view, low, high)));
        return cellGrowth(view, low, high);
    };
    CHECK(grownAt(1, 0) == 1);
    CHECK(grownAt(1, 11) == 1);
    CHECK(grownAt(1, 25) > 1.5f);
    CHECK(grownAt(1, 25) < grownAt(1, 35));
    CHECK(grownAt(1, 45) == doctest::Approx(std::sqrt(12.0)).epsilon(1e-4)); // edges of 6.9 pixels: a deviation of 2
    CHECK(grownAt(1, 45, 3) < 3);                                            // its nearest point counts
    CHECK(grownAt(1, 45, 20) == 1);
    CHECK(grownAt(2, 45) == 1); // the other eye looks there
    CHECK(grownAt(1, 120) == doctest::Approx(std::sqrt(12.0)).epsilon(1e-4));
}

TEST_CASE("detail: a gaze that moves, or another detail, makes copies due by bounds of its own")
{
    const float low[3] = {-1, -1, 9}, high[3] = {1, 1, 11};
    CoarseView at = viewAt(0, 0, 0);
    at.coarsest = 12;
    const auto change = [&](float made, float now) {
        const auto [edge, pixels] = wantedCell(at, low, high);
        return coarseChange(at, keyOf(at, {edge * made, pixels * made}), {edge * now, pixels * now}, low, high);
    };
    CHECK(change(3, 3) == 0);
    CHECK(change(std::exp2(kMostFine), 1) == doctest::Approx(1).epsilon(1e-4)); // it comes
    CHECK(change(4, 1) == doctest::Approx(2 / kMostFine).epsilon(1e-4));        // at once: not drawn
    CHECK(change(1, std::exp2(kMostGross)) == doctest::Approx(1).epsilon(1e-4));
    CHECK(change(1, 64) == kStaleMost); // it has gone: what is too fine is drawn

    // cells that foveation makes larger than any detail stay as they are
    EyeParams eye{};
    for (int i = 0; i < 3; ++i)
        eye.world_to_view[5 * i] = 1;
    const float gaze[1][3] = {{0, 1, 0}};
    CoarseView fine = viewAt(0, 0, 0, 1), coarse = viewAt(0, 0, 0, 4);
    for (CoarseView* const view : {&fine, &coarse})
        foveate(&eye, 1, gaze, 4, *view);
    const CoarseCell a = wantedCell(fine, low, high), b = wantedCell(coarse, low, high);
    CHECK(a.edge == doctest::Approx(b.edge));
    CHECK(coarseChange(coarse, keyOf(fine, a), b, low, high) < 1e-4f);
}

TEST_CASE("detail: a copy is due by what has changed most")
{
    const float low[3] = {-1, -1, 9}, high[3] = {1, 1, 11};
    const auto change = [&](const CoarseView& made, const CoarseView& now) {
        return coarseChange(now, keyOf(made, wantedCell(made, low, high)), wantedCell(now, low, high), low, high);
    };
    const CoarseView at = viewAt(0, 0, 0);
    CHECK(change(at, at) == 0);
    const float side = 10 * kMostDirection;
    CHECK(change(at, viewAt(side, 0, 0)) == doctest::Approx(1).epsilon(0.02));
    CHECK(change(at, viewAt(0, 2 * side, 0)) == doctest::Approx(2).epsilon(0.02));
    CHECK(change(at, viewAt(0, 0, 9 - 9 * std::exp2(-kMostCloser))) == doctest::Approx(1).epsilon(0.001));
    CHECK(change(at, viewAt(0, 0, 9 - 9 * std::exp2(kMostFurther))) == doctest::Approx(1).epsilon(0.001));
    CoarseView other = at;
    other.lod_bias = kMostLevels;
    CHECK(change(at, other) == doctest::Approx(1));
    CHECK(change(at, viewAt(0, 0, 10)) == 1e6f); // from within
    CoarseView wide = at;
    wide.half_distance = side;
    CHECK(change(wide, wide) == doctest::Approx(1));

    GroupRecord record{};
    std::copy_n(low, 3, record.gaussian_min);
    std::copy_n(high, 3, record.gaussian_max);
    KeptGroup kept;
    CHECK(coarseLook(at, record, kept, true).due);
    CHECK_FALSE(coarseLook(at, record, kept, true).draws);
    CHECK_FALSE(coarseLook(viewAt(0, 0, 10), record, kept, true).due);
    kept.kind = CoarseKind::Far;
    kept.key = keyOf(at, wantedCell(at, low, high));
    CHECK_FALSE(coarseLook(at, record, kept, true).due);
    CHECK(coarseLook(at, record, kept, true).draws);
    const CoarseLook stale = coarseLook(viewAt(1.5f * side, 0, 0), record, kept, true);
    CHECK(stale.due);
    CHECK(stale.draws);
    CHECK_FALSE(coarseLook(viewAt((kStaleMost + 0.2f) * side, 0, 0), record, kept, true).draws);
    kept.source = 1000;
    for (const auto& [count, lasts] : {std::pair<uint32_t, float>{1000, 1}, {300, 1}, {150, 2}, {2, kMostLasting}}) {
        kept.count = count; // the fewer, the more it is blurred anyway
        CHECK(coarseLook(viewAt(side, 0, 0), record, kept, true).change == doctest::Approx(1 / lasts).epsilon(0.02));
    }
    kept.kind = CoarseKind::Near;
    CHECK_FALSE(coarseLook(at, record, kept, true).due);
    CHECK(coarseLook(viewAt(0, 0, 9 - 9 * 1.1f * kNearAgain), record, kept, true).due);
}

TEST_CASE("detail: what covers more by growing covers what was wanted")
{
    const float trace = 3, along = 1, adjugate = 2, scale = 1.5f;
    CHECK(screenArea(trace, along, adjugate, scale) ==
          doctest::Approx(std::sqrt(std::pow(scale, 4) * adjugate + 0.3 * scale * scale * 2 + 0.09)));
    const float wanted = 4 * screenArea(trace, along, adjugate, scale);
    const float grows = growth(trace, along, adjugate, scale, wanted);
    CHECK(screenArea(grows * trace, grows * along, grows * grows * adjugate, scale) ==
          doctest::Approx(wanted).epsilon(1e-4));
}

TEST_CASE("detail: small Gaussians of a cell become one that has their light, place and colour")
{
    Joined group;
    group.add(0.2f, 0.2f, 0.2f, 0.01f, 0.3f, 0.2f);
    group.add(0.4f, 0.2f, 0.2f, 0.01f, 0.3f, 0.6f);
    group.add(0.8f, 0.2f, 0.2f, 0.01f, 0.004f, 0.9f); // another cell
    group.join(viewAt(0.5f, 0.5f, -100), 0.5f);
    CHECK(group.far);
    REQUIRE(group.count == 2);
    CHECK(group.at(0, kTilePosition) == doctest::Approx(0.8)); // position of a lower order
    CHECK(group.at(0, kTileOpacity) == doctest::Approx(0.004).epsilon(0.001));
    CHECK(group.at(1, kTilePosition) == doctest::Approx(0.3).epsilon(1e-4));
    CHECK(group.at(1, kTileColor) == doctest::Approx(0.4).epsilon(1e-3));
    CHECK(group.at(1, kTileCovariance) == doctest::Approx(0.0101).epsilon(1e-3)); // their own and their spread
    CHECK(group.at(1, kTileCovariance + 3) == doctest::Approx(1e-4).epsilon(1e-2));
    // light: depth above what is not drawn, times area
    const auto light = [](double opacity, double xx) {
        const double dx = xx + 0.3, dy = 1e-4 + 0.3;
        return (-std::log(1 - opacity) - 1 / 255.0) * std::sqrt(dx * dy);
    };
    CHECK(light(double(group.at(1, kTileOpacity)), 0.0101) == doctest::Approx(2 * light(0.3, 1e-4)).epsilon(0.01));
}

TEST_CASE("detail: light that an opacity cannot hold makes the Gaussian larger")
{
    Joined group;
    for (int i = 0; i < 20; ++i)
        group.add(0.25f, 0.25f, 0.25f, 0.4f, 0.9f, 0.5f);
    group.join(viewAt(0.25f, 0.25f, -100), 0.5f);
    REQUIRE(group.count == 1);
    CHECK(group.at(0, kTileOpacity) == doctest::Approx(double(kLargestOpacity)));
    const float area = 0.16f + 0.3f, depth = 20 * (opticalDepth(0.9f) - kUndrawnDepth) + kUndrawnDepth;
    CHECK(widening(depth) > 1.5f);
    CHECK(double(group.at(0, kTileCovariance)) + 0.3 == doctest::Approx(double(widening(depth) * area)).epsilon(0.01));
}

TEST_CASE("detail: large Gaussians stay as decoded, and a group of many is near")
{
    Joined far, near;
    for (int i = 0; i < 40; ++i) {
        far.add(0.1f, 0.1f, 0.1f, i < 37 ? 0.01f : 0.9f, 0.5f, 0.5f);
        near.add(0.1f, 0.1f, 0.1f, i < 34 ? 0.01f : 0.9f, 0.5f, 0.5f);
    }
    far.add(0.1f, 0.1f, std::numeric_limits<float>::quiet_NaN(), 0.01f, 0.5f, 0.5f);
    far.join(viewAt(0, 0, -100), 0.5f);
    near.join(viewAt(0, 0, -100), 0.5f);
    CHECK(far.far);
    CHECK(far.count == 1 + 3 + 1);
    size_t large = 0;
    for (uint32_t i = 0; i < far.count; ++i)
        large += far.at(i, kTileCovariance) == 0.9f * 0.9f && far.at(i, kTileOpacity) == 0.5f &&
                 far.at(i, kTilePosition) == 0.1f;
    CHECK(large == 3);
    CHECK_FALSE(near.far);
    CHECK(near.count == 0);
}
