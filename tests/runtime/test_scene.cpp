// SPDX-License-Identifier: Apache-2.0
#include <gsc/error.h>
#include <gsc/scene.h>
#include "tests/format/tiny_gsc.h"
#include "tests/support/outcome.h"

#include <doctest/doctest.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <functional>
#include <set>
#include <span>
#include <string>

#include <unistd.h>

using namespace gsc;
using namespace gsc::test;
using gsc::test::Outcome;
namespace fs = std::filesystem;

namespace {

struct TempFile {
    fs::path path = fs::temp_directory_path() / ("gsc_scene_" + std::to_string(getpid()) + ".gsc");
    explicit TempFile(std::span<const std::byte> bytes)
    {
        std::ofstream stream(path, std::ios::binary);
        stream.write(reinterpret_cast<const char*>(bytes.data()), std::streamsize(bytes.size()));
    }
    ~TempFile() { fs::remove(path); }
    TempFile(const TempFile&) = delete;
    TempFile& operator=(const TempFile&) = delete;
};

Outcome refusal(std::span<const std::byte> bytes, bool verify = false)
{
    const TempFile file(bytes);
    try {
        (void)Scene::open(file.path.string(), verify);
    } catch (const Error& e) {
        CHECK(std::string(e.what()).find(file.path.string()) == 0);
        return {e.code(), e.what()};
    }
    return {};
}

// Checks that each chunk has the arrays that the model's parameters ask for, and no others.
void checkArrays(const ModelView& view)
{
    const bool grid = view.params->position_encoding == uint32_t(PositionEncoding::Grid);
    const bool levels = (view.params->flags & kModelHasLevels) != 0;
    const bool rotation = (view.params->flags & kModelHasRotation) != 0;
    for (uint64_t i = 0; i < view.params->chunk_count; ++i) {
        const ChunkArrays& arrays = view.arrays[i];
        CHECK((arrays.grid_position != nullptr) == grid);
        CHECK((arrays.float_position != nullptr) == !grid);
        CHECK((arrays.extra_level != nullptr) == levels);
        CHECK((arrays.rotation != nullptr) == rotation);
        CHECK(arrays.scale != nullptr);
        CHECK(arrays.offset != nullptr);
        CHECK(arrays.feature != nullptr);
        CHECK(reinterpret_cast<uintptr_t>(arrays.feature) % kArrayAlign == 0);
    }
}

} // namespace

TEST_CASE("a file opens, and every pointer leads to what the file holds")
{
    test::TinyGscOptions options;
    options.levels = 2;
    options.rotation = true;
    options.appearance_dim = 4;
    options.appearance_rows = 3;
    options.cameras = 5;
    options.sensitivity = true;
    std::vector<std::byte> bytes = test::tinyGsc(options);
    const TempFile file(bytes);
    const std::unique_ptr<Scene> scene = Scene::open(file.path.string(), true);
    CHECK(scene->bytes() == bytes.size());
    CHECK(scene->anchorCount() == options.anchors);
    CHECK(scene->manifest() == options.manifest);

    const ModelView& view = scene->view();
    CHECK(view.params->level_count == 2);
    CHECK(view.params->feat_dim == options.feat_dim);
    checkArrays(view);
    std::set<uint32_t> sources;
    uint64_t anchors = 0;
    for (uint32_t i = 0; i < view.params->chunk_count; ++i) {
        anchors += view.chunks[i].anchor_count;
        for (uint32_t k = 0; k < view.chunks[i].anchor_count; ++k)
            sources.insert(view.arrays[i].source_index[k]);
        const auto* feature = test::payloadArray<float>(bytes, i, ChunkArray::Feature);
        CHECK(std::memcmp(view.arrays[i].feature, feature, sizeof(float) * options.feat_dim) == 0);
    }
    CHECK(anchors == options.anchors);
    CHECK(sources.size() == options.anchors);

    const auto weights = test::section(bytes, kSectionWeights), packed = test::section(bytes, kSectionPacked);
    CHECK(std::memcmp(view.weights, weights.data(), weights.size()) == 0);
    CHECK(std::memcmp(view.packed, packed.data(), packed.size()) == 0);
    REQUIRE(view.embedding != nullptr);
    const auto embedding = test::section(bytes, kSectionEmbedding);
    const size_t values = size_t(options.appearance_dim) * options.appearance_rows * sizeof(float);
    CHECK(std::memcmp(view.embedding, embedding.data() + embedding.size() - values, values) == 0);

    REQUIRE(view.sensitivity != nullptr);
    const auto sensitivity = test::section(bytes, kSectionSensitivity);
    CHECK(sensitivity.size() == sizeof(AnchorSensitivity) * options.anchors);
    CHECK(std::memcmp(view.sensitivity, sensitivity.data(), sensitivity.size()) == 0);

    REQUIRE(scene->cameras().size() == 5);
    const auto* camera = test::records<CameraRecord>(bytes, kSectionCameras) + 3;
    CHECK(scene->cameras()[3].fx == camera->fx);
    CHECK(scene->cameras()[3].width == camera->width);
    CHECK(std::memcmp(scene->cameras()[3].rotation, camera->rotation, sizeof(camera->rotation)) == 0);
    CHECK(scene->cameras()[3].name.size() == camera->name_bytes);
}

TEST_CASE("a model far from the origin is shown relative to a place within it, any other as it lies in the file")
{
    for (const float far : {0.0f, 70000.0f}) {
        CAPTURE(far);
        test::TinyGscOptions options;
        options.levels = 2;
        options.grid_origin += far;
        std::vector<std::byte> bytes = test::tinyGsc(options);
        const TempFile file(bytes);
        const std::unique_ptr<Scene> scene = Scene::open(file.path.string());
        const ModelView& view = scene->view();
        CHECK((view.arrays[0].grid_position != nullptr) == (far == 0));
        const auto* chunks = test::records<ChunkRecord>(bytes, kSectionChunks);
        const auto* position = test::payloadArray<GridPosition>(bytes, 0, ChunkArray::Position);
        for (int a = 0; a < 3; ++a) {
            CHECK((view.origin[a] == 0) == (far == 0));
            CHECK(std::abs(view.origin[a] - double(far)) < 20);
            CHECK(std::abs(view.params->bounds_min[a]) < 100);
            if (far != 0) {
                const LevelRecord& level = view.levels[0];
                CHECK(double(view.arrays[0].float_position[a]) + view.origin[a] ==
                      double(chunks[0].origin[a] + position[0].local[a]) * double(level.quantum) +
                          double(level.origin));
            }
        }
    }
}

TEST_CASE("float positions, one level, no embedding, no cameras")
{
    test::TinyGscOptions options;
    options.float_positions = true;
    options.cameras = 0;
    const TempFile file(test::tinyGsc(options));
    const std::unique_ptr<Scene> scene = Scene::open(file.path.string());
    checkArrays(scene->view());
    CHECK(scene->view().embedding == nullptr);
    CHECK(scene->view().sensitivity == nullptr);
    CHECK(scene->cameras().empty());
    CHECK(scene->appearanceRows().empty());
    CHECK_THROWS_AS((void)scene->appearanceRow(0), Error);
}

TEST_CASE("T24: appearance rows are the trainer's numbers; one that is not there is refused, naming those that are")
{
    test::TinyGscOptions options;
    options.appearance_dim = 4;
    options.appearance_rows = 3;
    std::vector<std::byte> bytes = test::tinyGsc(options);
    auto* rows = reinterpret_cast<uint32_t*>(test::section(bytes, kSectionEmbedding).data());
    rows[0] = 7;
    rows[1] = 9;
    rows[2] = 40;
    test::reseal(bytes);
    const TempFile file(bytes);
    const std::unique_ptr<Scene> scene = Scene::open(file.path.string());
    CHECK(scene->appearanceRow(7) == 0);
    CHECK(scene->appearanceRow(40) == 2);
    CHECK(scene->appearanceRows() == std::vector<uint32_t>{7, 9, 40});
    for (const int row : {0, 8, 41, -1}) {
        const Outcome refused = outcomeOf([&] { (void)scene->appearanceRow(row); });
        CHECK(refused.code == ErrorCode::Usage);
        CHECK(refused.says("3 rows from 7 to 40"));
    }
}

TEST_CASE("damaged, newer and foreign files are refused with the first issue")
{
    const std::vector<std::byte> good = test::tinyGsc();
    const auto changed = [&](const std::function<void(std::vector<std::byte>&)>& change, bool seal) {
        std::vector<std::byte> bytes = good;
        change(bytes);
        if (seal)
            test::reseal(bytes);
        return bytes;
    };
    CHECK(refusal(good).code == ErrorCode::Ok);
    CHECK(refusal({}).code == ErrorCode::InvalidFile);
    const Outcome foreign = refusal(changed([](auto& b) { b[0] = std::byte{'P'}; }, false));
    CHECK(foreign.code == ErrorCode::InvalidFile);
    CHECK(foreign.says("1001 NotGsc"));
    const Outcome newer = refusal(changed([](auto& b) { test::header(b).version_major = 2; }, true));
    CHECK(newer.code == ErrorCode::Unsupported);
    CHECK(newer.says("1004 VersionUnsupported"));
    const Outcome codec = refusal(changed([](auto& b) { test::sectionEntry(b, kSectionAnchors)->codec = 1; }, true));
    CHECK(codec.code == ErrorCode::Unsupported);
    const Outcome shorter = refusal(changed([](auto& b) { b.resize(b.size() - 64); }, false));
    CHECK(shorter.code == ErrorCode::InvalidFile);
    CHECK(shorter.says("1002 Truncated"));

    // a damaged payload is found when asked for; the index alone does not read it
    const auto payload = changed([](auto& b) { test::section(b, kSectionAnchors)[200] ^= std::byte{1}; }, false);
    CHECK(refusal(payload, false).code == ErrorCode::Ok);
    CHECK(refusal(payload, true).says("8001 PayloadChecksum"));
}

TEST_CASE("a missing file is an I/O error")
{
    const Outcome refused = outcomeOf([&] { (void)Scene::open("no/such/file.gsc"); });
    CHECK(refused.code == ErrorCode::Io);
}
