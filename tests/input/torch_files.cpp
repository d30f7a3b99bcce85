// SPDX-License-Identifier: Apache-2.0
#include "tests/input/torch_files.h"

#include "convert/input/torch/pickle_writer.h"

namespace gsc::test {

namespace {

// An OrderedDict, left on the stack with a mark for its items.
void beginDict(PickleWriter& pickle)
{
    pickle.global("collections", "OrderedDict");
    pickle.ops(")R");
    pickle.put();
    pickle.ops("(");
}

std::vector<std::byte> finish(const PickleWriter& pickle)
{
    ZipWriter zip("archive");
    zip.add("data.pkl", pickle.bytes());
    pickle.addStorages(zip);
    zip.add("version", std::string("3\n"));
    return zip.finish();
}

} // namespace

std::vector<std::byte> writeStateDictArchive(const std::vector<std::pair<std::string, const Mlp*>>& mlps,
                                             std::span<const float> embedding, uint32_t rows, uint32_t columns)
{
    PickleWriter pickle;
    // its items, then its attributes: {'_metadata': OrderedDict((path, {'version': 1}))}
    const auto endDict = [&](const std::vector<std::string>& paths) {
        pickle.ops("u}");
        pickle.put();
        pickle.string("_metadata");
        beginDict(pickle);
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
        beginDict(pickle);
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
        beginDict(pickle);
        pickle.string("embedding.weight");
        pickle.tensor(embedding, {rows, columns}, false);
        endDict({"", "embedding"});
    }
    pickle.ops("u.");

    return finish(pickle);
}

std::vector<std::byte> writeTensorArchive(std::span<const NamedTensor> tensors)
{
    PickleWriter pickle;
    beginDict(pickle);
    for (const NamedTensor& tensor : tensors) {
        pickle.string(tensor.name);
        pickle.tensor(tensor.values, tensor.shape, false);
    }
    pickle.ops("u.");

    return finish(pickle);
}

} // namespace gsc::test
