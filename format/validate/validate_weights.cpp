// SPDX-License-Identifier: Apache-2.0
// Checks MLPW and EMBD: every shape follows from the parameters, every array lies in its section.
#include "format/validate/validate_regions.h"

#include <cstddef>
#include <vector>

namespace gsc::validate {

namespace {

constexpr uint32_t kKnownInputs = (kMlpTakesAppearance << 1) - 1;

const char* inputConflict(const MlpRecord& mlp, const ModelParams& p)
{
    const bool is_bank = mlp.kind == uint32_t(MlpKind::FeatureBank);
    if (mlp.inputs & ~kKnownInputs)
        return "unknown bits are set";
    if (is_bank == bool(mlp.inputs & kMlpTakesFeature))
        return is_bank ? "the feature bank does not take the feature" : "the head must take the feature";
    const bool takes_appearance = mlp.inputs & kMlpTakesAppearance;
    if (takes_appearance != (mlp.kind == uint32_t(MlpKind::Color) && p.appearance_dim > 0))
        return "the colour head, and no other, takes the appearance if there is one";
    if ((mlp.inputs & kMlpTakesLevel) && !(p.flags & kModelHasLevels))
        return "the model has no levels";
    if (is_bank && (bool(mlp.inputs & kMlpTakesDistance) != bool(p.flags & kModelBankDistance) ||
                    bool(mlp.inputs & kMlpTakesLevel) != bool(p.flags & kModelBankLevel)))
        return "the inputs of the feature bank differ from the model's flags";
    return nullptr;
}

bool checkMlpShape(Context& context, const MlpRecord& mlp, uint32_t i, uint64_t at)
{
    IssueLog& log = context.log;
    const ModelParams& p = *context.view.params;
    constexpr Activation kActivations[] = {Activation::Tanh, Activation::None, Activation::Sigmoid,
                                           Activation::Softmax};
    const uint64_t before = log.errors();
    if (mlp.kind != i) {
        GSC_REPORT(log, MlpKindWrong, at + offsetof(MlpRecord, kind), place("mlps", i, "kind"), mlp.kind, i);
        return false;
    }
    if (mlp.activation != uint32_t(kActivations[i]))
        GSC_REPORT(log, MlpActivation, at + offsetof(MlpRecord, activation), place("mlps", i, "activation"),
                   mlp.activation, unsigned(kActivations[i]));
    if (const char* conflict = inputConflict(mlp, p))
        GSC_REPORT(log, MlpInputFlags, at + offsetof(MlpRecord, inputs), place("mlps", i, "inputs"), mlp.inputs,
                   conflict);
    const uint32_t in = (mlp.inputs & kMlpTakesFeature ? p.feat_dim : 0) + 3 +
                        (mlp.inputs & kMlpTakesDistance ? 1 : 0) + (mlp.inputs & kMlpTakesLevel ? 1 : 0) +
                        (mlp.inputs & kMlpTakesAppearance ? p.appearance_dim : 0);
    const uint32_t out[] = {p.n_offsets, 7 * p.n_offsets, 3 * p.n_offsets, 3};
    const auto shape = [&](const char* name, size_t offset, uint32_t value, uint32_t expected) {
        if (value != expected)
            GSC_REPORT(log, MlpShape, at + offset, place("mlps", i, name), name, value, expected);
    };
    shape("in", offsetof(MlpRecord, in), mlp.in, in);
    shape("hidden", offsetof(MlpRecord, hidden), mlp.hidden, p.feat_dim);
    shape("out", offsetof(MlpRecord, out), mlp.out, out[i]);
    if (mlp.reserved != 0)
        GSC_REPORT(log, MlpReserved, at + offsetof(MlpRecord, reserved), place("mlps", i, "reserved"), mlp.reserved);
    return log.errors() == before;
}

void checkMlpWeights(Context& context, const MlpRecord& mlp, uint32_t i, uint64_t at, std::vector<Region>& regions)
{
    IssueLog& log = context.log;
    const ByteView section(context.view.weights);
    const struct {
        const char* name;
        uint64_t offset, count;
        size_t field;
    } arrays[] = {
        {"weight0", mlp.weight0, uint64_t(mlp.hidden) * mlp.in, offsetof(MlpRecord, weight0)},
        {"bias0", mlp.bias0, mlp.hidden, offsetof(MlpRecord, bias0)},
        {"weight1", mlp.weight1, uint64_t(mlp.out) * mlp.hidden, offsetof(MlpRecord, weight1)},
        {"bias1", mlp.bias1, mlp.out, offsetof(MlpRecord, bias1)},
    };
    for (const auto& array : arrays) {
        const uint64_t bytes = array.count * sizeof(float); // does not wrap around: shapes are at most 1792 x 5126
        if (array.offset % kArrayAlign != 0)
            GSC_REPORT(log, MlpWeightAlign, at + array.field, place("mlps", i, array.name), array.name, array.offset);
        if (array.offset < context.view.mlps.size_bytes() || !section.contains(array.offset, bytes)) {
            GSC_REPORT(log, MlpWeightRange, at + array.field, place("mlps", i, array.name), array.name, bytes,
                       array.offset, section.size());
            continue;
        }
        regions.push_back({array.offset, bytes, place("mlps", i, array.name)});
        const auto values = section.array<float>(array.offset, array.count);
        if (!values) // array is not aligned, which was reported above
            continue;
        const size_t good = finitePrefix(*values);
        if (good != values->size())
            GSC_REPORT(log, MlpWeightValue, context.offsetOf(kSectionWeights) + array.offset + 4 * good,
                       place("mlps", i, array.name), uint64_t(good), array.name);
    }
}

} // namespace

bool checkMlps(Context& context)
{
    IssueLog& log = context.log;
    const uint64_t at = context.offsetOf(kSectionWeights);
    const uint64_t before = log.errors();
    std::vector<Region> regions;
    for (uint32_t i = 0; i < context.view.mlps.size(); ++i) {
        const MlpRecord& mlp = context.view.mlps[i];
        const uint64_t record_at = at + i * sizeof(MlpRecord);
        if (checkMlpShape(context, mlp, i, record_at))
            checkMlpWeights(context, mlp, i, record_at, regions);
    }
    checkOverlaps(regions, [&](const Region& region, const Region& other) {
        GSC_REPORT(log, MlpWeightOverlap, at + region.offset, region.pointer, region.offset, other.offset);
    });
    return log.errors() == before;
}

void checkEmbedding(Context& context)
{
    IssueLog& log = context.log;
    const std::span<const uint32_t> rows = context.view.embedding_rows;
    const std::span<const float> values = context.view.embedding;
    const uint64_t at = context.offsetOf(kSectionEmbedding);
    for (uint64_t i = 1; i < rows.size(); ++i)
        if (rows[i] <= rows[i - 1])
            GSC_REPORT(log, EmbeddingRows, at + 4 * i, place("embedding", i, "source_row"), rows[i], rows[i - 1]);
    // checks rows against int32, since CameraRecord::appearance and players number them so
    for (uint64_t i = 0; i < rows.size(); ++i)
        if (rows[i] > uint32_t(INT32_MAX))
            GSC_REPORT(log, EmbeddingRowRange, at + 4 * i, place("embedding", i, "source_row"), rows[i], INT32_MAX);
    if (values.empty())
        return;
    const uint64_t values_at = alignUp(rows.size_bytes(), 64);
    const auto padding = ByteView(context.file).slice(at + rows.size_bytes(), values_at - rows.size_bytes());
    if (const size_t zeros = zeroPrefix(*padding); zeros != padding->size())
        GSC_REPORT(log, EmbeddingPadding, at + rows.size_bytes() + zeros, "/embedding",
                   uint64_t(rows.size_bytes() + zeros));
    const size_t good = finitePrefix(values);
    if (good != values.size())
        GSC_REPORT(log, EmbeddingValue, at + values_at + 4 * good, "/embedding", uint64_t(good));
}

} // namespace gsc::validate
