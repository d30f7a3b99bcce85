// SPDX-License-Identifier: Apache-2.0
// Small models of every family, written to a folder.
#pragma once

#include "convert/input/checkpoint.h"
#include "tests/support/outcome.h"
#include "tests/support/temporary_folder.h"

#include <algorithm>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

namespace gsc::test {

void writeFile(const std::filesystem::path& path, const std::string& text);
void writeFile(const std::filesystem::path& path, const std::vector<std::byte>& bytes);

enum class Columns { Scaffold, Octree, AnyBase, AnyLod };

// Column names as the trainers order them (format facts, 3.1).
std::vector<std::string> columnNames(Columns kind, uint32_t n_offsets, uint32_t feat_dim);

struct PlyText {
    std::vector<std::string> columns;
    std::vector<std::string> obj_info;
    std::vector<std::vector<float>> rows;
    std::string type = "float";

    [[nodiscard]] std::string header() const;
    [[nodiscard]] std::string text() const;
    // Value of a column by name.
    float& at(size_t row, const std::string& column);
};

// Distinct finite values everywhere; levels 0..2, `info` as Octree-GS stores it.
PlyText makePly(Columns kind, uint32_t rows, uint32_t n_offsets, uint32_t feat_dim);

Mlp makeMlp(MlpKind kind, uint32_t in, uint32_t hidden, uint32_t out, uint32_t seed);

// Inputs of the MLPs besides the feature and the direction.
struct MlpWidths {
    uint32_t opacity = 0, covariance = 0, color = 0;
    int bank = -1; // inputs besides the direction; -1 = no feature bank
    uint32_t appearance_rows = 0, appearance_columns = 0;
};

struct WeightSet {
    std::vector<Mlp> mlps;
    std::vector<float> embedding;
    uint32_t rows = 0, columns = 0;
};

WeightSet makeWeights(uint32_t n_offsets, uint32_t feat_dim, const MlpWidths& widths);
void writeSplit(const std::filesystem::path& folder, const WeightSet& weights);
void writeUnite(const std::filesystem::path& folder, const WeightSet& weights);
void writeV1(const std::filesystem::path& folder, const WeightSet& weights);

// A model folder with point_cloud/iteration_<n>, split weights and cfg_args.
struct ModelSpec {
    Columns columns = Columns::Scaffold;
    uint32_t rows = 5, n_offsets = 2, feat_dim = 4;
    int iteration = 7;
    MlpWidths widths;
    std::string cfg_args = "Namespace(voxel_size=0.25, fork=2, dist2level='round', add_level=False)";
};

// Returns the iteration folder.
std::filesystem::path writeModel(const std::filesystem::path& root, const ModelSpec& spec);

inline Checkpoint read(const std::filesystem::path& path, const CheckpointOptions& options = {})
{
    return readCheckpoint(path.string(), options);
}

inline bool warns(const Checkpoint& checkpoint, const std::string& text)
{
    return std::any_of(checkpoint.warnings.begin(), checkpoint.warnings.end(),
                       [&](const std::string& warning) { return warning.find(text) != std::string::npos; });
}

} // namespace gsc::test
