// SPDX-License-Identifier: Apache-2.0
#include "convert/bake/bake_facts.h"

#include <gsc/checksum.h>
#include <gsc/error.h>
#include "runtime/cli/version.h"

#include <algorithm>

namespace gsc {

namespace {

uint64_t checksumOf(const PoseSets& poses)
{
    Checksum64 sum;
    const auto add = [&](const auto& value) { sum.update(std::as_bytes(std::span(&value, 1))); };
    for (const std::vector<Camera>* set : {&poses.weights, &poses.search, &poses.verdict})
        for (const Camera& camera : *set) {
            sum.update(std::as_bytes(std::span(camera.name.c_str(), camera.name.size() + 1)));
            add(camera.rotation);
            add(camera.translation);
            for (const double value : {camera.fov_x, camera.fov_y, camera.tan_mid_x, camera.tan_mid_y})
                add(value);
            add(camera.width);
            add(camera.height);
            add(camera.appearance);
        }
    return sum.digest();
}

std::string targetText(const BakeOptions& options, std::span<const double> targets)
{
    std::string text;
    for (const double target : targets)
        text += formatString("%s%.17g", text.empty() ? "" : ", ", target);
    if (text.empty())
        text = options.target_psnr ? formatString("%.17g", *options.target_psnr) : "none";
    return text;
}

std::string leverText(uint32_t levers)
{
    std::string text;
    for (uint32_t i = 0; i < kLevers; ++i)
        if (levers >> i & 1u)
            text += (text.empty() ? "" : ", ") + std::string(kLeverNames[i]);
    return text;
}

} // namespace

std::vector<std::string> bakeFacts(const BakeOptions& options, std::span<const double> targets, const GscView& view,
                                   const PoseSets& poses, const Renderer& renderer)
{
    std::string device = deviceText(renderer.id()) + ", " + renderer.device().name;
    std::ranges::replace(device, '\n', ' ');
    return {"program: gsc " + toolVersion() + (toolCommit().empty() ? "" : ", " + toolCommit()),
            formatString("model: %llu bytes, checksum %016llx", (unsigned long long)view.header->file_bytes,
                         (unsigned long long)view.header->header_checksum),
            "target: " + targetText(options, targets),
            "worst view: " + (options.min_view_psnr ? formatString("%.17g", *options.min_view_psnr) : "4 below it"),
            "levers: " + leverText(options.levers),
            formatString("most pixels: %u", options.limits.most_pixels),
            formatString("poses: %zu, %zu and %zu, checksum %016llx", poses.weights.size(), poses.search.size(),
                         poses.verdict.size(), (unsigned long long)checksumOf(poses)),
            "drawn by: " + device};
}

} // namespace gsc
