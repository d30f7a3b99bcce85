// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/pickle_machine.h"

#include "convert/input/torch/pickle_input.h"
#include "format/error.h"

#include <algorithm>
#include <bit>
#include <string_view>
#include <utility>

namespace gsc {

namespace {

// Far above what a checkpoint of these trainers needs (about 150 values, 60 memo slots), far below what hurts.
constexpr size_t kMaxBytes = 16u << 20;
constexpr size_t kMaxValues = 1u << 18;
constexpr size_t kMaxMemo = 1u << 18;
constexpr size_t kMaxGlobal = 512; // characters of a module or class name
constexpr size_t kMaxDimensions = 8;
constexpr uint32_t kNoValue = ~0u;
// A value in the memo can be used again for two bytes of pickle, however large it is: copies have a budget of so many
// bytes for each byte read so far, and some for small pickles. PyTorch's need less than one for each.
constexpr size_t kCopiedForByte = 4;
constexpr size_t kCopiedAlways = 1u << 20;

// What PyTorch before 0.4 wrote, and with it the weights of torchvision's first models.
constexpr std::string_view kOldTensor = "torch._utils _rebuild_tensor";
constexpr std::string_view kOldParameter = "torch.nn.parameter Parameter";

bool allowedGlobal(std::string_view global)
{
    // classes of TorchScript modules: only their names are used
    if (global.starts_with("__torch__.") || global.starts_with("__torch__ "))
        return true;
    // every type of storage is let in here so that its tensors can be refused by name, with the type
    if (global.starts_with("torch ") && global.ends_with("Storage"))
        return true;
    return global == "torch._utils _rebuild_tensor_v2" || global == "torch._utils _rebuild_parameter" ||
           global == kOldTensor || global == kOldParameter || global == "collections OrderedDict";
}

class Machine : private PickleInput {
public:
    using PickleInput::PickleInput;
    using PickleInput::position;

    PickleGraph run()
    {
        constexpr uint8_t kStop = '.';
        for (uint8_t opcode = takeOpcode(); opcode != kStop; opcode = takeOpcode())
            execute(opcode);
        if (m_stack.size() != 1 || !m_marks.empty())
            invalid(formatString("pickle leaves %zu values, expected one", m_stack.size()));
        m_graph.root = m_stack.back();
        return std::move(m_graph);
    }

private:
    uint32_t add(PickleValue value)
    {
        if (m_graph.values.size() >= kMaxValues)
            invalid(formatString("more than %zu values", kMaxValues));
        m_graph.values.push_back(std::move(value));
        return uint32_t(m_graph.values.size() - 1);
    }

    void push(PickleValue value) { m_stack.push_back(add(std::move(value))); }
    void pushInt(int64_t integer) { push({PickleKind::Int, integer, 0, {}, {}}); }
    void pushEmpty(PickleKind kind) { push({kind, 0, 0, {}, {}}); }

    uint32_t top()
    {
        // values below the newest mark belong to whoever set the mark
        if (m_stack.size() <= (m_marks.empty() ? 0 : m_marks.back()))
            invalid("stack underflow");
        return m_stack.back();
    }

    uint32_t pop()
    {
        const uint32_t value = top();
        m_stack.pop_back();
        return value;
    }

    std::vector<uint32_t> popToMark()
    {
        if (m_marks.empty())
            invalid("no mark on the stack");
        const size_t first = m_marks.back();
        m_marks.pop_back();
        std::vector<uint32_t> items(m_stack.begin() + std::ptrdiff_t(first), m_stack.end());
        m_stack.resize(first);
        return items;
    }

    void pushTuple(size_t count)
    {
        PickleValue tuple{PickleKind::Tuple, 0, 0, {}, std::vector<uint32_t>(count)};
        for (size_t i = count; i-- > 0;)
            tuple.items[i] = pop();
        push(std::move(tuple));
    }

    // Before anything is copied that may be in the memo.
    void charge(size_t bytes)
    {
        const size_t most = kCopiedAlways + kCopiedForByte * position();
        if (bytes > most - std::min(m_copied, most))
            invalid(formatString("values that are used again take more than %zu bytes", most));
        m_copied += bytes;
    }

    std::string copyOf(const std::string& text)
    {
        charge(text.size());
        return text;
    }

    // note: adding a value moves the others, so what this returns must not be used after push()
    PickleValue& expect(uint32_t value, PickleKind kind, const char* what)
    {
        PickleValue& found = m_graph.values[value];
        if (found.kind != kind)
            invalid(formatString("%s expected", what));
        return found;
    }

    void put(uint64_t slot)
    {
        if (slot >= kMaxMemo)
            invalid(formatString("memo slot %llu", static_cast<unsigned long long>(slot)));
        if (slot >= m_memo.size())
            m_memo.resize(slot + 1, kNoValue);
        m_memo[slot] = top();
    }

    void get(uint64_t slot)
    {
        if (slot >= m_memo.size() || m_memo[slot] == kNoValue)
            invalid(formatString("memo slot %llu is empty", static_cast<unsigned long long>(slot)));
        m_stack.push_back(m_memo[slot]);
        if (m_stack.size() > kMaxValues)
            invalid(formatString("more than %zu values on the stack", kMaxValues));
    }

    void pushGlobal()
    {
        const std::string module = takeLine(kMaxGlobal);
        std::string global = module + ' ' + takeLine(kMaxGlobal);
        if (!allowedGlobal(global))
            unsupported("the global '" + global + "'");
        push({PickleKind::Global, 0, 0, std::move(global), {}});
    }

    void pushLong()
    {
        const size_t count = size_t(takeUnsigned(1));
        if (count > 8)
            invalid("integer of more than 64 bits");
        uint64_t value = takeUnsigned(count);
        if (count > 0 && count < 8 && (value >> (8 * count - 1)) != 0) // two's complement, sign extended
            value |= ~uint64_t(0) << (8 * count);
        pushInt(int64_t(value));
    }

    void appendItems(std::vector<uint32_t> items)
    {
        PickleValue& list = expect(top(), PickleKind::List, "list");
        list.items.insert(list.items.end(), items.begin(), items.end());
    }

    void setItems(std::vector<uint32_t> items)
    {
        if (items.size() % 2 != 0)
            invalid("key without a value");
        PickleValue& dict = expect(top(), PickleKind::Dict, "dictionary");
        dict.items.insert(dict.items.end(), items.begin(), items.end());
    }

    // ('storage', type, key, location, element count[, view]). The location ("cuda:0") is only a tag.
    void pushStorage()
    {
        const std::vector<uint32_t>& id = expect(pop(), PickleKind::Tuple, "persistent id tuple").items;
        if (id.size() < 5 || id.size() > 6 || expect(id[0], PickleKind::String, "'storage'").text != "storage")
            invalid("persistent id that is no storage");
        if (id.size() == 6 && m_graph.values[id[5]].kind != PickleKind::None)
            unsupported("a storage that is a part of another");
        (void)expect(id[1], PickleKind::Global, "storage type");
        const int64_t count = expect(id[4], PickleKind::Int, "element count").integer;
        if (count < 0)
            invalid(formatString("storage of %lld elements", static_cast<long long>(count)));
        (void)expect(id[3], PickleKind::String, "storage location");
        std::string key = copyOf(expect(id[2], PickleKind::String, "storage key").text);
        push({PickleKind::Storage, count, 0, std::move(key), {id[1]}});
    }

    void reduce()
    {
        const std::vector<uint32_t>& arguments = expect(pop(), PickleKind::Tuple, "argument tuple").items;
        const std::string& function = expect(pop(), PickleKind::Global, "global").text;
        if (function == "collections OrderedDict" && arguments.empty())
            pushEmpty(PickleKind::Dict);
        else if (function == "collections OrderedDict" && arguments.size() == 1 &&
                 m_graph.values[arguments[0]].kind == PickleKind::List)
            pushDictOf(m_graph.values[arguments[0]].items);
        else if (function == "torch._utils _rebuild_tensor_v2" || function == kOldTensor)
            rebuildTensor(arguments);
        else if (function == "torch._utils _rebuild_parameter" && !arguments.empty() &&
                 m_graph.values[arguments[0]].kind == PickleKind::Tensor)
            m_stack.push_back(arguments[0]);
        else
            unsupported("a call of '" + function + "'");
    }

    // Of a list of [key, value], as Python 2 has it.
    void pushDictOf(const std::vector<uint32_t>& pairs)
    {
        PickleValue dict{PickleKind::Dict, 0, 0, {}, {}};
        charge(2 * pairs.size() * sizeof(pairs[0]));
        dict.items.reserve(2 * pairs.size());
        for (const uint32_t pair : pairs) {
            const PickleValue& value = m_graph.values[pair];
            if ((value.kind != PickleKind::List && value.kind != PickleKind::Tuple) || value.items.size() != 2)
                invalid("entry of a dictionary that is no pair");
            dict.items.insert(dict.items.end(), value.items.begin(), value.items.end());
        }
        push(std::move(dict));
    }

    std::vector<uint64_t> dimensions(uint32_t tuple)
    {
        const std::vector<uint32_t>& items = expect(tuple, PickleKind::Tuple, "tuple of dimensions").items;
        if (items.size() > kMaxDimensions)
            invalid(formatString("tensor of %zu dimensions", items.size()));
        std::vector<uint64_t> values;
        charge(items.size() * sizeof(values[0]));
        for (const uint32_t item : items) {
            const int64_t value = expect(item, PickleKind::Int, "dimension").integer;
            if (value < 0)
                invalid(formatString("dimension of %lld", static_cast<long long>(value)));
            values.push_back(uint64_t(value));
        }
        return values;
    }

    // (storage, offset, size, stride, requires_grad, hooks[, metadata])
    void rebuildTensor(const std::vector<uint32_t>& arguments)
    {
        if (arguments.size() < 4 || arguments.size() > 7)
            invalid(formatString("tensor with %zu arguments", arguments.size()));
        const PickleValue& storage = expect(arguments[0], PickleKind::Storage, "storage");
        const int64_t offset = expect(arguments[1], PickleKind::Int, "storage offset").integer;
        if (offset < 0)
            invalid(formatString("storage offset of %lld", static_cast<long long>(offset)));
        PickleTensor tensor;
        tensor.storage_key = copyOf(storage.text);
        tensor.storage_type = copyOf(m_graph.values[storage.items[0]].text);
        tensor.storage_count = uint64_t(storage.integer);
        tensor.offset = uint64_t(offset);
        tensor.shape = dimensions(arguments[2]);
        tensor.stride = dimensions(arguments[3]);
        if (tensor.shape.size() != tensor.stride.size())
            invalid("shape and stride of different length");
        m_graph.tensors.push_back(std::move(tensor));
        push({PickleKind::Tensor, int64_t(m_graph.tensors.size() - 1), 0, {}, {}});
    }

    void newObject()
    {
        const std::vector<uint32_t>& arguments = expect(pop(), PickleKind::Tuple, "argument tuple").items;
        const std::string& type = expect(pop(), PickleKind::Global, "class").text;
        // a parameter is its tensor
        if (type == kOldParameter && arguments.size() == 1 && m_graph.values[arguments[0]].kind == PickleKind::Tensor)
            return m_stack.push_back(arguments[0]);
        if (!arguments.empty())
            unsupported("an object with constructor arguments");
        if (!std::string_view(type).starts_with("__torch__") && type != kOldParameter)
            unsupported("an object of '" + type + "'");
        push({PickleKind::Object, 0, 0, copyOf(type), {}});
    }

    void build()
    {
        const uint32_t state = pop();
        PickleValue& target = m_graph.values[top()];
        if (m_graph.values[state].kind == PickleKind::Tuple)
            return buildParameter(target, m_graph.values[state].items);
        (void)expect(state, PickleKind::Dict, "state dictionary");
        if (target.kind == PickleKind::Object && target.items.empty())
            target.items.push_back(state);
        else if (target.kind != PickleKind::Dict) // an OrderedDict's state is attributes ('_metadata'), never keys
            invalid("state for a value that takes none");
    }

    // The state is (tensor, needs a gradient, ...); whether one is needed does not matter here.
    void buildParameter(PickleValue& target, const std::vector<uint32_t>& state)
    {
        if (target.kind == PickleKind::Tensor)
            return;
        if (target.kind != PickleKind::Object || target.text != kOldParameter || state.empty())
            invalid("state for a value that takes none");
        target = PickleValue(expect(state[0], PickleKind::Tensor, "tensor of a parameter"));
    }

    void setProtocol()
    {
        if (const uint64_t protocol = takeUnsigned(1); protocol != 2 && protocol != 3)
            unsupported(formatString("protocol %llu", static_cast<unsigned long long>(protocol)));
    }

    void pushFloat() // big-endian
    {
        uint64_t bits = 0;
        for (const std::byte byte : take(8))
            bits = bits << 8 | uint64_t(byte);
        push({PickleKind::Float, 0, std::bit_cast<double>(bits), {}, {}});
    }

    void mark()
    {
        m_marks.push_back(m_stack.size());
        if (m_marks.size() > kMaxValues)
            invalid(formatString("more than %zu marks", kMaxValues));
    }

    void setItem()
    {
        const uint32_t value = pop();
        setItems({pop(), value});
    }

    void execute(uint8_t opcode)
    {
        switch (opcode) {
        case 0x80: // PROTO
            return setProtocol();
        case 'N':
            return pushEmpty(PickleKind::None);
        case 0x88: // NEWTRUE
        case 0x89: // NEWFALSE
            return push({PickleKind::Bool, opcode == 0x88, 0, {}, {}});
        case 'J': // BININT
            return pushInt(int32_t(uint32_t(takeUnsigned(4))));
        case 'K': // BININT1
            return pushInt(int64_t(takeUnsigned(1)));
        case 'M': // BININT2
            return pushInt(int64_t(takeUnsigned(2)));
        case 0x8a: // LONG1
            return pushLong();
        case 'G': // BINFLOAT
            return pushFloat();
        case 'X': // BINUNICODE
            return push({PickleKind::String, 0, 0, takeText(size_t(takeUnsigned(4))), {}});
        case 'U': // SHORT_BINSTRING
            return push({PickleKind::String, 0, 0, takeText(size_t(takeUnsigned(1))), {}});
        case 'T': // BINSTRING
            return push({PickleKind::String, 0, 0, takeText(size_t(takeUnsigned(4))), {}});
        case 'c': // GLOBAL
            return pushGlobal();
        case 'q': // BINPUT
            return put(takeUnsigned(1));
        case 'r': // LONG_BINPUT
            return put(takeUnsigned(4));
        case 'h': // BINGET
            return get(takeUnsigned(1));
        case 'j': // LONG_BINGET
            return get(takeUnsigned(4));
        case '(': // MARK
            return mark();
        case ')': // EMPTY_TUPLE
            return pushEmpty(PickleKind::Tuple);
        case 0x85: // TUPLE1
        case 0x86: // TUPLE2
        case 0x87: // TUPLE3
            return pushTuple(opcode - 0x84u);
        case 't': // TUPLE
            return push({PickleKind::Tuple, 0, 0, {}, popToMark()});
        case '}': // EMPTY_DICT
            return pushEmpty(PickleKind::Dict);
        case ']': // EMPTY_LIST
            return pushEmpty(PickleKind::List);
        case 'a': // APPEND
            return appendItems({pop()});
        case 'e': // APPENDS
            return appendItems(popToMark());
        case 's': // SETITEM
            return setItem();
        case 'u': // SETITEMS
            return setItems(popToMark());
        case 'Q': // BINPERSID
            return pushStorage();
        case 'R': // REDUCE
            return reduce();
        case 0x81: // NEWOBJ
            return newObject();
        case 'b': // BUILD
            return build();
        default:
            unsupported(formatString("the opcode 0x%02x", unsigned(opcode)));
        }
    }

    PickleGraph m_graph;
    std::vector<uint32_t> m_stack;
    std::vector<size_t> m_marks; // heights of m_stack
    std::vector<uint32_t> m_memo;
    size_t m_copied = 0; // bytes
};

} // namespace

PickleGraph loadPickle(std::span<const std::byte> bytes, const std::string& name)
{
    PickleInput(bytes, name).limitSize(kMaxBytes);
    return Machine(bytes, name).run();
}

PickleGraph takePickle(std::span<const std::byte>& bytes, const std::string& name)
{
    Machine machine(bytes.first(std::min(bytes.size(), kMaxBytes)), name);
    PickleGraph graph = machine.run();
    bytes = bytes.subspan(machine.position());
    return graph;
}

} // namespace gsc
