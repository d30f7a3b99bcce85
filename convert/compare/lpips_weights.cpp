// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/lpips_weights.h"

#include "convert/input/torch/torch_archive.h"
#include <gsc/error.h>
#include <gsc/file/mapped_file.h>
#include "format/file/stand_in.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

std::string shapeText(const std::vector<uint64_t>& shape)
{
    std::string text;
    for (const uint64_t size : shape)
        text += (text.empty() ? "" : " x ") + std::to_string(size);
    return text.empty() ? "a single number" : text;
}

// Gives the tensors of a file by name. Its error messages end with `advice`, a description of the expected file.
class LpipsFile {
public:
    LpipsFile(const std::string& path, const char* prefix, std::string advice)
        : m_path(path), m_advice(std::move(advice))
    {
        // mapped and not read, because VGG16 has 528 MB, of which 59 MB are needed
        const MappedFile file(path);
        refuseStandIn(file.bytes(), file.bytes().size(), path);
        m_archive =
            readTorchArchive(file.bytes(), path, [=](const std::string& name) { return name.starts_with(prefix); });
    }

    std::vector<float> take(const std::string& name, const std::vector<uint64_t>& shape)
    {
        const auto found = std::ranges::find(m_archive.tensors, name, &NamedTensor::name);
        if (found == m_archive.tensors.end())
            invalid("has no tensor '" + name + "'", "one of " + shapeText(shape));
        if (found->shape != shape)
            invalid("tensor '" + name + "' is " + shapeText(found->shape), shapeText(shape));
        if (!std::ranges::all_of(found->values, [](float value) { return std::isfinite(value); }))
            invalid("tensor '" + name + "' holds values that are not finite", "numbers");
        return std::move(found->values);
    }

private:
    [[noreturn]] void invalid(const std::string& found, const std::string& expected) const
    {
        throw Error(ErrorCode::InvalidFile, m_path, found, expected, "pass " + m_advice);
    }

    std::string m_path, m_advice;
    TorchArchive m_archive;
};

} // namespace

LpipsWeights readLpipsWeights(const std::string& backbone, const std::string& heads)
{
    LpipsWeights weights;
    LpipsFile net(backbone, "features.", "torchvision's VGG16 (vgg16-397923af.pth) to --lpips-backbone");
    for (uint32_t i = 0; i < kLpipsConvolutions; ++i) {
        const LpipsConvolution& convolution = kLpipsNet[i];
        const std::string name = "features." + std::to_string(convolution.feature);
        weights.weight[i] = net.take(name + ".weight", {convolution.out, convolution.in, 3, 3});
        weights.bias[i] = net.take(name + ".bias", {convolution.out});
    }
    LpipsFile head(heads, "lin", "weights/v0.1/vgg.pth of PerceptualSimilarity to --lpips-heads");
    for (uint32_t stage = 0; stage < kLpipsStages; ++stage)
        weights.head[stage] =
            head.take("lin" + std::to_string(stage) + ".model.1.weight", {1, kLpipsChannels[stage], 1, 1});
    return weights;
}

} // namespace gsc
