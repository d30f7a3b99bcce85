// SPDX-License-Identifier: Apache-2.0
#include "convert/commands/command.h"

#include "convert/compare/compare_pictures.h"
#include "runtime/cli/version.h"

namespace gsc {

namespace {

struct ComparePicturesOptions {
    std::string reference, pictures;
    double min_psnr = 0; // dB that every picture must reach; 0 = no bound
    LpipsFiles lpips;
    int threads = 0;
};

Json picturesReport(const ComparePicturesOptions& options, const PictureSet& set, const std::string& lpips_missing,
                    bool pass, const Reporter& report)
{
    return {{"schema", "gsc.compare-pictures/1"},
            {"tool", {{"name", "gsc"}, {"version", toolVersion()}}},
            {"reference", options.reference},
            {"pictures", options.pictures},
            {"min_psnr", options.min_psnr > 0 ? Json(options.min_psnr) : Json(nullptr)},
            {"pass", pass},
            {"scores", pictureSetJson(set)},
            {"lpips_missing", lpips_missing.empty() ? Json(nullptr) : Json(lpips_missing)},
            {"warnings", report.warnings()},
            {"seconds", jsonNumber(report.seconds())}};
}

ErrorCode runComparePictures(const ComparePicturesOptions& options, Reporter& report)
{
    const std::unique_ptr<Lpips> lpips = openLpips(options.lpips, options.threads);
    const PictureSet set = comparePictures(options.reference, options.pictures, lpips.get(), report);
    const std::string lpips_missing = whyNoLpips(lpips.get(), set);
    const bool pass = options.min_psnr == 0 || set.passes(options.min_psnr);
    if (report.json())
        report.object(picturesReport(options, set, lpips_missing, pass, report));
    else
        report.text(pictureSetText("pictures", set) + (lpips_missing.empty() ? "" : lpips_missing + '\n'));
    if (!pass)
        report.done(formatString("a picture is below %g dB", options.min_psnr));
    return pass ? ErrorCode::Ok : ErrorCode::Difference;
}

} // namespace

std::array<OptionHandle, 2> addLpipsOptions(CLI::App& command, LpipsFiles& files)
{
    const OptionHandle backbone = addText(command, "--lpips-backbone", files.backbone, "FILE.pth",
                                          "weights of VGG16 for LPIPS: torchvision's vgg16-397923af.pth")
                                      .rare();
    const OptionHandle heads = addText(command, "--lpips-heads", files.heads, "FILE.pth",
                                       "weights of LPIPS v0.1 for VGG16: vgg.pth of PerceptualSimilarity")
                                   .rare();
    backbone.needs(heads);
    heads.needs(backbone);
    return {backbone, heads};
}

void addComparePicturesCommand(CLI::App& app, Invocation& invocation)
{
    auto options = std::make_shared<ComparePicturesOptions>();
    CLI::App& command = addCommand(app, "compare-pictures", "Score pictures against others: PSNR, SSIM, FLIP, LPIPS");
    addText(command, "REFERENCE", options->reference, "DIR|FILE", "picture, or folder of pictures, to compare with")
        .required();
    addText(command, "PICTURES", options->pictures, "DIR|FILE",
            "picture, or folder of pictures, to score; of a folder those with names that REFERENCE has")
        .required();
    addNumber(command, "--min-psnr", options->min_psnr, {0, 1000}, " dB", "DB (default: 0)",
              "least PSNR of a picture; a lower one counts as a difference; 0 = no bound");
    addLpipsOptions(command, options->lpips);
    addInteger(command, "-j,--threads", options->threads, 0, 4096, "N (default: 0)",
               "threads for LPIPS, 0 = all cores");
    addReporterOptions(command, invocation.reporter, true);
    setFooter(command, "Extensions may differ: an EXR is compared with a PNG of the same name. Exits\n"
                       "with 8 if a picture is below --min-psnr.\n"
                       "\n"
                       "example:\n"
                       "  gsc-play city.gsc --tier exact --out 'exact/{name}.png' && \\\n"
                       "      gsc-play city.gsc --out 'fast/{name}.png'\n"
                       "  gsc compare-pictures exact fast --min-psnr 50");
    onParsed(command, invocation, options, runComparePictures);
}

} // namespace gsc
