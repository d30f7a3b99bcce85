// SPDX-License-Identifier: Apache-2.0
#include "runtime/cameras/camera_folder.h"

#include <gsc/error.h>
#include "runtime/cameras/colmap_cameras.h"

#include <algorithm>
#include <filesystem>
#include <iterator>
#include <utility>

namespace gsc {

namespace {

using Paths = std::vector<std::filesystem::path>;

bool isFile(const std::filesystem::path& path)
{
    std::error_code none;
    return std::filesystem::is_regular_file(path, none);
}

// Models in `folder` and in its folders that are called 0, 1 and so on, as COLMAP's mapper leaves them.
void addModels(const std::filesystem::path& folder, Paths& models)
{
    std::error_code none;
    if (isColmapModel(folder.string()) && std::filesystem::is_directory(folder, none))
        models.push_back(folder);
    Paths numbered;
    for (std::filesystem::directory_iterator entry(folder, none), end; !none && entry != end; entry.increment(none)) {
        const std::string name = entry->path().filename().string();
        const bool is_number = name.find_first_not_of("0123456789") == std::string::npos;
        std::error_code ignored;
        if (is_number && entry->is_directory(ignored) && isColmapModel(entry->path().string()))
            numbered.push_back(entry->path());
    }
    const auto number = [](const std::filesystem::path& path) {
        const std::string name = path.filename().string();
        return std::make_pair(name.size(), name);
    };
    std::ranges::sort(numbered, {}, number);
    models.insert(models.end(), numbered.begin(), numbered.end());
}

// What there is to choose from, the first to be taken; each is what is read together.
std::vector<Paths> choicesIn(const std::filesystem::path& folder)
{
    std::vector<Paths> choices;
    Paths models;
    addModels(folder / "sparse", models);
    addModels(folder / "colmap" / "sparse", models);
    addModels(folder, models);
    // the trainers take that one, whatever lies beside it
    std::stable_partition(models.begin(), models.end(),
                          [&](const auto& model) { return model == folder / "sparse" / "0"; });
    for (const std::filesystem::path& model : models)
        choices.push_back({model});
    Paths pair;
    for (const char* name : {"transforms_test.json", "transforms_train.json"})
        if (isFile(folder / name))
            pair.push_back(folder / name);
    if (!pair.empty())
        choices.push_back(pair);
    for (const char* name : {"transforms.json", "transforms_val.json"})
        if (isFile(folder / name))
            choices.push_back({folder / name});
    if (isFile(folder / "cameras.json")) // of a trained model
        choices.push_back({folder / "cameras.json"});
    return choices;
}

std::string namesOf(const Paths& paths, const std::filesystem::path& folder)
{
    std::string names;
    for (const std::filesystem::path& path : paths)
        names += (names.empty() ? "" : " with ") + path.lexically_relative(folder).generic_string();
    return names;
}

} // namespace

bool isCameraFolder(const std::string& path)
{
    std::error_code none;
    return std::filesystem::is_directory(path, none) && !isColmapModel(path) && !choicesIn(path).empty();
}

void refuseFolderWithout(const std::string& path)
{
    std::error_code none;
    if (!std::filesystem::is_directory(path, none) || isColmapModel(path) || isCameraFolder(path))
        return;
    const std::filesystem::path folder(path);
    const bool half = isFile(folder / "cameras.txt") || isFile(folder / "cameras.bin");
    throw Error(
        ErrorCode::Io,
        formatString("%s: is a folder %s, expected cameras.json, transforms.json, transforms_train.json, sparse/0 "
                     "or a COLMAP model (cameras.txt with images.txt, or both as .bin) in it; pass the folder or "
                     "the file that holds the cameras",
                     path.c_str(), half ? "with a COLMAP model's cameras but not its images" : "without cameras"));
}

std::vector<Camera> readCameraFolder(const std::string& path, TrajectoryFacts* eyes, const CameraReading& how)
{
    const std::vector<Paths> choices = choicesIn(path);
    std::string others;
    for (size_t i = 1; i < choices.size(); ++i)
        others += (i == 1 ? "" : ", ") + namesOf(choices[i], path);
    if (!others.empty())
        how.warn(formatString("%s: cameras are taken from %s; %s is there too, pass its path for those", path.c_str(),
                              namesOf(choices[0], path).c_str(), others.c_str()));
    std::vector<Camera> cameras;
    for (const std::filesystem::path& one : choices[0])
        std::ranges::move(readCameraFile(one.string(), eyes, how), std::back_inserter(cameras));
    return cameras;
}

} // namespace gsc
