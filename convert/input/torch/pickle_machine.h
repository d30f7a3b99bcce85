// SPDX-License-Identifier: Apache-2.0
// Executes the part of Python's pickle language that PyTorch uses to save tensors, modules and dictionaries of them.
// Only names of classes and functions in a fixed list are accepted; nothing is imported, and no code of the file runs.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gsc {

enum class PickleKind : uint8_t {
    None,
    Bool,
    Int,
    Float,
    String,
    Global,
    Tuple,
    List,
    Dict,
    Object,
    Storage,
    Tensor,
    Other // bytes, sets, integers of more than 64 bits: values that are not used
};

// An integer of more than 64 bits is an Other whose text is this prefix and then its bytes or its decimal digits.
inline const std::string kWideInteger = "integer ";

struct PickleValue {
    PickleKind kind = PickleKind::None;
    // value of a Bool or an Int; number of elements of a Storage; index into PickleGraph::tensors of a Tensor
    int64_t integer = 0;
    double number = 0; // value of a Float
    // characters of a String; "module name" of a Global or of the class of an Object; key of a Storage; text of an
    // Other
    std::string text;
    // elements of a Tuple or a List; key, value, key, value... of a Dict; the state, a Dict, of an Object
    std::vector<uint32_t> items;
};

struct PickleTensor {
    std::string storage_key;
    std::string storage_type;   // such as "torch FloatStorage"
    uint64_t storage_count = 0; // elements in the storage
    uint64_t offset = 0;        // first value of the tensor, as an index into the storage
    std::vector<uint64_t> shape, stride;
};

// All values of a pickle; they refer to each other by index into `values`. note: a hostile pickle can contain cycles,
// or share values so that a walk over them takes exponential time; code that walks the graph must limit depth and
// steps.
struct PickleGraph {
    std::vector<PickleValue> values;
    std::vector<PickleTensor> tensors;
    uint32_t root = 0;
};

// Executes a pickle. `name` is used in messages only. Throws Error: InvalidFile (damaged), Unsupported (what Python
// could read but we do not: a protocol, an opcode, a name, more values than kMaxPickleValues).
PickleGraph loadPickle(std::span<const std::byte> bytes, const std::string& name);

// Executes the pickle at the start of `bytes`, as loadPickle() does, and sets `bytes` to what follows it.
PickleGraph takePickle(std::span<const std::byte>& bytes, const std::string& name);

} // namespace gsc
