// SPDX-License-Identifier: Apache-2.0
#include "convert/compare/picture_set.h"

#include "convert/compare/lpips_weights.h"
#include <gsc/error.h>
#include "runtime/records/report_parts.h"

#include <algorithm>
#include <cmath>

namespace gsc {

namespace {

OrderedJson optionalNumber(const std::optional<double>& value)
{
    return value ? jsonNumber(*value) : OrderedJson(nullptr);
}

OrderedJson viewsJson(const std::vector<ScoredPicture>& views)
{
    OrderedJson json = OrderedJson::array();
    for (const ScoredPicture& view : views)
        json.push_back({{"name", view.name},
                        {"width", view.width},
                        {"height", view.height},
                        {"picture_bits", view.picture_bits ? OrderedJson(view.picture_bits) : OrderedJson(nullptr)},
                        {"psnr", jsonNumber(view.difference.psnr)},
                        {"mse", jsonNumber(view.difference.mse)},
                        {"max_error", jsonNumber(view.difference.max_error)},
                        {"max_at", {view.difference.max_x, view.difference.max_y}},
                        {"pixels_over_1_255", view.difference.over_1_255},
                        {"ssim", jsonNumber(view.ssim)},
                        {"flip", jsonNumber(view.flip)},
                        {"lpips", optionalNumber(view.lpips)}});
    return json;
}

double meanOf(const std::vector<ScoredPicture>& views, double ScoredPicture::*score)
{
    double sum = 0;
    for (const ScoredPicture& view : views)
        sum += view.*score;
    return sum / double(views.size());
}

} // namespace

ScoredPicture scorePicture(const std::string& name, const Image& expected, const Image& actual, const Lpips* lpips)
{
    const ImageView a{expected.pixels.data(), expected.width, expected.height};
    const ImageView b{actual.pixels.data(), actual.width, actual.height};
    ScoredPicture view;
    view.name = name;
    view.width = actual.width;
    view.height = actual.height;
    view.difference = compareImages(a, b);
    view.ssim = ssim(a, b);
    view.flip = flip(a, b);
    if (lpips != nullptr && view.width >= kLpipsSmallest && view.height >= kLpipsSmallest)
        view.lpips = lpips->distance(a, b).total;
    return view;
}

void PictureSet::add(ScoredPicture view)
{
    pool.add(view.difference);
    views.push_back(std::move(view));
}

double PictureSet::ssim() const
{
    return meanOf(views, &ScoredPicture::ssim);
}

double PictureSet::flip() const
{
    return meanOf(views, &ScoredPicture::flip);
}

std::optional<double> PictureSet::lpips() const
{
    double sum = 0;
    for (const ScoredPicture& view : views) {
        if (!view.lpips)
            return std::nullopt;
        sum += *view.lpips;
    }
    return sum / double(views.size());
}

bool PictureSet::passes(double min_psnr) const
{
    // the comparison is written so that NaN fails
    return std::ranges::all_of(views, [&](const ScoredPicture& view) { return view.difference.psnr >= min_psnr; });
}

std::unique_ptr<Lpips> openLpips(const LpipsFiles& files, int threads)
{
    if (files.backbone.empty() || files.heads.empty())
        return nullptr;
    return std::make_unique<Lpips>(readLpipsWeights(files.backbone, files.heads), threads);
}

std::string whyNoLpips(const Lpips* lpips, const PictureSet& pictures)
{
    if (lpips == nullptr)
        return "LPIPS: not computed, needs --lpips-backbone and --lpips-heads";
    const auto none = std::ranges::find_if(pictures.views, [](const ScoredPicture& view) { return !view.lpips; });
    if (none == pictures.views.end())
        return {};
    return formatString("LPIPS: not computed for %s of %ux%u pixels, needs %ux%u or more", none->name.c_str(),
                        none->width, none->height, kLpipsSmallest, kLpipsSmallest);
}

OrderedJson pictureSetJson(const PictureSet& pictures)
{
    if (pictures.views.empty())
        return nullptr;
    const PooledDifference& pool = pictures.pool;
    return {{"psnr", jsonNumber(pool.psnr())}, // null if the pictures are equal
            {"worst_psnr", jsonNumber(pool.worst_psnr)}, {"worst_view", pictures.views[size_t(pool.worst_frame)].name},
            {"max_error", jsonNumber(pool.max_error)},   {"mse", jsonNumber(pictures.mse())},
            {"ssim", jsonNumber(pictures.ssim())},       {"flip", jsonNumber(pictures.flip())},
            {"lpips", optionalNumber(pictures.lpips())}, {"views", viewsJson(pictures.views)}};
}

std::string pictureSetText(const char* title, const PictureSet& pictures)
{
    if (pictures.views.empty())
        return formatString("%-24s none\n", title);
    const PooledDifference& pool = pictures.pool;
    std::string text = formatString("%-24s pooled %s, worst %s (%s), max error %.3g\n", title,
                                    decibels(pool.psnr(), " dB").c_str(), decibels(pool.worst_psnr, " dB").c_str(),
                                    pictures.views[size_t(pool.worst_frame)].name.c_str(), pool.max_error);
    for (const ScoredPicture& view : pictures.views)
        text +=
            formatString("  %-22s %s, max error %.3g, MSE %.3g, SSIM %.4f, FLIP %.4f%s%s\n", view.name.c_str(),
                         decibels(view.difference.psnr, " dB").c_str(), view.difference.max_error, view.difference.mse,
                         view.ssim, view.flip, view.lpips ? formatString(", LPIPS %.4f", *view.lpips).c_str() : "",
                         view.picture_bits == 8 ? ", beyond the rounding of an 8-bit picture" : "");
    return text;
}

} // namespace gsc
