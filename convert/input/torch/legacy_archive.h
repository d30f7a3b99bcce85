// SPDX-License-Identifier: Apache-2.0
// Archives that torch.save wrote before PyTorch 1.6, the format of torchvision's published weights: pickles of a magic
// number, a version, facts of the machine, the object itself and the keys of its storages, then the storages, each a
// count and its elements.
#pragma once

#include "convert/input/torch/pickle_machine.h"

#include <cstddef>
#include <span>
#include <string>
#include <unordered_map>

namespace gsc {

struct LegacyArchive {
    PickleGraph graph;
    // By key; those of every tensor of the graph are there, each of the size that the tensor states.
    std::unordered_map<std::string, std::span<const std::byte>> storages;
};

// By the first bytes: a pickle, and no zip archive.
bool isLegacyArchive(std::span<const std::byte> bytes);

// `bytes` must outlive what is returned; `name` is used in messages only. Throws Error: InvalidFile, Unsupported.
LegacyArchive openLegacyArchive(std::span<const std::byte> bytes, const std::string& name);

} // namespace gsc
