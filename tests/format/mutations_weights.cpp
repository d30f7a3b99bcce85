// SPDX-License-Identifier: Apache-2.0
// 6xxx and 7xxx: weights, embedding, cameras.
#include "tests/format/mutation.h"

#include <cmath>

namespace gsc::test {

namespace {

using Mlp = MlpRecord;
using Packed = PackedMlpHeader;
using Camera = CameraRecord;

std::function<void(Bytes&)> mlp(size_t index, void (*change)(Mlp&))
{
    return edit<Mlp>(kSectionWeights, index, change);
}

std::function<void(Bytes&)> packed(void (*change)(Packed&))
{
    return edit<Packed>(kSectionPacked, 0, change);
}

// The last value of an array of weights is no number.
std::function<void(Bytes&)> lastOf(uint64_t Mlp::*array, uint32_t (*count)(const Mlp&))
{
    return [=](Bytes& f) {
        const Mlp& record = records<Mlp>(f, kSectionWeights)[1];
        reinterpret_cast<float*>(section(f, kSectionWeights).data() + record.*array)[count(record) - 1] = NAN;
    };
}

std::function<void(Bytes&)> camera(void (*change)(Camera&))
{
    return edit<Camera>(kSectionCameras, 1, change);
}

// A value of the array that starts at `offset` of the packed weights.
template <typename T>
std::function<void(Bytes&)> packedValue(uint64_t Packed::*offset, size_t index, T value)
{
    return [=](Bytes& f) {
        const std::span<std::byte> content = section(f, kSectionPacked);
        const uint64_t at = records<Packed>(f, kSectionPacked)->*offset;
        reinterpret_cast<T*>(content.data() + at)[index] = value;
    };
}

TinyGscOptions appearance()
{
    TinyGscOptions o;
    o.appearance_dim = 4;
    o.appearance_rows = 3;
    return o;
}

TinyGscOptions bank()
{
    TinyGscOptions o;
    o.feature_bank = true;
    return o;
}

std::vector<Mutation> mlpMutations()
{
    using namespace issue;
    return {
        {MlpKindWrong, mlp(0, [](Mlp& m) { m.kind = 1; })},
        {MlpKindWrong, mlp(2, [](Mlp& m) { m.kind = 0xffffffff; })},
        {MlpActivation, mlp(1, [](Mlp& m) { m.activation = 1; })},
        {MlpInputFlags, mlp(0, [](Mlp& m) { m.inputs |= 1u << 4; })},
        {MlpInputFlags, mlp(0, [](Mlp& m) { m.inputs &= ~kMlpTakesFeature; }), {MlpShape}},
        {MlpInputFlags, mlp(0, [](Mlp& m) { m.inputs |= kMlpTakesLevel; }), {MlpShape}},
        {MlpInputFlags, mlp(2, [](Mlp& m) { m.inputs |= kMlpTakesAppearance; })},
        {MlpInputFlags, mlp(2, [](Mlp& m) { m.inputs &= ~kMlpTakesAppearance; }), {MlpShape}, appearance()},
        {MlpInputFlags, mlp(3, [](Mlp& m) { m.inputs = 0; }), {MlpShape}, bank()},
        {MlpInputFlags, mlp(3, [](Mlp& m) { m.inputs |= kMlpTakesFeature; }), {MlpShape}, bank()},
        {MlpShape, mlp(0, [](Mlp& m) { m.in = 0xffffffff; })},
        {MlpShape, mlp(0, [](Mlp& m) { m.hidden = 7; })},
        {MlpShape, mlp(1, [](Mlp& m) { m.out = 0x80000000; })},
        {MlpWeightAlign, mlp(0, [](Mlp& m) { m.bias1 += 2; })},
        {MlpWeightAlign, mlp(0, [](Mlp& m) { m.bias1 += 4; })},
        {MlpWeightRange, mlp(0, [](Mlp& m) { m.weight0 = 0; })},
        {MlpWeightRange, mlp(0, [](Mlp& m) { m.bias0 = ~0ull - 63; })},
        {MlpWeightOverlap, mlp(1, [](Mlp& m) { m.weight1 = m.weight0; })},
        {MlpWeightValue,
         [](Bytes& f) {
             const uint64_t at = records<Mlp>(f, kSectionWeights)[2].weight1;
             reinterpret_cast<float*>(section(f, kSectionWeights).data() + at)[5] = NAN;
         }},
        {MlpWeightValue, lastOf(&Mlp::weight0, [](const Mlp& m) { return m.hidden * m.in; })},
        {MlpWeightValue, lastOf(&Mlp::bias0, [](const Mlp& m) { return m.hidden; })},
        {MlpWeightValue, lastOf(&Mlp::weight1, [](const Mlp& m) { return m.out * m.hidden; })},
        {MlpWeightValue, lastOf(&Mlp::bias1, [](const Mlp& m) { return m.out; })},
        {MlpReserved, mlp(0, [](Mlp& m) { m.reserved = 1; })},
    };
}

std::vector<Mutation> packedMutations()
{
    using namespace issue;
    return {
        {PackedShape, packed([](Packed& p) { p.in_rows = 0xffffffff; })},
        {PackedShape, packed([](Packed& p) { p.hidden_pad = 8; })},
        {PackedShape, packed([](Packed& p) { p.k_pad += 16; })},
        {PackedShape, packed([](Packed& p) { p.out_pad[1] = 0; })},
        {PackedAlign, packed([](Packed& p) { p.second_f16[2] += 1; }), {PackedOverlap}},
        {PackedAlign, packed([](Packed& p) { p.first_bias_f32 += 64; })},
        {PackedRange, packed([](Packed& p) { p.first_f32 = 0; })},
        {PackedRange, packed([](Packed& p) { p.second_bias_f32[1] = ~0ull - 255; })},
        {PackedOverlap, packed([](Packed& p) { p.first_bias_f32 = p.first_f32; })},
        {PackedValue, packedValue(&Packed::first_f32, 3, INFINITY)},
        {PackedValue, packedValue(&Packed::first_f16, 3, uint16_t(0x7c00))},
        {PackedReserved, packed([](Packed& p) { p.reserved[16] = 1; })},
        {PackedContent, packedValue(&Packed::first_f32, 3, 0.3f)},
        {PackedContent, packedValue(&Packed::first_bias_f32, 15, 1.0f)}, // padding
        {PackedContent, packedValue(&Packed::first_f16, 9, uint16_t(0x3555))},
    };
}

std::vector<Mutation> embeddingMutations()
{
    using namespace issue;
    const auto rows = [](void (*change)(uint32_t*)) {
        return [=](Bytes& f) { change(records<uint32_t>(f, kSectionEmbedding)); };
    };
    return {
        {EmbeddingUnexpected, editSections([](std::vector<TinySection>& s) {
             TinySection extra = s.back();
             extra.entry.type = kSectionEmbedding;
             s.push_back(extra);
         })},
        {EmbeddingUnexpected,
         editSections([](std::vector<TinySection>& s) { s.erase(s.end() - 2); }),
         {},
         appearance()},
        {SectionBytes,
         editEntry(kSectionEmbedding, [](SectionEntry& e) { e.bytes -= 4; }),
         {PaddingNotZero},
         appearance()},
        {SectionCount, editEntry(kSectionEmbedding, [](SectionEntry& e) { e.count = 1ull << 63; }), {}, appearance()},
        {EmbeddingRows, rows([](uint32_t* r) { r[1] = r[0]; }), {}, appearance()},
        {EmbeddingRowRange, rows([](uint32_t* r) { r[2] = 0x80000000; }), {}, appearance()},
        {EmbeddingValue, rows([](uint32_t* r) { reinterpret_cast<float*>(r)[16 + 3] = NAN; }), {}, appearance()},
        {EmbeddingPadding, rows([](uint32_t* r) { r[3] = 1; }), {}, appearance()},
    };
}

} // namespace

std::vector<Mutation> weightMutations()
{
    std::vector<Mutation> all = mlpMutations();
    for (auto* part : {packedMutations, embeddingMutations})
        for (Mutation& m : part())
            all.push_back(std::move(m));
    return all;
}

std::vector<Mutation> cameraMutations()
{
    using namespace issue;
    return {
        {CameraPose, camera([](Camera& c) { c.position[1] = NAN; })},
        {CameraPose, camera([](Camera& c) { c.rotation[8] = INFINITY; })},
        {CameraRotation, camera([](Camera& c) { c.rotation[0] = 1.5; })},
        {CameraFocal, camera([](Camera& c) { c.fy = 0; })},
        {CameraFocal, camera([](Camera& c) { c.fx = NAN; })},
        {CameraSize, camera([](Camera& c) { c.width = 0; })},
        {CameraSize, camera([](Camera& c) { c.height = 0xffffffff; })},
        {CameraSize, camera([](Camera& c) { c.width = 32769; })},
        {CameraSize, camera([](Camera& c) { c.height = 32769; })},
        {CameraNameRange, camera([](Camera& c) { c.name_bytes = 0xffffffff; })},
        {CameraNameRange, camera([](Camera& c) { c.name_offset = 0xffffffff; })},
        {CameraNameText, [](Bytes& f) { section(f, kSectionCameras).back() = std::byte{0xff}; }},
        {CameraNameText, [](Bytes& f) { section(f, kSectionCameras).back() = std::byte{'\n'}; }},
        {CameraAppearance, camera([](Camera& c) { c.appearance = 0; })},
        {CameraAppearance, camera([](Camera& c) { c.appearance = -2; }), {}, appearance()},
        {CameraFlag, camera([](Camera& c) { c.is_test = 2; })},
        {CameraReserved, camera([](Camera& c) { c.reserved[12] = 1; })},
    };
}

} // namespace gsc::test
