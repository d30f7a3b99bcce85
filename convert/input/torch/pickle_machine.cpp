// SPDX-License-Identifier: Apache-2.0
#include "convert/input/torch/pickle_machine.h"

#include "format/numbers/count_text.h"
#include "convert/input/torch/pickle_stack.h"
#include <gsc/error.h>

#include <algorithm>
#include <string_view>
#include <utility>

namespace gsc {

namespace {

constexpr size_t kMaxBytes = 16u << 20;
constexpr size_t kMaxGlobal = 512; // most characters of "module class" of a global
constexpr size_t kMaxDimensions = 8;
constexpr uint64_t kMostProtocol = 5;

// Names that PyTorch before 0.4 wrote; the weights of torchvision's oldest models have them.
constexpr std::string_view kOldTensor = "torch._utils _rebuild_tensor";
constexpr std::string_view kOldParameter = "torch.nn.parameter Parameter";

bool allowedGlobal(std::string_view global)
{
    // classes of TorchScript modules: nothing of them is used but the name
    if (global.starts_with("__torch__.") || global.starts_with("__torch__ "))
        return true;
    // every type of storage is accepted here, so that a tensor of a wrong type can be refused later with its name and
    // type
    if (global.starts_with("torch ") && global.ends_with("Storage"))
        return true;
    return global == "torch._utils _rebuild_tensor_v2" || global == "torch._utils _rebuild_parameter" ||
           global == kOldTensor || global == kOldParameter || global == "collections OrderedDict";
}

class Machine : private PickleStack {
public:
    using PickleStack::PickleStack;
    using PickleStack::position;

    PickleGraph run()
    {
        constexpr uint8_t kStop = '.';
        for (uint8_t opcode = takeOpcode(); opcode != kStop; opcode = takeOpcode())
            execute(opcode);
        if (m_stack.size() != 1 || !m_marks.empty())
            invalid(formatString("pickle leaves %zu values for one", m_stack.size()));
        m_graph.root = m_stack.back();
        return std::move(m_graph);
    }

private:
    void pushGlobal(const std::string& module, const std::string& name)
    {
        std::string global = module + ' ' + name;
        if (!allowedGlobal(global))
            unsupported("the global '" + global.substr(0, kMaxGlobal) + "'");
        push({PickleKind::Global, 0, 0, std::move(global), {}});
    }

    void pushGlobalOfLines()
    {
        const std::string module = takeLine(kMaxGlobal);
        pushGlobal(module, takeLine(kMaxGlobal));
    }

    void pushGlobalOfStack()
    {
        const std::string name = copyOf(expect(pop(), PickleKind::String, "name of a global").text);
        pushGlobal(copyOf(expect(pop(), PickleKind::String, "module of a global").text), name);
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

    // Makes a storage of the tuple ('storage', type, key, location, element count[, view]). The location ("cuda:0") is
    // not used.
    void pushStorage()
    {
        const std::vector<uint32_t>& id = expect(pop(), PickleKind::Tuple, "persistent id tuple").items;
        if (id.size() < 5 || id.size() > 6 || expect(id[0], PickleKind::String, "'storage'").text != "storage")
            unsupported("a persistent id that is no storage");
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

    // Makes a dictionary of a list of [key, value] lists: Python 2 pickles dictionaries so.
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
            unsupported(formatString("a tensor of %zu dimensions", items.size()));
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

    // Makes a tensor of the arguments (storage, offset, size, stride, requires_grad, hooks[, metadata]).
    void rebuildTensor(const std::vector<uint32_t>& arguments)
    {
        if (arguments.size() < 4 || arguments.size() > 7)
            invalid("tensor with " + formatCount(arguments.size(), "argument"));
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
        // a torch Parameter stands for the tensor in it
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
        // the state of an OrderedDict holds its attributes ('_metadata'), no keys: ignored
        else if (target.kind != PickleKind::Dict)
            invalid("state for a value that takes none");
    }

    // Sets a Parameter to the tensor in its state (tensor, requires_grad, ...).
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
        if (const uint64_t protocol = takeUnsigned(1); protocol > kMostProtocol)
            unsupported(formatString("protocol %llu", static_cast<unsigned long long>(protocol)));
    }

    void setItem()
    {
        const uint32_t value = pop();
        setItems({pop(), value});
    }

    void execute(uint8_t opcode)
    {
        switch (opcode) {
        case 0x80: // opcode PROTO
            return setProtocol();
        case 'N':
            return pushEmpty(PickleKind::None);
        case 0x88: // opcode NEWTRUE
        case 0x89: // opcode NEWFALSE
            return push({PickleKind::Bool, opcode == 0x88, 0, {}, {}});
        case 'J': // opcode BININT
            return pushInt(int32_t(uint32_t(takeUnsigned(4))));
        case 'K': // opcode BININT1
            return pushInt(int64_t(takeUnsigned(1)));
        case 'M': // opcode BININT2
            return pushInt(int64_t(takeUnsigned(2)));
        case 0x8a: // opcode LONG1
            return pushLong(takeUnsigned(1));
        case 0x8b: // opcode LONG4
            return pushLong(takeUnsigned(4));
        case 'G': // opcode BINFLOAT
            return pushFloat();
        case 'U':  // opcode SHORT_BINSTRING
        case 0x8c: // opcode SHORT_BINUNICODE
            return pushText(1);
        case 'X': // opcode BINUNICODE
        case 'T': // opcode BINSTRING
            return pushText(4);
        case 0x8d: // opcode BINUNICODE8
            return pushText(8);
        case 'c': // opcode GLOBAL
            return pushGlobalOfLines();
        case 0x93: // opcode STACK_GLOBAL
            return pushGlobalOfStack();
        case 'q': // opcode BINPUT
            return put(takeUnsigned(1));
        case 'r': // opcode LONG_BINPUT
            return put(takeUnsigned(4));
        case 'h': // opcode BINGET
            return get(takeUnsigned(1));
        case 'j': // opcode LONG_BINGET
            return get(takeUnsigned(4));
        case '(': // opcode MARK
            return mark();
        case 0x94: // opcode MEMOIZE
            return memoize();
        case ')': // opcode EMPTY_TUPLE
            return pushEmpty(PickleKind::Tuple);
        case 0x85: // opcode TUPLE1
        case 0x86: // opcode TUPLE2
        case 0x87: // opcode TUPLE3
            return pushTuple(opcode - 0x84u);
        case 't': // opcode TUPLE
            return push({PickleKind::Tuple, 0, 0, {}, popToMark()});
        case '}': // opcode EMPTY_DICT
            return pushEmpty(PickleKind::Dict);
        case ']': // opcode EMPTY_LIST
            return pushEmpty(PickleKind::List);
        case 'a': // opcode APPEND
            return appendItems({pop()});
        case 'e': // opcode APPENDS
            return appendItems(popToMark());
        case 's': // opcode SETITEM
            return setItem();
        case 'u': // opcode SETITEMS
            return setItems(popToMark());
        case 'Q': // opcode BINPERSID
            return pushStorage();
        case 'R': // opcode REDUCE
            return reduce();
        case 0x81: // opcode NEWOBJ
            return newObject();
        case 'b': // opcode BUILD
            return build();
        case 0x95: // opcode FRAME
            return (void)takeUnsigned(8);
        default:
            executeRare(opcode);
        }
    }

    // Executes opcodes that torch.save writes only with another protocol than its default, or if the file holds more
    // than tensors.
    void executeRare(uint8_t opcode)
    {
        switch (opcode) {
        case 'I': // opcode INT
        case 'L': // opcode LONG
            return pushDecimal();
        case 'F': // opcode FLOAT
            return pushFloatLine();
        case 'S': // opcode STRING
        case 'V': // opcode UNICODE
            return pushTextLine(opcode == 'S');
        case 'p': // opcode PUT
            return put(takeSlot());
        case 'g': // opcode GET
            return get(takeSlot());
        case 'l': // opcode LIST
            return push({PickleKind::List, 0, 0, {}, popToMark()});
        case 'd': { // opcode DICT
            std::vector<uint32_t> items = popToMark();
            pushEmpty(PickleKind::Dict);
            return setItems(std::move(items));
        }
        case '0': // opcode POP
            return drop();
        case '1': // opcode POP_MARK
            return (void)popToMark();
        case '2': // opcode DUP
            return repeatTop();
        case 'B': // opcode BINBYTES
            return pushBytes(4);
        case 'C': // opcode SHORT_BINBYTES
            return pushBytes(1);
        case 0x8e: // opcode BINBYTES8
        case 0x96: // opcode BYTEARRAY8
            return pushBytes(8);
        case 0x8f: // opcode EMPTY_SET
            return pushOther("set");
        case 0x90: // opcode ADDITEMS
            (void)popToMark();
            return (void)expect(top(), PickleKind::Other, "set");
        case 0x91: // opcode FROZENSET
            (void)popToMark();
            return pushOther("frozenset");
        case 'P':  // opcode PERSID
        case 'i':  // opcode INST
        case 'o':  // opcode OBJ
        case 0x82: // opcode EXT1
        case 0x83: // opcode EXT2
        case 0x84: // opcode EXT4
        case 0x92: // opcode NEWOBJ_EX
        case 0x97: // opcode NEXT_BUFFER
        case 0x98: // opcode READONLY_BUFFER
            unsupported(formatString("the opcode 0x%02x", unsigned(opcode)));
        default: // no protocol of Python has such an opcode
            invalid(formatString("unknown opcode 0x%02x", unsigned(opcode)));
        }
    }
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
