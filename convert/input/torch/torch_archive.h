// SPDX-License-Identifier: Apache-2.0
// Reads tensors from PyTorch's files: zip archives of TorchScript (.pt) and torch.save (.pth), and the older format of
// torch.save before PyTorch 1.6. Pickles are read with a fixed list of opcodes and names; no code of a file ever runs.
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

// Class name in torch of each Activation; null for none.
constexpr const char* kActivationClasses[] = {nullptr, "Tanh", "Sigmoid", "Softmax"};

struct NamedTensor {
    // Dotted path of attribute names or keys, such as "0.weight" or "opacity_mlp.0.weight". Wrappers that do not change
    // a result, such as "module" of DistributedDataParallel, are left out of the path.
    std::string name;
    std::vector<uint64_t> shape; // values lie row by row without gaps
    std::vector<float> values;
};

struct TorchArchive {
    bool is_script = false; // the file is a TorchScript module; false: a torch.save of dictionaries
    // class name of the saved object without module and mangling; empty for a dictionary
    std::string root_class;
    std::vector<NamedTensor> tensors; // in the order of the file
    // Class of each submodule by dotted path, such as {"0", "Linear"}, {"3", "Tanh"}; empty for a file of dictionaries.
    std::vector<std::pair<std::string, std::string>> modules;
};

using WantedTensor = std::function<bool(const std::string& name)>;

// Reads the tensors that `wanted` accepts, by default all; the others are neither read nor checked. `name` is used in
// messages only. Throws Error: InvalidFile; Unsupported (big endian, tensors that are not float32, names that are not
// in the list, a tensor both with and without a wrapper, files of other formats).
TorchArchive readTorchArchive(std::span<const std::byte> bytes, const std::string& name,
                              const WantedTensor& wanted = {});

// Bytes of a TorchScript file with Sequential(Linear, ReLU, Linear[, activation]), for `gsc sample`, laid out as by
// PyTorch 1.12: members stored without compression on 64-byte boundaries, zero sizes in the local headers, ZIP64 end
// records. `stem`: folder in the archive that the members lie in.
std::vector<std::byte> writeTorchScriptMlp(const Mlp& mlp, const std::string& stem);
// Bytes of a TorchScript file with an Embedding in a child `embedding` of the module.
std::vector<std::byte> writeTorchScriptEmbedding(std::span<const float> values, uint32_t rows, uint32_t columns,
                                                 const std::string& stem);

} // namespace gsc
