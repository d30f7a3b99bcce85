// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_source.h"

#include <gsc/error.h>

#include <algorithm>
#include <optional>
#include <utility>

namespace gsc {

namespace fs = std::filesystem;

namespace {

using Choice = std::vector<CameraFiles>; // one choice: files that are read together

bool isFile(const fs::path& path)
{
    std::error_code none;
    return fs::is_regular_file(path, none);
}

// Returns the COLMAP model whose files lie in `folder`; none if the model has no images.
std::optional<CameraFiles> modelIn(const fs::path& folder)
{
    const bool images_bin = isFile(folder / "images.bin"), images_txt = isFile(folder / "images.txt");
    if (!images_bin && !images_txt)
        return std::nullopt;
    const bool text = images_txt && isFile(folder / "cameras.txt");
    const bool binary = images_bin && (!text || isFile(folder / "cameras.bin"));
    const CameraForm form = !binary ? CameraForm::ModelInText
                            : text  ? CameraForm::ModelInBoth
                                    : CameraForm::ModelInBinary;
    return CameraFiles{folder.string(), form, folder};
}

// Adds the COLMAP models in `folder` and in its folders named 0, 1 and so on, which COLMAP's mapper makes.
void addModels(const fs::path& folder, Choice& models)
{
    std::error_code none;
    if (const auto model = modelIn(folder))
        models.push_back(*model);
    Choice numbered;
    for (fs::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none))
        if (entry->path().filename().string().find_first_not_of("0123456789") == std::string::npos)
            if (const auto model = modelIn(entry->path()))
                numbered.push_back(*model);
    std::ranges::sort(numbered, {}, [](const CameraFiles& model) { return std::pair(model.name.size(), model.name); });
    models.insert(models.end(), numbered.begin(), numbered.end());
}

// Returns the camera files in `folder` that could be read; the first is the one to read.
std::vector<Choice> choicesIn(const fs::path& folder)
{
    Choice models;
    addModels(folder / "sparse", models);
    addModels(folder / "colmap" / "sparse", models);
    addModels(folder, models);
    // the trainers read sparse/0, whatever lies beside it
    std::stable_partition(models.begin(), models.end(),
                          [&](const auto& model) { return model.folder == folder / "sparse" / "0"; });
    std::vector<Choice> choices;
    for (const CameraFiles& model : models)
        choices.push_back({model});
    const auto add = [&](const auto&... names) {
        Choice found;
        for (const char* name : {names...})
            if (isFile(folder / name))
                found.push_back({(folder / name).string(), CameraForm::Json, folder});
        if (!found.empty())
            choices.push_back(found);
    };
    add("transforms_test.json", "transforms_train.json");
    add("transforms.json");
    add("transforms_val.json");
    add("cameras.json"); // a trained model's
    return choices;
}

std::string namesOf(const Choice& choice, const fs::path& folder)
{
    std::string names;
    for (const CameraFiles& files : choice)
        names += (names.empty() ? "" : " with ") + fs::path(files.name).lexically_relative(folder).generic_string();
    return names;
}

} // namespace

std::vector<CameraFiles> findCameras(const std::string& path, const CameraReading& how)
{
    const fs::path folder(path);
    std::error_code none;
    if (!fs::is_directory(folder, none)) {
        const std::string file = folder.filename().string();
        const bool text = file == "images.txt" || file == "cameras.txt";
        const bool binary = file == "images.bin" || file == "cameras.bin";
        const CameraForm form = text ? CameraForm::ModelInText : binary ? CameraForm::ModelInBinary : CameraForm::Json;
        return {{path, form, folder.parent_path()}};
    }
    if (const auto model = modelIn(folder))
        return {*model};
    const std::vector<Choice> choices = choicesIn(folder);
    if (choices.empty()) {
        const bool half = isFile(folder / "cameras.txt") || isFile(folder / "cameras.bin");
        throw Error(ErrorCode::Io, path,
                    formatString("is a folder %s",
                                 half ? "with a COLMAP model's cameras but not its images" : "without cameras"),
                    "cameras.json, transforms.json, transforms_train.json, sparse/0 or a COLMAP model (cameras.txt "
                    "with images.txt, or both as .bin) in it",
                    "pass the folder or the file that holds the cameras");
    }
    std::string others;
    for (size_t i = 1; i < choices.size(); ++i)
        others += (i == 1 ? "" : ", ") + namesOf(choices[i], folder);
    if (!others.empty())
        how.warn(formatString("%s: cameras are taken from %s; %s is there too, pass its path for those", path.c_str(),
                              namesOf(choices[0], folder).c_str(), others.c_str()));
    return choices[0];
}

} // namespace gsc
