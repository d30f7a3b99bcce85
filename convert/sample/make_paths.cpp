// SPDX-License-Identifier: Apache-2.0
// Reads a model, makes its paths and writes them: all or none.
#include "convert/sample/make_paths.h"

#include "convert/sample/camera_paths.h"
#include "format/error.h"
#include "format/interrupt.h"
#include "format/mapped_file.h"
#include "player/length.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <unistd.h>

namespace gsc {

namespace fs = std::filesystem;

namespace {

// Temporaries beside the files they become; those left over are removed.
class PathFiles {
public:
    explicit PathFiles(const std::string& folder)
    {
        std::error_code error;
        m_made_folder = fs::create_directory(folder, error); // its parent must be there, as for every output
        if (error)
            throw Error(ErrorCode::Io, folder + ": " + error.message());
        m_folder = folder;
    }
    PathFiles(const PathFiles&) = delete;
    PathFiles& operator=(const PathFiles&) = delete;
    ~PathFiles()
    {
        std::error_code ignored;
        for (const auto& [temporary, path] : m_files)
            fs::remove(temporary, ignored);
        if (m_made_folder)
            fs::remove(m_folder, ignored); // fails unless it is empty
    }

    void add(const std::string& path, const std::string& text)
    {
        const std::string temporary = formatString("%s.part-%d", path.c_str(), int(::getpid()));
        m_files.emplace_back(temporary, path);
        writeFile(temporary, text);
    }

    void commit()
    {
        throwIfInterrupted();
        for (const auto& [temporary, path] : m_files) {
            std::error_code error;
            fs::rename(temporary, path, error);
            if (error)
                throw Error(ErrorCode::Io, path + ": " + error.message());
        }
        m_files.clear();
        m_made_folder = false;
    }

private:
    std::string m_folder;
    bool m_made_folder = false;
    std::vector<std::pair<std::string, std::string>> m_files;
};

// What --ipd or the file says; units 0 = neither does.
Metre metreOf(const GscView& view, const PathsOptions& options)
{
    if (options.ipd > 0)
        return {options.ipd / kEyeDistance, "given: the eyes are 0.064 m apart"};
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
            throw Error(ErrorCode::Usage, formatString("--only: there is no path \"%.40s\", expected some of %s",
                                                       name.c_str(), known.c_str()));
        }
    for (const std::string& name : options.only.empty() ? modelPathNames() : options.only) {
        const std::string path = fileOf(options, name);
        std::error_code error;
        if (const fs::file_status status = fs::symlink_status(path, error); fs::exists(status)) {
            if (!options.overwrite)
                throw Error(ErrorCode::Io, path + ": exists already; pass -w to replace it or choose another folder");
            if (fs::is_directory(status))
                throw Error(ErrorCode::Io, path + ": is a folder, expected a file or nothing");
        }
    }

    const MappedFile file(options.input);
    GscView view;
    std::string first;
    bool newer = false;
    const auto sink = [&](const Issue& issue) {
        if (!first.empty() || issue.info->severity == Severity::Warning)
            return;
        first = std::string(issue.info->summary) + ": " + issue.detail;
        newer = isUnsupported(*issue.info);
    };
    if (!openGsc(file.bytes(), view, GscCheck::Index, sink))
        throw Error(newer ? ErrorCode::Unsupported : ErrorCode::InvalidFile,
                    formatString("%s: is damaged or no .gsc file (%s); gsc validate tells all, gsc convert makes one "
                                 "from a checkpoint",
                                 options.input.c_str(), first.c_str()));
    const ModelSurvey survey = surveyModel(view, options.input, metreOf(view, options));
    PathsReport report;
    report.paths = modelPaths(survey, {options.width, options.height, options.fov_x}, options.fps, options.only);
    report.capture = survey.kind;
    report.cameras = survey.cameras.size();
    report.metre = survey.site.metre;
    report.metre_rule = survey.metre_rule;

    PathFiles files(options.output);
    for (const ModelPath& made : report.paths)
        files.add(fileOf(options, made.path.name), pathJson(made.path));
    files.commit();
    return report;
}

} // namespace gsc
