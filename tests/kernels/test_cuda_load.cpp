// SPDX-License-Identifier: Apache-2.0
// A model on its way to the device: pieces of chunks, and frames that are drawn before all of them have come.
#include "tests/kernels/gpu_stage.h"

#include "kernels/math/anchor.h"

#include <doctest/doctest.h>

#include <numeric>

using namespace gsc;
using namespace gsc::test;
using namespace std::chrono_literals;

namespace {

using Clock = ChunkReader::Clock;

SyntheticOptions manyChunks(uint32_t feat_dim = 32, uint32_t n_offsets = 10)
{
    SyntheticOptions options{.anchors = 3000,
                             .feat_dim = feat_dim,
                             .n_offsets = n_offsets,
                             .levels = 3,
                             .flags = kModelHasLevels | kModelLodHalfCell,
                             .level_rule = LevelRule::Round,
                             .extent = 40};
    return options;
}

SyntheticOptions manyPieces()
{
    SyntheticOptions options = manyChunks(1024, 256);
    options.extent = 4;
    options.cell_log2 = 4;
    return options;
}

std::vector<uint32_t> backwards(const ModelView& model)
{
    std::vector<uint32_t> chunks(model.params->chunk_count);
    std::iota(chunks.rbegin(), chunks.rend(), 0u);
    return chunks;
}

// Whether a piece holds what the chunk holds of its anchors.
bool holdsItsAnchors(const ModelView& model, const ChunkPiece& piece)
{
    const ChunkArrays& arrays = model.arrays[piece.chunk];
    const void* const from[] = {arrays.grid_position, arrays.source_index, arrays.extra_level,
                                arrays.scale,         arrays.offset,       arrays.feature};
    bool same = true;
    for (size_t a = 0; a < std::size(from); ++a) {
        const uint64_t stride = piece.layout.stride[a];
        same =
            same && stride > 0 &&
            std::memcmp(piece.bytes + piece.layout.offset[a],
                        static_cast<const unsigned char*>(from[a]) + stride * piece.first, stride * piece.count) == 0;
    }
    return same;
}

template <typename T>
std::vector<T> fromDevice(const T* data, size_t count)
{
    std::vector<T> values(count);
    if (count == 0)
        return values;
    GSC_CUDA_CHECK(
        cudaMemcpyAsync(values.data(), data, count * sizeof(T), cudaMemcpyDeviceToHost, testStream().handle));
    GSC_CUDA_CHECK(cudaStreamSynchronize(testStream().handle));
    return values;
}

struct Arrays { // arrays of the anchors that select and decode read
    std::vector<float> placement, shape;
    std::vector<uint16_t> feature;
    std::vector<uint64_t> offset;

    explicit Arrays(const DeviceModel& model)
        : placement(fromDevice(model.placement, size_t(4) * model.anchor_count)),
          shape(fromDevice(model.shape, size_t(6) * model.anchor_count)),
          feature(fromDevice(model.feature, size_t(model.params.feat_dim) * model.anchor_count)),
          offset(fromDevice(model.offset, size_t(model.params.n_offsets) * model.anchor_count))
    {
    }
};

template <typename T>
bool sameRange(const std::vector<T>& a, const std::vector<T>& b, size_t each, uint32_t first, uint32_t count)
{
    return std::memcmp(a.data() + each * first, b.data() + each * first, each * count * sizeof(T)) == 0;
}

} // namespace

TEST_CASE("load: pieces of chunks come in order and hold their anchors, whatever the number of threads")
{
    const SyntheticModel model(manyPieces());
    const ModelView& view = model.view();
    REQUIRE(view.params->chunk_count > 2);
    for (const int threads : {1, 3}) {
        CAPTURE(threads);
        const std::vector<uint32_t> chunks = backwards(view);
        ChunkReader reader(view, chunks, threads);
        size_t chunk = 0;
        uint32_t next = 0, pieces = 0;
        bool in_order = true, same = true, numbered = true;
        reader.all([&](const ChunkPiece& piece) -> const CudaStream& {
            in_order = in_order && piece.chunk == chunks[chunk] && piece.first == next && piece.count > 0 &&
                       piece.layout.bytes <= ChunkReader::pieceBytes(view);
            same = same && holdsItsAnchors(view, piece);
            const uint32_t* const sources = view.arrays[piece.chunk].source_index + piece.first;
            numbered = numbered && piece.last_source == *std::max_element(sources, sources + piece.count);
            next += piece.count;
            ++pieces;
            if (next == view.chunks[piece.chunk].anchor_count) {
                ++chunk;
                next = 0;
            }
            return testStream();
        });
        CHECK(in_order);
        CHECK(same);
        CHECK(numbered);
        CHECK(chunk == chunks.size());
        CHECK(pieces > chunks.size());
    }
}

TEST_CASE("load: a reader that is left early ends, and one whose time is up goes on later")
{
    const SyntheticModel model(manyPieces());
    const std::vector<uint32_t> chunks = backwards(model.view());
    ChunkReader reader(model.view(), chunks, 2);
    uint32_t pieces = 0;
    const auto count = [&](const ChunkPiece&) -> const CudaStream& {
        ++pieces;
        return testStream();
    };
    CHECK_FALSE(reader.some(Clock::now(), 1h, count));
    CHECK(pieces == 0);
    const auto one = [&](const ChunkPiece&) -> const CudaStream& { // takes longer than there is
        ++pieces;
        std::this_thread::sleep_for(2ms);
        return testStream();
    };
    // the first piece comes however long it takes
    while (pieces == 0)
        CHECK_FALSE(reader.some(Clock::now() + 1ms, 1h, one));
    CHECK(pieces >= 1);
    CHECK(pieces < model.view().params->chunk_count);
}

TEST_CASE("load: groups that count as there have their anchors there")
{
    const SyntheticModel model(manyChunks());
    const StageModel whole(model.view());
    const Arrays wanted(whole.scene.model());
    MemoryBudget budget;
    DeviceScene scene(budget, 2);
    scene.loadFrame(model.view(), testStream());
    CHECK_FALSE(scene.whole());
    CHECK(scene.anchorsAbsent() == 3000);
    const EyeParams eye = eyeAt(1, -30, 64, 64);
    bool in_part = false;
    while (!scene.whole()) {
        scene.bring(eye, Clock::now() + 20us, 20us);
        const Arrays found(scene.model());
        const std::vector<GroupRun> runs = fromDevice(scene.model().runs, scene.runsThere());
        uint64_t anchors = 0;
        bool same = true;
        for (const GroupRun& run : runs)
            for (uint32_t g = run.group_first; g < run.group_first + run.group_count; ++g) {
                const GroupRecord& group = model.view().groups[g];
                same = same &&
                       sameRange(wanted.placement, found.placement, 4, group.anchor_first, group.anchor_count) &&
                       sameRange(wanted.shape, found.shape, 6, group.anchor_first, group.anchor_count) &&
                       sameRange(wanted.feature, found.feature, 32, group.anchor_first, group.anchor_count) &&
                       sameRange(wanted.offset, found.offset, 10, group.anchor_first, group.anchor_count);
                anchors += group.anchor_count;
            }
        CHECK(same);
        CHECK(anchors + scene.anchorsAbsent() == 3000);
        in_part = in_part || (!scene.whole() && anchors > 0);
    }
    CHECK(in_part);
}

TEST_CASE("load: coarse levels come first, then near chunks, and what lies behind the eye last")
{
    const SyntheticModel model(manyChunks());
    const ModelView& view = model.view();
    MemoryBudget budget;
    DeviceScene scene(budget, 1);
    scene.loadFrame(view, testStream());
    const float position[3] = {0, 0, -10}, target[3] = {0, 0, 1};
    const EyeParams eye = lookAt(position, target, 1.1f, 64, 64);
    while (!scene.whole())
        scene.bring(eye, Clock::now() + 1s, 1s);
    const std::vector<GroupRun> runs = fromDevice(scene.model().runs, scene.model().run_count);
    std::vector<uint32_t> chunks;
    for (const GroupRun& run : runs)
        if (const auto chunk = uint32_t(view.groups[run.group_first].chunk); chunks.empty() || chunks.back() != chunk)
            chunks.push_back(chunk);
    REQUIRE(chunks.size() == view.params->chunk_count);
    const auto behind = [&](uint32_t c) { return view.chunks[c].gaussian_max[2] < -10; };
    const auto level = [&](uint32_t c) { return view.levels[view.chunks[c].level_index].level; };
    const auto distance = [&](uint32_t c) {
        double sum = 0;
        for (int i = 0; i < 3; ++i) {
            const float at = eye.center[i];
            const float low = view.chunks[c].gaussian_min[i], high = view.chunks[c].gaussian_max[i];
            sum += std::pow(at < low ? low - at : at > high ? at - high : 0.0f, 2.0);
        }
        return std::floor(1e4 * std::sqrt(sum));
    };
    size_t behinds = 0, switches = 0;
    for (size_t i = 1; i < chunks.size(); ++i) {
        const uint32_t a = chunks[i - 1], b = chunks[i];
        CHECK_FALSE((behind(a) && !behind(b)));
        if (behind(a) == behind(b)) {
            CHECK(level(a) <= level(b));
            if (level(a) == level(b))
                CHECK(distance(a) <= distance(b));
        }
        behinds += behind(b);
        switches += level(a) != level(b);
    }
    CHECK(behinds > 0);
    CHECK(switches >= 3);
}

TEST_CASE("load: frames are drawn while the model comes, and are those of the whole model afterwards")
{
    const SyntheticModel model(manyChunks());
    const std::vector<EyeParams> eyes = {eyeAt(1, -30, 96, 64)};
    Renderer& whole = cudaRenderer();
    whole.load(model.view());
    RendererOptions options;
    options.first_picture = true;
    for (const Tier tier : {Tier::Fast, Tier::Exact}) {
        const std::unique_ptr<Renderer> renderer = makeRenderer({"cuda"}, options);
        const std::vector<float> wanted = render(whole, eyes, onGrey(tier))[0].pixels;
        for (int model_again = 0; model_again < 2; ++model_again) {
            renderer->load(model.view());
            uint64_t absent = model.view().params->chunk_count;
            for (int frames = 0; absent > 0 && frames < 1000; ++frames) {
                const Image<float> image = render(*renderer, eyes, onGrey(tier))[0];
                absent = image.result.anchors_absent;
                CHECK((absent > 0 || image.pixels == wanted));
                CHECK((tier == Tier::Fast || absent == 0)); // tier exact needs the whole model
            }
            CHECK(absent == 0);
        }
    }
    const FrameResult plain = render(whole, eyes, onGrey(Tier::Fast))[0].result;
    CHECK(plain.anchors_absent == 0);
}

TEST_CASE("load: a model on its way gives way to another, and to the end")
{
    const SyntheticModel model(manyPieces()), other(manyChunks());
    const EyeParams eye = eyeAt(1, -30, 64, 64);
    MemoryBudget budget;
    DeviceScene scene(budget, 2);
    const auto begin = [&] { // more pieces than there are slots: the threads wait for some of them
        scene.loadFrame(model.view(), testStream());
        scene.bring(eye, Clock::now(), 0us);
        CHECK_FALSE(scene.whole());
    };
    begin();
    scene.load(other.view(), testStream());
    CHECK(scene.whole());
    CHECK(scene.anchorsAbsent() == 0);
    begin();
    scene.forget();
    begin(); // and it goes away
}
