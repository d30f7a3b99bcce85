// SPDX-License-Identifier: Apache-2.0
// Tensors in PyTorch's files: zip archives of TorchScript (.pt) and torch.save (.pth), and what torch.save wrote before
// PyTorch 1.6. A pickle-subset machine with whitelisted opcodes and globals; nothing in a file is ever executed.
#pragma once

#include "convert/input/torch/mlp.h"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gsc {

// torch's class of each Activation
constexpr const char* kActivationClasses[] = {nullptr, "Tanh", "Sigmoid", "Softmax"};

struct NamedTensor {
    // Dotted path of attribute names or keys, such as "0.weight" or "opacity_mlp.0.weight". Names of wrappers that do
    // not change the result, such as "module" of DistributedDataParallel, are left out.
    std::string name;
    std::vector<uint64_t> shape; // row-major, contiguous
    std::vector<float> values;
};

struct TorchArchive {
    bool is_script = false;           // TorchScript module, not a torch.save of dictionaries
    std::string root_class;           // last part of the root object's class name, without mangling; empty for dict
    std::vector<NamedTensor> tensors; // in the order of the pickle
    // class of each submodule by dotted path: {"0", "Linear"}, {"3", "Tanh"}; empty for dictionaries
    std::vector<std::pair<std::string, std::string>> modules;
};

using WantedTensor = std::function<bool(const std::string& name)>;

// `name` is used in messages only; tensors that `wanted` (none = all are) does not want are neither read nor checked.
// Throws Error: InvalidFile; Unsupported (big endian, tensors that are not float32, globals outside the whitelist, the
// same tensor with and without a wrapper, files of other formats).
TorchArchive readTorchArchive(std::span<const std::byte> bytes, const std::string& name,
                              const WantedTensor& wanted = {});

// Bytes of a network for `gsc sample`, as PyTorch 1.12 lays them out (stored members, data descriptors with
// zero sizes in the local headers, 64-byte aligned payloads, ZIP64 end records).
// TorchScript Sequential(Linear, ReLU, Linear[, activation]) under the folder `stem`.
std::vector<std::byte> writeTorchScriptMlp(const Mlp& mlp, const std::string& stem);
// TorchScript Embedding module with one child `embedding`.
std::vector<std::byte> writeTorchScriptEmbedding(std::span<const float> values, uint32_t rows, uint32_t columns,
                                                 const std::string& stem);

} // namespace gsc
