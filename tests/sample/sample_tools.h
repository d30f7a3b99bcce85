// SPDX-License-Identifier: Apache-2.0
// Raw PLY rows and hashes of model folders.
#pragma once

#include "convert/sample/sample.h"
#include "tests/support/temporary_folder.h"
#include "tests/support/outcome.h"

#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace gsc::test {

std::string readText(const std::filesystem::path& path);
// Relative path -> checksum of every file below `folder`.
std::map<std::string, uint64_t> hashFolder(const std::filesystem::path& folder);

struct PlyRows {
    std::vector<std::string> columns;
    std::vector<float> values; // row after row

    [[nodiscard]] size_t count() const { return values.size() / columns.size(); }
    [[nodiscard]] size_t column(const std::string& name) const;
    [[nodiscard]] float at(size_t row, size_t column_index) const
    {
        return values[row * columns.size() + column_index];
    }
};

// Written apart from the converter's reader, so that both are tested.
PlyRows readPlyRows(const std::filesystem::path& path);
std::filesystem::path plyOf(const std::filesystem::path& model);

SampleOptions sampleOptions(SampleScene scene, SampleModel model, uint64_t anchors, const std::string& output);

// Error that makeSample or replicateCheckpoint threw.
Outcome tryMake(const SampleOptions& options);
Outcome tryReplicate(const ReplicateOptions& options);

} // namespace gsc::test
