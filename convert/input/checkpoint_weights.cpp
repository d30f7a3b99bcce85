// SPDX-License-Identifier: Apache-2.0
// Reads the MLPs and the appearance embedding from any of the three file layouts that the trainers have used.
#include "format/numbers/count_text.h"
#include "convert/input/checkpoint_model.h"

#include "convert/input/input_file.h"
#include "convert/input/model_names.h"
#include "convert/input/torch/torch_archive.h"
#include <gsc/error.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <initializer_list>
#include <string_view>

namespace gsc {

namespace {

constexpr uint64_t kMaxArchive = 1ull << 30; // bytes; an appearance embedding of 100,000 images takes 13 MB

constexpr Activation kActivations[] = {Activation::Tanh, Activation::None, Activation::Sigmoid,
                                       // activation behind the last layer of each MlpKind
                                       Activation::Softmax};
constexpr uint32_t kBank = uint32_t(MlpKind::FeatureBank);

const NamedTensor* findTensor(const TorchArchive& archive, const std::string& name)
{
    for (const NamedTensor& tensor : archive.tensors)
        if (tensor.name == name)
            return &tensor;
    return nullptr;
}

// Names of the tensors that a file has, for messages.
std::string tensorNames(const TorchArchive& archive)
{
    constexpr size_t kShown = 8;
    std::string names;
    for (size_t i = 0; i < std::min(archive.tensors.size(), kShown); ++i)
        names += (i == 0 ? "'" : ", '") + archive.tensors[i].name.substr(0, 64) + "'";
    if (archive.tensors.size() > kShown)
        names += formatString(" and %zu more", archive.tensors.size() - kShown);
    return names.empty() ? "none" : names;
}

const NamedTensor& requireTensor(const TorchArchive& archive, const std::string& name, size_t dimensions,
                                 const std::string& path)
{
    const NamedTensor* tensor = findTensor(archive, name);
    if (!tensor || tensor->shape.size() != dimensions)
        throw Error(ErrorCode::Unsupported, path,
                    formatString("tensor '%s' is missing or has not %zu dimensions, found %s", name.c_str(), dimensions,
                                 tensorNames(archive).c_str()),
                    "Linear, ReLU, Linear", "pass the files the trainer wrote");
    return *tensor;
}

LinearLayer readLayer(const TorchArchive& archive, const std::string& prefix, const std::string& path)
{
    const NamedTensor& weight = requireTensor(archive, prefix + "weight", 2, path);
    const NamedTensor& bias = requireTensor(archive, prefix + "bias", 1, path);
    constexpr uint64_t most = 1u << 20;
    if (weight.shape[0] == 0 || weight.shape[1] == 0 || weight.shape[0] > most || weight.shape[1] > most ||
        bias.shape[0] != weight.shape[0])
        throw Error(ErrorCode::InvalidFile, path,
                    formatString("'%sweight' is %llu x %llu and its bias has %s", prefix.c_str(),
                                 static_cast<unsigned long long>(weight.shape[0]),
                                 static_cast<unsigned long long>(weight.shape[1]),
                                 formatCount(bias.shape[0], "value").c_str()),
                    "one per row", "pass the files the trainer wrote");
    return {uint32_t(weight.shape[1]), uint32_t(weight.shape[0]), weight.values, bias.values};
}

// Throws if a tensor whose name starts with `prefix` is not listed in `read`: such a network would compute something
// else.
void checkNames(const TorchArchive& archive, const std::string& prefix, std::initializer_list<std::string_view> read,
                const char* expected, const std::string& path)
{
    for (const NamedTensor& tensor : archive.tensors)
        if (tensor.name.starts_with(prefix) &&
            std::ranges::find(read, std::string_view(tensor.name).substr(prefix.size())) == read.end())
            throw Error(ErrorCode::Unsupported, path, "holds '" + tensor.name.substr(0, 64) + "'",
                        std::string(expected) + " and no such layer",
                        "only the MLPs of Scaffold-GS and Octree-GS can be converted");
}

// Throws if the layers of a TorchScript file have other classes than expected. A file of plain tensors does not name
// classes.
void checkModules(const TorchArchive& archive, Activation activation, const std::string& path)
{
    if (!archive.is_script)
        return;
    const auto expect = [&](const std::string& child, const char* type) {
        const auto found = std::find_if(archive.modules.begin(), archive.modules.end(),
                                        [&](const auto& module) { return module.first == child; });
        const std::string actual = found == archive.modules.end() ? "absent" : found->second;
        if (actual != (type ? type : "absent"))
            throw Error(ErrorCode::Unsupported, path, "layer " + child + " is " + actual,
                        (type ? type : "no such layer"), "only the MLPs of Scaffold-GS and Octree-GS can be converted");
    };
    expect("0", "Linear");
    expect("1", "ReLU");
    expect("2", "Linear");
    expect("3", kActivationClasses[uint32_t(activation)]);
    for (const auto& [child, type] : archive.modules)
        if (child != "0" && child != "1" && child != "2" && child != "3")
            expect(child, nullptr);
}

Mlp readMlp(const TorchArchive& archive, uint32_t kind, const std::string& prefix, const std::string& path,
            std::vector<std::string>& warnings)
{
    // tiny-cuda-nn stores one flat vector per network, in an order that we do not know
    for (const NamedTensor& tensor : archive.tensors)
        if (tensor.name == prefix + "params" || (tensor.name.starts_with(prefix) && tensor.name.ends_with(".params")))
            throw Error(ErrorCode::Unsupported, path, "'" + tensor.name + "' is a tiny-cuda-nn network",
                        "torch.nn.Linear layers", "train without use_tcnn");
    checkModules(archive, kActivations[kind], path);
    Mlp mlp;
    mlp.kind = MlpKind(kind);
    mlp.activation = kActivations[kind];
    mlp.layers[0] = readLayer(archive, prefix + "0.", path);
    mlp.layers[1] = readLayer(archive, prefix + "2.", path);
    checkNames(archive, prefix, {"0.weight", "0.bias", "2.weight", "2.bias"}, "Linear, ReLU, Linear", path);
    if (mlp.layers[1].in != mlp.layers[0].out)
        throw Error(ErrorCode::InvalidFile, path,
                    formatString("second layer of '%s' takes %u values", kMlpNames[kind], mlp.layers[1].in),
                    formatString("the %u that the first gives", mlp.layers[0].out), "pass the files the trainer wrote");
    for (const LinearLayer& layer : mlp.layers)
        for (const std::vector<float>* values : {&layer.weight, &layer.bias})
            if (!std::all_of(values->begin(), values->end(), [](float v) { return std::isfinite(v); })) {
                warnings.push_back(path + ": weights of '" + kMlpNames[kind] + "' are not all finite numbers");
                return mlp;
            }
    return mlp;
}

// Returns false for the counters that wrappers and layers keep beside their weights, such as n_averaged of
// AveragedModel: they are not needed.
bool isWeight(const std::string& name)
{
    const std::string_view last = std::string_view(name).substr(name.find_last_of('.') + 1);
    return !last.starts_with("n_averaged") && !last.starts_with("num_batches_tracked");
}

TorchArchive readArchive(const std::string& path)
{
    return readTorchArchive(readWholeFile(path, kMaxArchive, "a PyTorch archive"), path, isWeight);
}

void readEmbedding(const TorchArchive& archive, const std::string& prefix, const std::string& path,
                   Checkpoint& checkpoint)
{
    const NamedTensor& weight = requireTensor(archive, prefix + "embedding.weight", 2, path);
    checkNames(archive, prefix, {"embedding.weight"}, "one table of rows", path);
    if (weight.shape[0] == 0 || weight.shape[1] == 0 || weight.shape[0] > 1u << 24 || weight.shape[1] > 1024)
        throw Error(ErrorCode::InvalidFile, path, "appearance embedding is no table of rows",
                    "one row per training image", "pass the file the trainer wrote");
    checkpoint.appearance_dim = uint32_t(weight.shape[1]);
    checkpoint.embedding = weight.values;
}

// Reads one file per network: opacity_mlp.pt, cov_mlp.pt, color_mlp.pt and, if there, feature_bank_mlp.pt and
// embedding_appearance.pt.
void readSplit(const CheckpointFiles& files, Checkpoint& checkpoint)
{
    const std::filesystem::path folder = files.folder;
    for (uint32_t kind = 0; kind <= kBank; ++kind) {
        const std::string name = std::string(kMlpNames[kind]) + ".pt";
        if (!files.has(name)) {
            if (kind == kBank)
                continue;
            throw Error(ErrorCode::InvalidFile, files.folder, name + " is missing beside the other .pt files",
                        "opacity_mlp.pt, cov_mlp.pt and color_mlp.pt", "copy the whole folder");
        }
        const std::string path = (folder / name).string();
        checkpoint.mlps.push_back(readMlp(readArchive(path), kind, "", path, checkpoint.warnings));
        checkpoint.weight_paths.push_back(path);
    }
    if (!files.has("embedding_appearance.pt"))
        return;
    const std::string path = (folder / "embedding_appearance.pt").string();
    readEmbedding(readArchive(path), "", path, checkpoint);
    checkpoint.weight_paths.push_back(path);
}

// Throws if the file holds networks beyond those of Scaffold-GS that its trainer needs for drawing; warns of those it
// does not need.
void checkOtherNetworks(const TorchArchive& archive, const std::string& path, std::vector<std::string>& warnings)
{
    bool normals = false;
    for (const NamedTensor& tensor : archive.tensors) {
        const std::string_view name = tensor.name;
        for (const char* key : {"encoding_xyz", "grid_mlp", "deform_mlp"})
            if (name.starts_with(key))
                throw Error(
                    ErrorCode::Unsupported, path,
                    std::string("holds '") + key +
                        "', so this is a HAC model, whose features must first be quantised by its context model",
                    "Scaffold-GS", "decode it with HAC's own code and train on from there");
        normals = normals || name.starts_with("anchor_normals_mlp");
    }
    // GSDF draws as Scaffold-GS does; it used the normals only to train a surface
    if (normals)
        warnings.push_back(path + ": 'anchor_normals_mlp' of this GSDF model is left out, no image depends on it");
}

// Name of the feature bank in a file, empty if it has none. Scaffold-GS before 2024-01-22 called it mlp_feature_bank.
std::string bankKey(const TorchArchive& archive)
{
    for (const std::string key : {"feature_bank_mlp", "mlp_feature_bank"})
        if (std::ranges::any_of(archive.tensors, [&](const NamedTensor& t) { return t.name.starts_with(key + "."); }))
            return key;
    return "";
}

// Reads a file that holds all networks: checkpoints.pth (Scaffold-GS and Octree-GS with the option "unite") or
// checkpoint.pth (Scaffold-GS before 2024-01-22).
void readUnited(const std::string& path, Checkpoint& checkpoint)
{
    const TorchArchive archive = readArchive(path);
    checkOtherNetworks(archive, path, checkpoint.warnings);
    for (uint32_t kind = 0; kind <= kBank; ++kind) {
        const std::string key = kind == kBank ? bankKey(archive) : kMlpNames[kind];
        if (key.empty())
            continue;
        checkpoint.mlps.push_back(readMlp(archive, kind, key + ".", path, checkpoint.warnings));
    }
    if (findTensor(archive, "appearance.embedding.weight"))
        readEmbedding(archive, "appearance.", path, checkpoint);
    checkpoint.weight_paths.push_back(path);
}

} // namespace

void readWeights(const CheckpointFiles& files, Checkpoint& checkpoint)
{
    const bool split = files.has("opacity_mlp.pt") || files.has("cov_mlp.pt") || files.has("color_mlp.pt");
    const bool unite = files.has("checkpoints.pth");
    const bool v1 = files.has("checkpoint.pth");
    if (split + unite + v1 > 1)
        checkpoint.warnings.push_back(files.folder + ": holds the weights more than once; read " +
                                      (split ? "the .pt files" : "checkpoints.pth"));
    if (split) {
        checkpoint.container = "split";
        readSplit(files, checkpoint);
    } else if (unite || v1) {
        checkpoint.container = unite ? "unite" : "v1";
        readUnited((std::filesystem::path(files.folder) / (unite ? "checkpoints.pth" : "checkpoint.pth")).string(),
                   checkpoint);
    } else {
        throw Error(ErrorCode::InvalidFile, files.folder, "no MLP weights beside the PLY",
                    "opacity_mlp.pt, cov_mlp.pt and color_mlp.pt, or checkpoints.pth, or checkpoint.pth",
                    "copy the whole iteration folder of the trainer");
    }
}

} // namespace gsc
