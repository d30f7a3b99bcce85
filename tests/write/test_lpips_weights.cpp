// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/lpips_weights.h"
#include "convert/input/torch/torch_archive.h"
#include "tests/input/model_fixture.h"
#include "tests/input/torch_files.h"
#include "tests/support/lpips_random.h"
#include "tests/support/source_folder.h"

#include <doctest/doctest.h>

#include <limits>

using namespace gsc;
using namespace gsc::test;

namespace {

const std::string kHeadsFile = sourceFolder() + "/tests/input/lpips_heads_legacy.pth";

std::vector<NamedTensor> headTensors(const LpipsWeights& weights)
{
    std::vector<NamedTensor> tensors;
    for (uint32_t stage = 0; stage < kLpipsStages; ++stage)
        tensors.push_back(
            {"lin" + std::to_string(stage) + ".model.1.weight", {1, kLpipsChannels[stage], 1, 1}, weights.head[stage]});
    return tensors;
}

std::vector<NamedTensor> netTensors(const LpipsWeights& weights)
{
    std::vector<NamedTensor> tensors;
    for (uint32_t i = 0; i < kLpipsConvolutions; ++i) {
        const LpipsConvolution& convolution = kLpipsNet[i];
        const std::string name = "features." + std::to_string(convolution.feature);
        tensors.push_back({name + ".weight", {convolution.out, convolution.in, 3, 3}, weights.weight[i]});
        tensors.push_back({name + ".bias", {convolution.out}, weights.bias[i]});
    }
    tensors.push_back({"classifier.6.bias", {3}, {1, 2, std::numeric_limits<float>::infinity()}}); // nobody reads it
    return tensors;
}

} // namespace

TEST_CASE("weights of LPIPS come from files of either format")
{
    const TemporaryFolder folder;
    const LpipsWeights expected = lpipsRandomWeights();
    writeFile(folder.path() / "net.pth", writeTensorArchive(netTensors(expected)));
    writeFile(folder.path() / "heads.pth", writeTensorArchive(headTensors(expected)));
    for (const std::string& heads : {kHeadsFile, (folder.path() / "heads.pth").string()}) {
        const LpipsWeights read = readLpipsWeights((folder.path() / "net.pth").string(), heads);
        CHECK(read.weight == expected.weight);
        CHECK(read.bias == expected.bias);
        CHECK(read.head == expected.head);
    }
}

TEST_CASE("weights of LPIPS may come from wrapped networks, and pointers to them are named")
{
    const TemporaryFolder folder;
    const LpipsWeights expected = lpipsRandomWeights();
    const std::string net = (folder.path() / "net.pth").string(), heads = (folder.path() / "heads.pth").string();
    for (const std::string prefix : {"module.", "_orig_mod.", "module._orig_mod."}) {
        std::vector<NamedTensor> wrapped = netTensors(expected), wrapped_heads = headTensors(expected);
        for (std::vector<NamedTensor>* tensors : {&wrapped, &wrapped_heads})
            for (NamedTensor& tensor : *tensors)
                tensor.name = prefix + tensor.name;
        writeFile(net, writeTensorArchive(wrapped));
        writeFile(heads, writeTensorArchive(wrapped_heads));
        const LpipsWeights read = readLpipsWeights(net, heads);
        CHECK(read.weight == expected.weight);
        CHECK(read.head == expected.head);
    }
    writeFile(heads, std::string("version https://git-lfs.github.com/spec/v1\noid sha256:aa\nsize 7289\n"));
    CHECK(outcomeOf([&] { (void)readLpipsWeights(net, heads); }).says("heads.pth: is a Git LFS pointer"));
    writeFile(net, std::string("<!DOCTYPE html>"));
    CHECK(outcomeOf([&] { (void)readLpipsWeights(net, heads); }).says("net.pth: is a web page"));
}

TEST_CASE("wrong files of LPIPS are refused with what was found and expected")
{
    const TemporaryFolder folder;
    const std::string net = (folder.path() / "net.pth").string(), heads = (folder.path() / "heads.pth").string();
    const std::vector<NamedTensor> good = netTensors(lpipsRandomWeights());
    writeFile(net, writeTensorArchive(good));
    const auto refuses = [&](const std::string& words) {
        const Outcome outcome = outcomeOf([&] { (void)readLpipsWeights(net, heads); });
        CAPTURE(outcome.message);
        CHECK(outcome.code == ErrorCode::InvalidFile);
        CHECK(outcome.says(words));
    };
    const auto refusesHeads = [&](auto change, const std::string& words) {
        std::vector<NamedTensor> tensors = headTensors(lpipsRandomWeights());
        change(tensors);
        writeFile(heads, writeTensorArchive(tensors));
        refuses("heads.pth: " + words);
    };
    const std::string advice = "; pass weights/v0.1/vgg.pth of PerceptualSimilarity to --lpips-heads";
    refusesHeads([](auto& t) { t.pop_back(); },
                 "has no tensor 'lin4.model.1.weight', expected one of 1 x 512 x 1 x 1" + advice);
    refusesHeads(
        [](auto& t) {
            t[1] = {t[1].name, {1, 192, 1, 1}, std::vector<float>(192)};
        }, // AlexNet's
        "tensor 'lin1.model.1.weight' is 1 x 192 x 1 x 1, expected 1 x 128 x 1 x 1" + advice);
    refusesHeads([](auto& t) { t[2].values[3] = std::numeric_limits<float>::quiet_NaN(); },
                 "tensor 'lin2.model.1.weight' holds values that are not finite, expected numbers");

    writeFile(heads, writeTensorArchive(headTensors(lpipsRandomWeights())));
    const auto refusesNet = [&](auto change, const std::string& words) {
        std::vector<NamedTensor> tensors(good.begin(), good.begin() + 4);
        change(tensors);
        writeFile(net, writeTensorArchive(tensors));
        refuses("net.pth: " + words);
    };
    refusesNet(
        [](auto& t) {
            t[2] = {t[2].name, {1, 64, 9}, std::vector<float>(576)};
        },
        "tensor 'features.2.weight' is 1 x 64 x 9, expected 64 x 64 x 3 x 3; pass torchvision's VGG16");
    refusesNet(
        [](auto& t) {
            t[1] = {t[1].name, {}, {1}};
        },
        "tensor 'features.0.bias' is a single number, expected 64");
    refusesNet([](auto&) {}, "has no tensor 'features.5.weight', expected one of 128 x 64 x 3 x 3");
}
