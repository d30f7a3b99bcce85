// SPDX-License-Identifier: Apache-2.0
// Sorting from the last frame's order gives what sorting from nothing gives, whatever the last frame was.
#include "kernels/common/parallel.h"
#include "kernels/sort/order.h"
#include "kernels/sort/sort_keys.h"
#include "tests/kernels/synthetic_model.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <functional>
#include <memory>

using namespace gsc;
using namespace gsc::test;

namespace {

// Every anchor of a model is visible; which Gaussians are alive and how deep they lie is what a frame says.
class Frames {
public:
    Frames(uint32_t anchors, uint32_t offsets, bool by_group) : m_model(options(anchors, offsets))
    {
        const ModelView& view = m_model.view();
        if (by_group) {
            for (uint32_t g = 0; g < view.params->group_count; ++g)
                m_groups.push_back(g);
            m_blocks = uint32_t(m_groups.size());
        }
        for (uint32_t c = 0; c < view.params->chunk_count; ++c)
            for (uint32_t i = 0; i < view.chunks[c].anchor_count; ++i)
                m_visible.push_back({c, i, 1, {1, 1}});
        if (!by_group)
            m_blocks = uint32_t((m_visible.size() + kDecodeBlock - 1) / kDecodeBlock);
        m_capacity = kDecodeBlock * offsets;
    }

    // depth(i) of the i-th Gaussian of the model; below zero: it is not drawn.
    void fill(const std::function<float(uint32_t)>& depth)
    {
        const uint32_t offsets = m_model.view().params->n_offsets;
        m_depth_bits.assign(size_t(m_blocks) * m_capacity, 0);
        m_origins.assign(m_depth_bits.size(), 0);
        m_counts.assign(m_blocks, 0);
        uint32_t gaussian = 0;
        for (uint32_t b = 0; b < m_blocks; ++b) {
            const uint32_t anchors = m_groups.empty()
                                         ? std::min(kDecodeBlock, uint32_t(m_visible.size()) - b * kDecodeBlock)
                                         : m_model.view().groups[b].anchor_count;
            for (uint32_t origin = 0; origin < anchors * offsets; ++origin) {
                const float z = depth(gaussian++);
                if (z < 0)
                    continue;
                const uint32_t slot = b * m_capacity + m_counts[b]++;
                m_depth_bits[slot] = std::bit_cast<uint32_t>(z);
                m_origins[slot] = uint16_t(origin);
            }
        }
    }

    [[nodiscard]] SortArgs args() const
    {
        return {&m_model.view(), m_visible.data(), m_depth_bits.data(), m_origins.data(),
                m_counts.data(), m_blocks,         m_capacity,          m_groups.empty() ? nullptr : m_groups.data()};
    }

private:
    static SyntheticOptions options(uint32_t anchors, uint32_t offsets)
    {
        SyntheticOptions o;
        o.anchors = anchors;
        o.n_offsets = offsets;
        o.feat_dim = 4;
        return o;
    }

    SyntheticModel m_model;
    std::vector<uint32_t> m_groups;
    std::vector<VisibleAnchor> m_visible;
    std::vector<uint32_t> m_depth_bits, m_counts;
    std::vector<uint16_t> m_origins;
    uint32_t m_blocks = 0, m_capacity = 0;
};

struct Sorter {
    SortScratch scratch;
    OrderCache cache;
    uint64_t moves = 0;

    std::vector<uint32_t> run(const SortArgs& args, const Workers& workers)
    {
        const size_t count = sortFromOrder(args, workers, scratch, cache, moves);
        std::vector<uint32_t> slots(count);
        for (size_t i = 0; i < count; ++i)
            slots[i] = scratch.keys[0][i].slot;
        return slots;
    }
};

std::vector<uint32_t> fromNothing(const SortArgs& args, const Workers& workers)
{
    SortScratch scratch;
    std::vector<uint32_t> slots(sortCpu(args, workers, scratch));
    for (size_t i = 0; i < slots.size(); ++i)
        slots[i] = scratch.keys[0][i].slot;
    return slots;
}

using Depths = std::function<float(uint32_t)>;

// Pictures of depth that a frame may show, `t` being the time within one.
Depths depths(int kind, float t, uint32_t seed)
{
    const auto hash = [seed](uint32_t i) {
        uint32_t h = (i + seed) * 2654435761u;
        h = (h ^ (h >> 15)) * 2246822519u;
        return float((h ^ (h >> 13)) >> 8) * 0x1p-24f;
    };
    const auto hidden = [hash, t](uint32_t i) {
        return hash(i * 7 + 3) < 0.2f + 0.1f * std::sin(6 * t + 0.001f * float(i));
    };
    switch (kind) {
    case 0: // a camera that turns
        return
            [=](uint32_t i) { return hidden(i) ? -1.0f : 3 + 2 * std::cos(t) * hash(i) + std::sin(t) * hash(i + 1); };
    case 1: // many ties
        return [=](uint32_t i) { return hidden(i) ? -1.0f : 1 + std::floor(40 * hash(i) + 3 * t) / 16; };
    case 2: // reversed from frame to frame
        return [=](uint32_t i) { return std::fmod(16 * t, 2.0f) < 1 ? 1 + hash(i) : 2 - hash(i); };
    case 3: // all alike
        return [](uint32_t) { return 2.5f; };
    case 4: // from very near to very far
        return [=](uint32_t i) { return hidden(i) ? -1.0f : 0.2f * std::exp(20 * hash(i) * (1 + t)); };
    case 5: // in a single clump, far from what was before
        return [=](uint32_t i) { return i % 5 ? 100 + 1e-4f * hash(i) + t : 0.5f; };
    case 6: // nearly nothing
        return [=](uint32_t i) { return hash(i) < 0.001f ? 1 + hash(i + 9) : -1.0f; };
    default: // nothing
        return [](uint32_t) { return -1.0f; };
    }
}

} // namespace

TEST_CASE(
    "frames that follow on each other and frames that do not, blocks and groups: the order of sorting from nothing")
{
    Random random(5);
    const Workers one(1);
    for (const bool by_group : {false, true}) {
        Frames frames(3000, 10, by_group);
        Sorter sorter;
        size_t wrong = 0, frame = 0;
        for (int run = 0; run < 60; ++run) {
            const int kind = run < 8 ? run : int(random.uniform() * 8);
            const auto seed = uint32_t(random.uniform() * 3);
            for (int i = 0; i < 4; ++i, ++frame) {
                frames.fill(depths(kind, 0.04f * float(i), seed));
                wrong += sorter.run(frames.args(), one) != fromNothing(frames.args(), one);
            }
        }
        CHECK(wrong == 0);
    }
}

TEST_CASE("the order is by depth and by emission where depths are equal")
{
    const Workers one(1);
    Frames frames(1500, 4, false);
    Sorter sorter;
    for (int i = 0; i < 5; ++i) {
        frames.fill(depths(1, 0.1f * float(i), 1));
        const SortArgs args = frames.args();
        const std::vector<uint32_t> slots = sorter.run(args, one);
        REQUIRE(slots.size() > 1000);
        size_t wrong = 0, ties = 0;
        for (size_t j = 1; j < slots.size(); ++j) {
            const uint32_t a = args.depth_bits[slots[j - 1]], b = args.depth_bits[slots[j]];
            ties += a == b;
            wrong += a > b || (a == b && orderOfSlot(args, slots[j - 1]) >= orderOfSlot(args, slots[j]));
        }
        CHECK(wrong == 0);
        CHECK(ties > 1000);
    }
}

TEST_CASE("large frames on one to five threads: the same order and the same count of moves")
{
    Frames frames(9000, 70, false); // 630,000 Gaussians: more than the buckets hold at their smallest
    std::vector<std::unique_ptr<Sorter>> sorters;
    for (int i = 0; i < 5; ++i)
        sorters.push_back(std::make_unique<Sorter>());
    for (int i = 0; i < 6; ++i) {
        frames.fill(depths(i < 3 ? 0 : (i == 3 ? 5 : 1), 0.05f * float(i), i == 2 ? 7 : 0));
        const std::vector<uint32_t> expected = fromNothing(frames.args(), Workers(1));
        for (int threads = 1; threads <= 5; ++threads) {
            Sorter& sorter = *sorters[size_t(threads - 1)];
            CHECK((sorter.run(frames.args(), Workers(threads)) == expected));
            CHECK(sorter.moves == sorters[0]->moves);
        }
    }
}

TEST_CASE("moves: all of a first or an unlike frame, few of one that is alike, none of one that is evenly spread")
{
    const Workers one(1);
    Frames frames(3000, 10, false);
    Sorter sorter;
    frames.fill(depths(0, 0, 0));
    const size_t count = sorter.run(frames.args(), one).size();
    CHECK(sorter.moves == count);
    frames.fill(depths(0, 0.01f, 0));
    sorter.run(frames.args(), one);
    CHECK(sorter.moves > 0);
    CHECK(sorter.moves < count / 4);
    frames.fill(depths(5, 0, 0)); // most of it behind all there was
    sorter.run(frames.args(), one);
    CHECK(sorter.moves == 30000);
    const auto evenly = [](uint32_t g) { return 1 + float(g * 7919u % 30000u) * 0x1p-15f; };
    for (int i = 0; i < 2; ++i) {
        frames.fill(evenly);
        sorter.run(frames.args(), one);
    }
    CHECK(sorter.moves == 0);
    frames.fill([&](uint32_t g) { return g == 100 ? evenly(5000) + 0x1p-22f : evenly(g); });
    sorter.run(frames.args(), one);
    CHECK(sorter.moves == 1); // the 5000th lies before the 100th
    sorter.cache.clear();
    sorter.run(frames.args(), one);
    CHECK(sorter.moves == 30000);
}
