// SPDX-License-Identifier: Apache-2.0
// Reads the files that torch.save wrote before PyTorch 1.6, a format that torchvision's published weights still have.
// It is a row of pickles (magic number, version, facts of the machine, the saved object, the keys of its storages),
// then the storages, each as a count and its elements.
#pragma once

#include "convert/input/torch/pickle_machine.h"

#include <cstddef>
#include <span>
#include <string>
#include <unordered_map>

namespace gsc {

struct LegacyArchive {
    PickleGraph graph;
    // Elements of the storages by key. Every storage that a tensor of the graph uses is there, with the size that the
    // tensor states.
    std::unordered_map<std::string, std::span<const std::byte>> storages;
};

// Returns true if the first bytes are those of a pickle.
bool isLegacyArchive(std::span<const std::byte> bytes);

// Reads such a file. `bytes` must outlive the result; `name` is used in messages only. Throws Error: InvalidFile,
// Unsupported.
LegacyArchive openLegacyArchive(std::span<const std::byte> bytes, const std::string& name);

} // namespace gsc
