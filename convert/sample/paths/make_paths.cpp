// SPDX-License-Identifier: Apache-2.0
// Reads a model, makes its camera paths and writes either all of them or none.
#include "convert/sample/paths/make_paths.h"

#include "convert/sample/paths/site_paths.h"
#include <gsc/error.h>
#include <gsc/file/output_file.h>
#include <gsc/gsc_file.h>
#include "runtime/cameras/length.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <optional>

namespace gsc {

namespace fs = std::filesystem;

namespace {

// The metre that --ipd or the manifest states; its units are 0 if neither does.
Metre metreOf(const GscView& view, const PathsOptions& options)
{
    if (options.ipd.value > 0 && options.ipd.unit == LengthUnit::World)
        return {options.ipd.value / kEyesApart, "given: the eyes are 0.064 m apart"};
    return metreOfManifest(view.manifest).value_or(Metre{});
}

std::string fileOf(const PathsOptions& options, const std::string& name)
{
    return (fs::path(options.output) / (name + ".json")).string();
}

} // namespace

PathsReport makePaths(const PathsOptions& options)
{
    for (const std::string& name : options.only)
        if (const auto& names = modelPathNames(); std::find(names.begin(), names.end(), name) == names.end()) {
            std::string known;
            for (const std::string& n : names)
                known += (known.empty() ? "" : ", ") + n;
            throw Error(ErrorCode::Usage, "--only", formatString("there is no path \"%.40s\"", name.c_str()),
                        "some of " + known, "pass these, or leave it out");
        }
    for (const std::string& name : options.only.empty() ? modelPathNames() : options.only)
        checkOutput(fileOf(options, name), OutputKind::Binary, options.overwrite, OutputFolder::IsMade);
    // other files in the folder are kept
    checkOutputFolder(options.output, true);

    const IssueSink sink = throwFirstIssue(options.input);
    const GscFile file(options.input, sink);
    GscView view;
    openGsc(file.bytes(), view, GscCheck::Index, sink);
    const ModelSurvey survey = surveyModel(view, options.input, metreOf(view, options));
    PathsReport report;
    report.paths = modelPaths(survey, {options.width, options.height, options.fov_x}, options.fps, options.only);
    report.capture = survey.kind;
    report.cameras = survey.cameras.size();
    report.metre = survey.site.metre;
    report.metre_rule = survey.metre_rule;
    if (options.ipd.value > 0 && options.ipd.unit == LengthUnit::Metre)
        for (ModelPath& made : report.paths)
            made.path.ipd *= options.ipd.value / kEyesApart;

    OutputFiles files(options.overwrite);
    files.makeFolder(options.output);
    for (const ModelPath& made : report.paths)
        files.add(fileOf(options, made.path.name), OutputKind::Binary, trajectoryJson(made.path));
    files.commit();
    return report;
}

} // namespace gsc
