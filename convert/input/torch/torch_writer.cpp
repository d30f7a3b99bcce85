// SPDX-License-Identifier: Apache-2.0
// The writing half of torch_archive.h.
#include "convert/input/torch/torch_archive.h"

#include "convert/input/torch/zip_writer.h"
#include <gsc/error.h>

#include <map>

namespace gsc {

namespace {

// Protocol 2. Strings and globals are pooled in the memo, as PyTorch's pickler does it: the second use of a string
// is a reference to the first, also where a storage key equals a module name.
class PickleWriter {
public:
    PickleWriter() { m_bytes = {'\x80', 2}; }

    // By their letters: ( mark, ) empty tuple, t tuple, } empty dictionary, s item, u items, R call, Q storage, \x81 new
    // object, b its state, N None, . end.
    void ops(const char* opcodes) { m_bytes += opcodes; }

    void string(const std::string& text)
    {
        if (!pooled('X' + text)) {
            ops("X");
            little(text.size(), 4);
            m_bytes += text;
            memoize('X' + text);
        }
    }

    void global(const std::string& module, const std::string& name)
    {
        const std::string key = 'c' + module + '\n' + name + '\n';
        if (!pooled(key)) {
            m_bytes += key;
            memoize(key);
        }
    }

    void integer(uint64_t value)
    {
        const size_t bytes = value < 256 ? 1 : value < 65536 ? 2 : 4;
        ops(bytes == 1 ? "K" : bytes == 2 ? "M" : "J");
        little(value, bytes);
    }

    void tensor(std::span<const float> values, const std::vector<uint64_t>& shape, bool requires_grad);
    void boolean(bool value) { ops(value ? "\x88" : "\x89"); }
    void put() { memoize({}); } // the value on top of the stack gets the next slot
    [[nodiscard]] const std::string& bytes() const { return m_bytes; }

    void addStorages(ZipWriter& zip) const
    {
        for (const auto& [key, values] : m_storages)
            zip.add("data/" + key, std::as_bytes(values));
    }

private:
    void little(uint64_t value, size_t count)
    {
        for (size_t i = 0; i < count; ++i)
            m_bytes += char(value >> (8 * i));
    }

    bool pooled(const std::string& key)
    {
        const auto found = m_slots.find(key);
        if (found != m_slots.end())
            slot("h", "j", found->second);
        return found != m_slots.end();
    }

    void memoize(const std::string& key)
    {
        slot("q", "r", m_next);
        if (!key.empty())
            m_slots.emplace(key, m_next);
        ++m_next;
    }

    void slot(const char* opcode, const char* long_opcode, uint32_t number)
    {
        ops(number < 256 ? opcode : long_opcode);
        little(number, number < 256 ? 1 : 4);
    }

    std::string m_bytes;
    std::map<std::string, uint32_t> m_slots;
    uint32_t m_next = 0;
    std::map<std::string, std::span<const float>> m_storages; // by key, in string order: 0, 1, 10, 11, 2
};

void PickleWriter::tensor(std::span<const float> values, const std::vector<uint64_t>& shape, bool requires_grad)
{
    uint64_t count = 1;
    for (const uint64_t size : shape)
        count *= size;
    if (values.size() != count || count >= (uint64_t(1) << 31))
        throw Error(
            ErrorCode::Internal,
            formatString("tensor: %zu values, expected the %llu of its shape; this is a bug of gsc, please report it",
                         values.size(), static_cast<unsigned long long>(count)));
    global("torch._utils", "_rebuild_tensor_v2");
    ops("((");
    string("storage");
    global("torch", "FloatStorage");
    const std::string key = std::to_string(m_storages.size());
    string(key);
    string("cuda:0");
    integer(count);
    ops("tQ");
    put();
    integer(0);
    ops("(");
    for (const uint64_t size : shape)
        integer(size);
    ops("t(");
    uint64_t stride = count;
    for (const uint64_t size : shape) {
        stride = size == 0 ? 1 : stride / size;
        integer(stride);
    }
    ops("t");
    boolean(requires_grad);
    global("collections", "OrderedDict");
    ops(")RtR");
    put();
    m_storages.emplace(key, values);
}

constexpr const char* kActivationSources[] = {nullptr, "torch.tanh(x)", "torch.sigmoid(x)", "torch.softmax(x, 1)"};

// The attributes every traced module carries.
void writeModuleFlags(PickleWriter& pickle)
{
    pickle.string("training");
    pickle.boolean(false);
    pickle.string("_is_full_backward_hook");
    pickle.ops("N");
}

void beginObject(PickleWriter& pickle, const std::string& module, const std::string& name)
{
    pickle.global("__torch__." + module, name);
    pickle.ops(")\x81}(");
}

void endObject(PickleWriter& pickle)
{
    pickle.ops("ub");
    pickle.put();
}

// TorchScript source of a module class: attributes, then forward.
std::string classSource(const std::string& name, const std::string& parameters, const std::string& attributes,
                        const std::string& self, const std::string& input, const std::string& body)
{
    return "class " + name + "(Module):\n  __parameters__ = [" + parameters + "]\n  __buffers__ = []\n" + attributes +
           "  training : bool\n  _is_full_backward_hook : Optional[bool]\n"
           "  def forward(self: __torch__." +
           self + ",\n    " + input + ": Tensor) -> Tensor:\n" + body;
}

std::string linearSource(const std::string& self)
{
    return classSource("Linear", "\"weight\", \"bias\", ", "  weight : Tensor\n  bias : Tensor\n", self, "x",
                       "    return torch.linear(x, self.weight, self.bias)\n");
}

std::vector<std::byte> finishScript(const std::string& stem, const PickleWriter& pickle,
                                    const std::vector<std::pair<std::string, std::string>>& sources)
{
    ZipWriter zip(stem);
    pickle.addStorages(zip);
    zip.add("data.pkl", pickle.bytes());
    for (const auto& [path, source] : sources)
        zip.add("code/__torch__/" + path, source);
    zip.add("constants.pkl", std::string("\x80\x02).", 4)); // an empty tuple
    zip.add("version", std::string("3\n"));
    return zip.finish();
}

const std::string kModules = "torch.nn.modules.";

} // namespace

std::vector<std::byte> writeTorchScriptMlp(const Mlp& mlp, const std::string& stem)
{
    const char* activation = kActivationClasses[uint32_t(mlp.activation)];
    // the second Linear is a class of its own, as tracing makes it
    const std::string linear_modules[2] = {kModules + "linear", kModules + "linear.___torch_mangle_0"};
    PickleWriter pickle;
    beginObject(pickle, kModules + "container", "Sequential");
    writeModuleFlags(pickle);
    for (const int child : {0, 1, 2, 3}) {
        if (child == 3 && !activation)
            break;
        pickle.string(std::to_string(child));
        if (child % 2 == 0) {
            const LinearLayer& layer = mlp.layers[child / 2];
            beginObject(pickle, linear_modules[child / 2], "Linear");
            pickle.string("weight");
            pickle.tensor(layer.weight, {layer.out, layer.in}, true);
            pickle.string("bias");
            pickle.tensor(layer.bias, {layer.out}, true);
        } else {
            beginObject(pickle, kModules + "activation", child == 1 ? "ReLU" : activation);
        }
        writeModuleFlags(pickle);
        endObject(pickle);
    }
    endObject(pickle);
    pickle.ops(".");

    const auto plainSource = [](const std::string& name, const std::string& result) {
        return classSource(name, "", "", kModules + "activation." + name, "x", "    return " + result + "\n");
    };
    const auto attribute = [](int child, const std::string& type) {
        return "  __annotations__[\"" + std::to_string(child) + "\"] = __torch__." + type + "\n";
    };
    std::string attributes = attribute(0, linear_modules[0] + ".Linear") + attribute(1, kModules + "activation.ReLU") +
                             attribute(2, linear_modules[1] + ".Linear");
    std::string body = "    hidden = (getattr(self, \"1\")).forward((getattr(self, \"0\")).forward(x, ), )\n"
                       "    y = (getattr(self, \"2\")).forward(hidden, )\n";
    std::string activations = plainSource("ReLU", "torch.relu(x)");
    if (activation) {
        attributes += attribute(3, kModules + "activation." + activation);
        body += "    return (getattr(self, \"3\")).forward(y, )\n";
        activations += plainSource(activation, kActivationSources[uint32_t(mlp.activation)]);
    } else {
        body += "    return y\n";
    }
    const std::string sequential =
        classSource("Sequential", "", attributes, kModules + "container.Sequential", "x", body);
    return finishScript(
        stem, pickle,
        {{"torch/nn/modules/container.py", sequential},
         {"torch/nn/modules/linear.py", linearSource(linear_modules[0] + ".Linear")},
         {"torch/nn/modules/activation.py", activations},
         {"torch/nn/modules/linear/___torch_mangle_0.py", linearSource(linear_modules[1] + ".Linear")}});
}

std::vector<std::byte> writeTorchScriptEmbedding(std::span<const float> values, uint32_t rows, uint32_t columns,
                                                 const std::string& stem)
{
    const std::string inner = kModules + "sparse";
    PickleWriter pickle;
    beginObject(pickle, "scene.embedding", "Embedding");
    writeModuleFlags(pickle);
    pickle.string("embedding");
    beginObject(pickle, inner, "Embedding");
    pickle.string("weight");
    pickle.tensor(values, {rows, columns}, true);
    writeModuleFlags(pickle);
    endObject(pickle);
    endObject(pickle);
    pickle.ops(".");
    return finishScript(
        stem, pickle,
        {{"scene/embedding.py",
          classSource("Embedding", "", "  embedding : __torch__." + inner + ".Embedding\n", "scene.embedding.Embedding",
                      "index", "    return (self.embedding).forward(index, )\n")},
         {"torch/nn/modules/sparse.py",
          classSource("Embedding", "\"weight\", ", "  weight : Tensor\n", inner + ".Embedding", "index",
                      "    return torch.embedding(self.weight, index)\n")}});
}

std::vector<std::byte> writeStateDictArchive(const std::vector<std::pair<std::string, const Mlp*>>& mlps,
                                             std::span<const float> embedding, uint32_t rows, uint32_t columns)
{
    PickleWriter pickle;
    // an OrderedDict, left on the stack with a mark for its items
    const auto beginDict = [&] {
        pickle.global("collections", "OrderedDict");
        pickle.ops(")R");
        pickle.put();
        pickle.ops("(");
    };
    // its items, then its attributes: {'_metadata': OrderedDict((path, {'version': 1}))}
    const auto endDict = [&](const std::vector<std::string>& paths) {
        pickle.ops("u}");
        pickle.put();
        pickle.string("_metadata");
        beginDict();
        for (const std::string& path : paths) {
            pickle.string(path);
            pickle.ops("}");
            pickle.put();
            pickle.string("version");
            pickle.integer(1);
            pickle.ops("s");
        }
        pickle.ops("usb");
    };

    pickle.ops("}");
    pickle.put();
    pickle.ops("(");
    for (const auto& [key, mlp] : mlps) {
        pickle.string(key);
        beginDict();
        for (const int child : {0, 2}) {
            const LinearLayer& layer = mlp->layers[child / 2];
            pickle.string(std::to_string(child) + ".weight");
            pickle.tensor(layer.weight, {layer.out, layer.in}, false);
            pickle.string(std::to_string(child) + ".bias");
            pickle.tensor(layer.bias, {layer.out}, false);
        }
        endDict(mlp->activation == Activation::None ? std::vector<std::string>{"", "0", "1", "2"}
                                                    : std::vector<std::string>{"", "0", "1", "2", "3"});
    }
    if (columns != 0) {
        pickle.string("appearance");
        beginDict();
        pickle.string("embedding.weight");
        pickle.tensor(embedding, {rows, columns}, false);
        endDict({"", "embedding"});
    }
    pickle.ops("u.");

    ZipWriter zip("archive");
    zip.add("data.pkl", pickle.bytes());
    pickle.addStorages(zip);
    zip.add("version", std::string("3\n"));
    return zip.finish();
}

std::vector<std::byte> writeTensorArchive(std::span<const NamedTensor> tensors)
{
    PickleWriter pickle;
    pickle.global("collections", "OrderedDict");
    pickle.ops(")R");
    pickle.put();
    pickle.ops("(");
    for (const NamedTensor& tensor : tensors) {
        pickle.string(tensor.name);
        pickle.tensor(tensor.values, tensor.shape, false);
    }
    pickle.ops("u.");

    ZipWriter zip("archive");
    zip.add("data.pkl", pickle.bytes());
    pickle.addStorages(zip);
    zip.add("version", std::string("3\n"));
    return zip.finish();
}

} // namespace gsc
