// SPDX-License-Identifier: Apache-2.0
// PyTorch archives, and pickles by themselves: the CRC-32 of an archive would keep most mutations away from the pickle
// machine, so an input that is no zip archive is taken for the data.pkl of one.
#include "convert/input/torch/torch_archive.h"
#include "convert/input/torch/zip_archive.h"
#include "convert/input/torch/zip_writer.h"
#include <gsc/error.h>
#include "tests/fuzz/input_seeds.h"
#include "tests/input/legacy_file.h"
#include "tests/input/torch_files.h"

#include <cstdint>
#include <cstdlib>

namespace {

constexpr size_t kStorageFloats[] = {28, 4, 8,
                                     2}; // sizes of the seeds' tensors, so that mutated pickles find their data

gsc::Mlp smallMlp()
{
    gsc::Mlp mlp;
    mlp.activation = gsc::Activation::Tanh;
    const uint32_t sizes[] = {7, 4, 2};
    for (int i = 0; i < 2; ++i) {
        mlp.layers[i].in = sizes[i];
        mlp.layers[i].out = sizes[i + 1];
        mlp.layers[i].weight.assign(size_t(sizes[i]) * sizes[i + 1], 0.5f);
        mlp.layers[i].bias.assign(sizes[i + 1], 0.25f);
    }
    return mlp;
}

std::string text(const std::vector<std::byte>& bytes)
{
    return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// File of PyTorch before 1.6 with one tensor, or with one parameter.
std::string legacyFile(bool parameter)
{
    gsc::test::OldFile file;
    const std::string tensor = gsc::test::oldTensor();
    file.object =
        gsc::test::oldDict("w", parameter ? "ctorch.nn.parameter\nParameter\n)\x81(" + tensor + "\x88\x89Ntb" : tensor);
    return file.text();
}

} // namespace

extern "C" int LLVMFuzzerInitialize(int* argc, char*** argv)
{
    const gsc::Mlp mlp = smallMlp();
    const std::vector<float> embedding(8);
    const auto script = gsc::writeTorchScriptMlp(mlp, "opacity_mlp");
    const auto table = gsc::writeTorchScriptEmbedding(embedding, 4, 2, "embedding_appearance");
    const auto dictionary =
        gsc::test::writeStateDictArchive({{"opacity_mlp", &mlp}, {"cov_mlp", &mlp}}, embedding, 4, 2);
    gsc::test::addSeeds(argc, argv,
                        {text(script), text(table), text(dictionary), legacyFile(false), legacyFile(true),
                         text(gsc::ZipArchive(script, "seed").read("opacity_mlp/data.pkl")),
                         text(gsc::ZipArchive(table, "seed").read("embedding_appearance/data.pkl")),
                         text(gsc::ZipArchive(dictionary, "seed").read("archive/data.pkl"))});
    return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size)
{
    std::vector<std::byte> archive(reinterpret_cast<const std::byte*>(data),
                                   reinterpret_cast<const std::byte*>(data) + size);
    const bool zipped = size >= 2 && data[0] == 'P' && data[1] == 'K';
    const bool legacy = size >= 3 && data[0] == 0x80 && data[2] == 0x8a; // a pickle whose first value is a long integer
    if (!zipped && !legacy) {
        gsc::ZipWriter zip("archive");
        zip.add("data.pkl", archive);
        for (size_t i = 0; i < std::size(kStorageFloats); ++i)
            zip.add("data/" + std::to_string(i), std::string(kStorageFloats[i] * sizeof(float), '\1'));
        zip.add("version", std::string("3\n"));
        archive = zip.finish();
    }
    try {
        const gsc::TorchArchive result = gsc::readTorchArchive(archive, "fuzz.pt");
        for (const gsc::NamedTensor& tensor : result.tensors) {
            uint64_t count = 1;
            for (const uint64_t dimension : tensor.shape)
                count *= dimension;
            if (count != tensor.values.size()) // the reader's promise
                std::abort();
        }
    } catch (const gsc::Error&) {
    }
    return 0;
}
