// SPDX-License-Identifier: Apache-2.0
// Implements the writing functions of torch_archive.h.
#include "convert/input/torch/torch_archive.h"

#include "convert/input/torch/pickle_writer.h"

namespace gsc {

namespace {

constexpr const char* kActivationSources[] = {nullptr, "torch.tanh(x)", "torch.sigmoid(x)", "torch.softmax(x, 1)"};

// Writes the attributes that every traced module has.
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

// TorchScript source of a module's class: its attributes, then forward().
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
    zip.add("constants.pkl", std::string("\x80\x02).", 4)); // pickle of an empty tuple
    zip.add("version", std::string("3\n"));
    return zip.finish();
}

const std::string kModules = "torch.nn.modules.";

} // namespace

std::vector<std::byte> writeTorchScriptMlp(const Mlp& mlp, const std::string& stem)
{
    const char* activation = kActivationClasses[uint32_t(mlp.activation)];
    // the second Linear has a class name of its own, as tracing gives it
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

} // namespace gsc
