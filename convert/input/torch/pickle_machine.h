// SPDX-License-Identifier: Apache-2.0
// The subset of Python's pickle that PyTorch writes for tensors, modules and state dictionaries. Globals are names
// in a list of allowed ones; nothing is imported, called or executed.
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
    Other // bytes, sets, integers of more than 64 bits
};

// Text of an Other before the bytes, or the decimal digits, of an integer of more than 64 bits.
inline const std::string kWideInteger = "integer ";

struct PickleValue {
    PickleKind kind = PickleKind::None;
    int64_t integer = 0; // Bool, Int; Storage: number of elements; Tensor: index into PickleGraph::tensors
    double number = 0;   // Float
    std::string text;    // String; Global: "module name"; Object: "module name" of its class; Storage: its key; Other
    std::vector<uint32_t> items; // Tuple, List: elements; Dict: key, value, key, value...; Object: its state, a Dict
};

struct PickleTensor {
    std::string storage_key;
    std::string storage_type;   // "torch FloatStorage"
    uint64_t storage_count = 0; // elements
    uint64_t offset = 0;        // elements
    std::vector<uint64_t> shape, stride;
};

// Values refer to each other by index. note: a hostile pickle can build cycles and, through shared values, trees
// whose walk is exponential; whoever walks the graph must bound depth and steps.
struct PickleGraph {
    std::vector<PickleValue> values;
    std::vector<PickleTensor> tensors;
    uint32_t root = 0;
};

// `name` is used in messages only. Throws Error: InvalidFile (damaged), Unsupported (what Python reads and this
// does not: a protocol, an opcode, a global, more values than there are of use).
PickleGraph loadPickle(std::span<const std::byte> bytes, const std::string& name);

// Loads the pickle that `bytes` begins with, as loadPickle(); `bytes` becomes the rest behind it.
PickleGraph takePickle(std::span<const std::byte>& bytes, const std::string& name);

} // namespace gsc
