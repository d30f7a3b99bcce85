// SPDX-License-Identifier: Apache-2.0
// Levels of detail: stand-ins, the tree, and the folder that a viewer streams.
#include "convert/export/lod/lod_model.h"
#include "convert/export/lod/stand_in.h"
#include "convert/export/lod/streamed_sog.h"
#include "convert/export/sog/sog_images.h"
#include <gsc/error.h>
#include "tests/export/random_set.h"

#include <doctest/doctest.h>
#include <nlohmann/json.hpp>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>
#include <string>

using namespace gsc;
using namespace gsc::test;

namespace {

std::vector<uint32_t> firstNumbers(size_t count)
{
    std::vector<uint32_t> numbers(count);
    std::iota(numbers.begin(), numbers.end(), 0u);
    return numbers;
}

// Light that Gaussian `i` stops, as stand-ins count it.
double stopped(const GaussianSet& set, size_t i)
{
    const auto s = [&](size_t c) { return std::exp(double(set.log_scale[3 * i + c])); };
    return double(set.opacity[i]) * (s(0) * s(1) + s(1) * s(2) + s(2) * s(0));
}

size_t leavesWith(const LodModel& model, size_t level)
{
    return size_t(std::ranges::count_if(
        model.nodes, [level](const LodNode& node) { return node.children.empty() && !node.levels[level].empty(); }));
}

#if GSC_HAVE_WEBP
using Folder = std::map<std::string, std::vector<std::byte>>;

Folder written(const GaussianSet& set, const LodModel& model, int threads)
{
    Folder folder;
    (void)writeStreamedSog(
        set, model,
        [&](const std::string& name, std::span<const std::byte> content) {
            CHECK(folder.emplace(name, std::vector<std::byte>(content.begin(), content.end())).second);
        },
        threads, [](uint64_t, uint64_t) {});
    return folder;
}

nlohmann::json metaOf(const Folder& folder)
{
    const std::vector<std::byte>& text = folder.at("lod-meta.json");
    const auto* first = reinterpret_cast<const char*>(text.data());
    return nlohmann::json::parse(first, first + text.size());
}

void collectLeaves(const nlohmann::json& node, std::vector<nlohmann::json>& leaves)
{
    if (node.contains("lods"))
        leaves.push_back(node);
    else
        for (const auto& child : node.at("children"))
            collectLeaves(child, leaves);
}
#endif

} // namespace

TEST_CASE("stand-ins: a quarter of them, which stop the light that the others stop")
{
    GaussianSet set = randomSet(2, 1001);
    for (float& opacity : set.opacity)
        opacity *= 0.2f; // so that none is cut at 1
    for (float& position : set.position)
        position *= 1e-3f; // so that they overlap
    std::vector<uint32_t> which = firstNumbers(1001);
    const std::vector<uint32_t> made = appendStandIns(set, which);
    REQUIRE(made.size() == 251);
    CHECK(made.front() == 1001);
    REQUIRE(set.size() == 1252);
    CHECK(set.color.size() == 1252 * set.colorValues());
    double before = 0, after = 0;
    for (size_t i = 0; i < set.size(); ++i)
        (i < 1001 ? before : after) += stopped(set, i);
    CHECK(after == doctest::Approx(before).epsilon(1e-4));
    std::ranges::sort(which);
    CHECK(which == firstNumbers(1001));
}

TEST_CASE("stand-ins: alike ones become one of them, neighbours are taken together")
{
    GaussianSet set = randomSet(1, 1);
    set.opacity[0] = 0.125f;
    const GaussianSet one = set;
    for (int i = 1; i < 8; ++i) { // four here, four far away
        set.position.insert(set.position.end(), one.position.begin(), one.position.end());
        if (i % 2 == 1)
            set.position[set.position.size() - 2] += 500;
        set.log_scale.insert(set.log_scale.end(), one.log_scale.begin(), one.log_scale.end());
        set.rotation.insert(set.rotation.end(), one.rotation.begin(), one.rotation.end());
        set.color.insert(set.color.end(), one.color.begin(), one.color.end());
        set.opacity.push_back(one.opacity[0]);
        set.score.push_back(1);
    }
    std::vector<uint32_t> which = firstNumbers(8);
    REQUIRE(appendStandIns(set, which).size() == 2);
    for (const size_t i : {8, 9}) {
        CHECK(set.opacity[i] == doctest::Approx(0.5));
        CHECK(set.position[3 * i] == doctest::Approx(one.position[0]));
        CHECK(std::abs(set.position[3 * i + 1] - one.position[1] - (i == 9 ? 500 : 0)) < 1e-3f);
        float sizes[3], wanted[3];
        std::copy_n(set.log_scale.begin() + long(3 * i), 3, sizes);
        std::copy_n(one.log_scale.begin(), 3, wanted);
        std::sort(sizes, sizes + 3);
        std::sort(wanted, wanted + 3);
        for (size_t c = 0; c < 3; ++c)
            CHECK(sizes[c] == doctest::Approx(wanted[c]).epsilon(1e-3));
        for (size_t c = 0; c < 12; ++c)
            CHECK(set.color[12 * i + c] == doctest::Approx(one.color[c]));
    }
}

TEST_CASE("levels: the model's own first, then a quarter each; every Gaussian in one leaf, inside its box")
{
    GaussianSet set = randomSet(0, 80'000);
    for (size_t i = 0; i < set.size(); ++i) // 36,000, 44,000, 78,000 and 80,000 from the coarsest on
        set.level.push_back(uint16_t(i % 40 < 18 ? 0 : i % 40 < 22 ? 1 : i % 40 < 39 ? 2 : 3));
    const LodModel model = makeLodModel(set);
    REQUIRE(model.counts.size() == 3);
    CHECK(model.counts[0] == 80'000);
    CHECK(model.counts[1] == 44'000); // 78,000 of 80,000 would be none, nor 36,000 of 44,000
    CHECK(std::abs(double(model.counts[2]) - 11'000) < 10);
    CHECK(model.counts[2] <= kLodFewGaussians);
    std::vector<int> met(80'000);
    for (const LodNode& node : model.nodes) {
        if (!node.children.empty())
            continue;
        CHECK(node.levels[0].size() <= kLodLeafGaussians);
        for (const uint32_t g : node.levels[0])
            ++met[g];
        for (const uint32_t g : node.levels[1])
            if (set.level[g] > 1)
                FAIL("a Gaussian of a finer level: ", g);
        for (const auto& level : node.levels)
            for (const uint32_t g : level)
                for (size_t c = 0; c < 3; ++c)
                    if (set.position[3 * g + c] < node.least[c] || set.position[3 * g + c] > node.most[c])
                        FAIL("outside of the box: ", g);
    }
    CHECK(std::ranges::count(met, 1) == 80'000);
    CHECK(leavesWith(model, 0) == 4);

    GaussianSet few = randomSet(0, 5);
    CHECK(makeLodModel(few).counts == std::vector<size_t>{5});
}

#if GSC_HAVE_WEBP
TEST_CASE("streamed SOG: a leaf's run of a chunk lies in its box, each level is read back, threads change nothing")
{
    GaussianSet set = randomSet(1, 150'000);
    const LodModel model = makeLodModel(set);
    REQUIRE(model.counts.size() == 3);
    const Folder folder = written(set, model, 3);
    const nlohmann::json meta = metaOf(folder);
    CHECK(meta["version"] == 1);
    CHECK(meta["lodLevels"] == 3);
    CHECK(meta["counts"] == model.counts);
    std::vector<nlohmann::json> leaves;
    collectLeaves(meta["tree"], leaves);
    CHECK(leaves.size() == 8);
    CHECK(meta["filenames"].size() == 2 + 1 + 1);
    std::map<size_t, std::pair<GaussianSet, size_t>> chunks; // and Gaussians that leaves name
    for (size_t file = 0; file < meta["filenames"].size(); ++file) {
        const auto path = meta["filenames"][file].get<std::string>();
        CHECK(path.ends_with("/meta.json"));
        const auto read = [&](const std::string& name) { return folder.at(path.substr(0, path.size() - 9) + name); };
        chunks[file] = {readSogMembers(read, path), 0};
        CHECK(chunks[file].first.size() <= kLodChunkGaussians);
    }
    for (const auto& leaf : leaves)
        for (const auto& [level, run] : leaf["lods"].items()) {
            auto& [chunk, named] = chunks.at(run["file"].get<size_t>());
            CHECK(meta["filenames"][run["file"].get<size_t>()].get<std::string>().starts_with(level + "_"));
            const size_t first = run["offset"], end = first + run["count"].get<size_t>();
            REQUIRE(end <= chunk.size());
            CHECK(first == named); // no gap
            named = end;
            for (size_t i = 3 * first; i < 3 * end; ++i)
                if (chunk.position[i] < leaf["bound"]["min"][i % 3].get<float>() - 0.01f ||
                    chunk.position[i] > leaf["bound"]["max"][i % 3].get<float>() + 0.01f)
                    FAIL("level ", level, ", Gaussian ", i / 3);
        }
    for (const auto& [file, chunk] : chunks)
        CHECK(chunk.first.size() == chunk.second);

    const auto read = [&](const std::string& name) { return folder.at(name); };
    for (size_t level = 0; level < 3; ++level)
        CHECK(readStreamedSog(read, level, "a").size() == model.counts[level]);
    CHECK(folder == written(set, model, 1));

    nlohmann::json wrong = meta;
    wrong["counts"][2] = 7;
    const std::string text = wrong.dump();
    const auto damaged = [&](const std::string& name) {
        const auto bytes = std::as_bytes(std::span(text));
        return name == "lod-meta.json" ? std::vector<std::byte>(bytes.begin(), bytes.end()) : folder.at(name);
    };
    CHECK_THROWS_WITH_AS((void)readStreamedSog(damaged, 2, "a"),
                         doctest::Contains("in the chunks of level 2, expected 7"), Error);
    CHECK_THROWS_AS((void)readStreamedSog(damaged, 3, "a"), Error);
}
#endif
