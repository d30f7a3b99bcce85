// SPDX-License-Identifier: Apache-2.0
#include "convert/survey/grid_fit.h"

#include <doctest/doctest.h>

#include <chrono>
#include <cmath>
#include <cstring>
#include <random>

using namespace gsc;

namespace {

struct Lattice {
    float voxel_size, origin;
    uint32_t fork;
    int32_t levels;
    int32_t quanta_min, quanta_max; // at level 0
};

std::vector<GridSample> makeSamples(const Lattice& lattice, size_t count, uint32_t seed)
{
    std::mt19937 random(seed);
    std::vector<GridSample> samples;
    for (size_t i = 0; i < count; ++i) {
        const int32_t level = int32_t(random() % uint32_t(lattice.levels));
        const int64_t scale = int64_t(std::pow(double(lattice.fork), level));
        const uint64_t range = uint64_t(int64_t(lattice.quanta_max) - lattice.quanta_min) * uint64_t(scale);
        const int64_t k = int64_t(lattice.quanta_min) * scale + int64_t(random() % (range + 1));
        samples.push_back(
            {gridCoordinate(int32_t(k), levelQuantum(lattice.voxel_size, lattice.fork, level), lattice.origin, false),
             level});
    }
    return samples;
}

size_t misses(const std::vector<GridSample>& samples, const Grid& grid, uint32_t fork)
{
    size_t count = 0;
    for (const GridSample& s : samples)
        count += locateOnGrid(s.value, levelQuantum(grid.voxel_size, fork, s.level), grid.origin) ? 0 : 1;
    return count;
}

} // namespace

TEST_CASE("a grid at the origin is found with and without its voxel size")
{
    for (const float v : {0.001f, 0.005f, 0.01f, 0.0371093f, 1.7f, 3e-5f})
        for (const bool known : {true, false}) {
            const Lattice lattice{v, 0, 2, 1, -3000, 5000};
            const std::vector<GridSample> all = makeSamples(lattice, 6000, 7);
            std::vector<GridSample> samples = all;
            CAPTURE(v);
            CAPTURE(known);
            const auto grid = fitGrid(samples, {known ? v : 0.0f, 2, false});
            REQUIRE(grid);
            CHECK(grid->origin == 0);
            CHECK(misses(all, *grid, 2) == 0);
            // a multiple of the quantum that was used reproduces the same floats only if it is a power of two of it
            CHECK(std::fabs(std::log2(grid->voxel_size / v) - std::round(std::log2(grid->voxel_size / v))) < 1e-6);
        }
}

TEST_CASE(
    "trap 15, section 5.3: a voxel size of cfg_args that is not the trained one is replaced by the positions' own")
{
    const Lattice lattice{0.0123f, 0, 2, 1, -800, 800};
    const std::vector<GridSample> all = makeSamples(lattice, 3000, 3);
    std::vector<GridSample> samples = all;
    const auto grid = fitGrid(samples, {0.001f, 2, false});
    REQUIRE(grid);
    CHECK(misses(all, *grid, 2) == 0);
}

TEST_CASE("trap 13: an octree grid and its unstored origin are recovered bit for bit")
{
    const Lattice lattices[] = {{0.01783736f, -57.88737869262695f, 2, 2, 295, 7742},
                                {0.104478605f, -13.6645203f, 2, 4, 0, 511},
                                {0.25f, 3.3f, 2, 3, -40, 900}, // all coordinates positive: origin above the smallest
                                {0.37f, -1000.7f, 2, 1, 0, 16000},
                                {0.31f, -20.77f, 3, 3, 0, 200}};
    for (const Lattice& lattice : lattices)
        for (const bool known : {true, false}) {
            CAPTURE(lattice.voxel_size);
            CAPTURE(known);
            const std::vector<GridSample> all = makeSamples(lattice, 20000, 11);
            std::vector<GridSample> samples = all;
            const auto grid = fitGrid(samples, {known ? lattice.voxel_size : 0.0f, lattice.fork, true});
            REQUIRE(grid);
            CHECK(misses(all, *grid, lattice.fork) == 0);
        }
}

TEST_CASE("the voxel size is level 0's, also where the file has none of its anchors")
{
    for (const float origin : {0.0f, -20.77f})
        for (const uint32_t fork : {2u, 3u}) {
            std::vector<GridSample> samples;
            for (const GridSample& sample : makeSamples({0.31f, origin, fork, 4, 1, 60}, 20000, 11))
                if (sample.level >= 2)
                    samples.push_back(sample);
            const std::vector<GridSample> all = samples;
            const auto grid = fitGrid(samples, {0.0f, fork, origin != 0});
            REQUIRE(grid);
            CHECK(misses(all, *grid, fork) == 0);
            CHECK(grid->voxel_size == doctest::Approx(0.31).epsilon(1e-5));
        }
}

TEST_CASE("trap 13: a fused multiply-add is another function")
{
    const Lattice lattice{0.01783736f, -57.88737869262695f, 2, 1, 295, 7742};
    size_t differ = 0;
    for (int32_t k = lattice.quanta_min; k <= lattice.quanta_max; ++k)
        differ += std::fma(float(k), lattice.voxel_size, lattice.origin) !=
                          gridCoordinate(k, lattice.voxel_size, lattice.origin, false)
                      ? 1
                      : 0;
    CHECK(differ > 1000);
}

TEST_CASE("a few coordinates fit, one among many that does not makes the fit fail and not hang")
{
    for (const size_t count : {1, 2, 3, 5}) {
        const Lattice lattice{0.02f, -7.3f, 2, 2, 0, 600};
        const std::vector<GridSample> all = makeSamples(lattice, count, uint32_t(count));
        std::vector<GridSample> samples = all;
        const auto grid = fitGrid(samples, {lattice.voxel_size, 2, true});
        REQUIRE(grid);
        CHECK(misses(all, *grid, 2) == 0);
    }
    for (const bool known : {true, false}) {
        const Lattice lattice{0.02f, -7.3f, 2, 2, 0, 600};
        std::vector<GridSample> samples = makeSamples(lattice, 20000, 5);
        samples.push_back({std::nextafter(samples[100].value, 1e9f), samples[100].level});
        const auto start = std::chrono::steady_clock::now();
        CHECK_FALSE(fitGrid(samples, {known ? lattice.voxel_size : 0.0f, 2, true}));
        CHECK(std::chrono::steady_clock::now() - start < std::chrono::seconds(60)); // seconds, sanitizers included
    }
}

TEST_CASE("coordinates that are one value, of either sign, have that value for a grid")
{
    for (const float value : {0.37f, 1e-4f, 1000.5f}) {
        std::vector<GridSample> samples = {{value, 0}, {-value, 0}, {value, 0}};
        const auto grid = fitGrid(samples, {0.0f, 2, false});
        REQUIRE(grid);
        CHECK(locateOnGrid(value, grid->voxel_size, 0));
        CHECK(locateOnGrid(-value, grid->voxel_size, 0));
    }
}

TEST_CASE("coordinates without a grid are refused")
{
    std::mt19937 random(9);
    std::vector<GridSample> samples;
    for (int i = 0; i < 20000; ++i)
        samples.push_back({float(random() >> 8) * 1e-5f, 0});
    for (const bool origin : {false, true})
        for (const float v : {0.0f, 0.013f}) {
            std::vector<GridSample> copy = samples;
            const auto grid = fitGrid(copy, {v, 2, origin});
            // 24-bit integers times a power of ten do lie on a grid of 1e-5, which may be found, but nothing else may
            if (grid)
                CHECK(misses(samples, *grid, 2) == 0);
        }
    std::vector<GridSample> wild;
    for (int i = 0; i < 2000; ++i)
        wild.push_back({std::ldexp(float(random() >> 8), int(random() % 60) - 50), 0});
    CHECK_FALSE(fitGrid(wild, {0.01f, 2, true}));
}

TEST_CASE("trap 15: zeros of both signs are on every grid that starts at zero")
{
    const auto plus = locateOnGrid(0.0f, 0.01f, 0.0f), minus = locateOnGrid(-0.0f, 0.01f, 0.0f);
    REQUIRE(plus);
    REQUIRE(minus);
    CHECK_FALSE(plus->negative_zero);
    CHECK(minus->negative_zero);
    CHECK(std::signbit(gridCoordinate(minus->quanta, 0.01f, 0.0f, minus->negative_zero)));
    std::vector<GridSample> zeros(10, {-0.0f, 0});
    CHECK(fitGrid(zeros, {0.01f, 2, false}));
    // beside an origin a zero is on the grid only where the grid has one
    CHECK_FALSE(locateOnGrid(-0.0f, 0.01f, -3.213f));
    CHECK_FALSE(locateOnGrid(0.0f, 0.01f, -3.213f));
    CHECK(locateOnGrid(-0.0f, 0.25f, -3.0f));
    CHECK(locateOnGrid(-0.0f, 0.25f, -3.0f)->quanta == 12);
}

TEST_CASE("trap 11: a voxel size that the LOD rule uses too is not replaced")
{
    std::vector<GridSample> samples = makeSamples({0.0123f, -7.3f, 2, 2, 0, 800}, 3000, 3);
    std::vector<GridSample> copy = samples;
    CHECK_FALSE(fitGrid(copy, {0.001f, 2, true, true}));
    CHECK(fitGrid(samples, {0.0123f, 2, true, true}));
}

TEST_CASE("hostile quanta are refused, not converted")
{
    CHECK_FALSE(locateOnGrid(1e30f, 1e-3f, 0.0f));
    CHECK_FALSE(locateOnGrid(1.0f, 0.0f, 0.0f));
    CHECK_FALSE(locateOnGrid(1.0f, 1e-38f, 0.0f));
    CHECK_FALSE(locateOnGrid(NAN, 0.01f, 0.0f));
    std::vector<GridSample> none;
    CHECK_FALSE(fitGrid(none, {0.01f, 2, true}));
    std::vector<GridSample> deep = {{1.0f, 2000}, {2.0f, -2000}};
    CHECK_FALSE(fitGrid(deep, {0.01f, 2, true}));
}
