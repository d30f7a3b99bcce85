// SPDX-License-Identifier: Apache-2.0
// Weights as torch.save leaves them.
#pragma once

#include "convert/input/torch/torch_archive.h"

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <utility>
#include <vector>

namespace gsc::test {

// torch.save of {key: OrderedDict(state_dict)}, the "unite" and v1 containers.
std::vector<std::byte> writeStateDictArchive(const std::vector<std::pair<std::string, const Mlp*>>& mlps,
                                             std::span<const float> embedding, uint32_t rows, uint32_t columns);
// torch.save of an OrderedDict of tensors.
std::vector<std::byte> writeTensorArchive(std::span<const NamedTensor> tensors);

} // namespace gsc::test
