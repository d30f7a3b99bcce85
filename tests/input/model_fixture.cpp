// SPDX-License-Identifier: Apache-2.0
#include "tests/input/model_fixture.h"

#include "tests/input/torch_files.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <random>
#include <stdexcept>

namespace gsc::test {

namespace fs = std::filesystem;

void writeFile(const fs::path& path, const std::string& text)
{
    fs::create_directories(path.parent_path());
    std::ofstream(path, std::ios::binary) << text;
}

void writeFile(const fs::path& path, const std::vector<std::byte>& bytes)
{
    writeFile(path, std::string(reinterpret_cast<const char*>(bytes.data()), bytes.size()));
}

std::vector<std::string> columnNames(Columns kind, uint32_t n_offsets, uint32_t feat_dim)
{
    std::vector<std::string> names = {"x", "y", "z"};
    const auto add = [&](std::initializer_list<const char*> more) {
        names.insert(names.end(), more.begin(), more.end());
    };
    const auto number = [&](const char* prefix, uint32_t count) {
        for (uint32_t i = 0; i < count; ++i)
            names.push_back(prefix + std::to_string(i));
    };
    if (kind == Columns::Scaffold)
        add({"nx", "ny", "nz"});
    if (kind == Columns::Octree)
        add({"level", "extra_level", "info"});
    if (kind == Columns::AnyLod)
        add({"level", "extra_level"});
    number("f_offset_", 3 * n_offsets);
    number("f_anchor_feat_", feat_dim);
    if (kind == Columns::Scaffold || kind == Columns::Octree)
        add({"opacity"});
    number("scale_", 6);
    number("rot_", 4);
    return names;
}

std::string PlyText::header() const
{
    std::string text = "ply\nformat binary_little_endian 1.0\n";
    for (const std::string& line : obj_info)
        text += "obj_info " + line + "\n";
    text += "element vertex " + std::to_string(rows.size()) + "\n";
    for (const std::string& column : columns)
        text += "property " + type + " " + column + "\n";
    return text + "end_header\n";
}

std::string PlyText::text() const
{
    std::string result = header();
    for (const std::vector<float>& row : rows)
        result.append(reinterpret_cast<const char*>(row.data()), row.size() * sizeof(float));
    return result;
}

float& PlyText::at(size_t row, const std::string& column)
{
    const auto found = std::find(columns.begin(), columns.end(), column);
    return rows.at(row).at(size_t(found - columns.begin()));
}

PlyText makePly(Columns kind, uint32_t rows, uint32_t n_offsets, uint32_t feat_dim)
{
    PlyText ply;
    ply.columns = columnNames(kind, n_offsets, feat_dim);
    for (uint32_t row = 0; row < rows; ++row) {
        ply.rows.emplace_back();
        for (size_t column = 0; column < ply.columns.size(); ++column)
            ply.rows.back().push_back(float(row) + float(column) / 1024.0f);
    }
    for (uint32_t row = 0; row < rows && (kind == Columns::Octree || kind == Columns::AnyLod); ++row) {
        ply.at(row, "level") = float(row % 3);
        if (kind == Columns::Octree)
            ply.at(row, "info") = row == 0 ? 0.125f : row == 1 ? 40.5f : 0.0f; // voxel_size, standard_dist
    }
    if (kind == Columns::AnyLod)
        ply.obj_info = {"standard_dist 12.345679", "levels 3.000000"};
    return ply;
}

Mlp makeMlp(MlpKind kind, uint32_t in, uint32_t hidden, uint32_t out, uint32_t seed)
{
    constexpr Activation activations[] = {Activation::Tanh, Activation::None, Activation::Sigmoid, Activation::Softmax};
    std::mt19937 random(seed);
    Mlp mlp;
    mlp.kind = kind;
    mlp.activation = activations[uint32_t(kind)];
    const uint32_t sizes[] = {in, hidden, out};
    for (int i = 0; i < 2; ++i) {
        LinearLayer& layer = mlp.layers[i];
        layer.in = sizes[i];
        layer.out = sizes[i + 1];
        layer.weight.resize(size_t(layer.in) * layer.out);
        layer.bias.resize(layer.out);
        for (std::vector<float>* values : {&layer.weight, &layer.bias})
            for (float& value : *values)
                value = float(int32_t(random())) / 2147483648.0f;
    }
    return mlp;
}

WeightSet makeWeights(uint32_t n_offsets, uint32_t feat_dim, const MlpWidths& widths)
{
    const uint32_t base = feat_dim + 3;
    WeightSet set;
    set.mlps.push_back(makeMlp(MlpKind::Opacity, base + widths.opacity, feat_dim, n_offsets, 1));
    set.mlps.push_back(makeMlp(MlpKind::Covariance, base + widths.covariance, feat_dim, 7 * n_offsets, 2));
    set.mlps.push_back(
        makeMlp(MlpKind::Color, base + widths.color + widths.appearance_columns, feat_dim, 3 * n_offsets, 3));
    if (widths.bank >= 0)
        set.mlps.push_back(makeMlp(MlpKind::FeatureBank, 3 + uint32_t(widths.bank), feat_dim, 3, 4));
    set.rows = widths.appearance_rows;
    set.columns = widths.appearance_columns;
    for (uint32_t i = 0; i < set.rows * set.columns; ++i)
        set.embedding.push_back(float(i) / 64.0f);
    return set;
}

namespace {

constexpr const char* kNames[] = {"opacity_mlp", "cov_mlp", "color_mlp", "feature_bank_mlp"};

std::vector<std::byte> stateDict(const WeightSet& weights, const char* bank_key)
{
    std::vector<std::pair<std::string, const Mlp*>> mlps;
    for (size_t i = 0; i < weights.mlps.size(); ++i)
        mlps.emplace_back(i == 3 ? bank_key : kNames[i], &weights.mlps[i]);
    return writeStateDictArchive(mlps, weights.embedding, weights.rows, weights.columns);
}

} // namespace

void writeSplit(const fs::path& folder, const WeightSet& weights)
{
    for (size_t i = 0; i < weights.mlps.size(); ++i)
        writeFile(folder / (std::string(kNames[i]) + ".pt"), writeTorchScriptMlp(weights.mlps[i], kNames[i]));
    if (weights.columns != 0)
        writeFile(folder / "embedding_appearance.pt",
                  writeTorchScriptEmbedding(weights.embedding, weights.rows, weights.columns, "embedding_appearance"));
}

void writeUnite(const fs::path& folder, const WeightSet& weights)
{
    writeFile(folder / "checkpoints.pth", stateDict(weights, "feature_bank_mlp"));
}

void writeV1(const fs::path& folder, const WeightSet& weights)
{
    writeFile(folder / "checkpoint.pth", stateDict(weights, "mlp_feature_bank"));
}

fs::path writeModel(const fs::path& root, const ModelSpec& spec)
{
    const fs::path folder = root / "point_cloud" / ("iteration_" + std::to_string(spec.iteration));
    writeFile(folder / "point_cloud.ply", makePly(spec.columns, spec.rows, spec.n_offsets, spec.feat_dim).text());
    writeSplit(folder, makeWeights(spec.n_offsets, spec.feat_dim, spec.widths));
    if (!spec.cfg_args.empty())
        writeFile(root / "cfg_args", spec.cfg_args);
    return folder;
}

} // namespace gsc::test
